//! Distributions of times as bars and as text.

use bench_dragon::output::histogram::{Bars, LatencyHistogram, PercentileText};

fn histogram(values_ns: impl IntoIterator<Item = u64>) -> LatencyHistogram {
    let mut histogram = LatencyHistogram::default();
    values_ns.into_iter().for_each(|value_ns| histogram.record(value_ns));
    histogram
}

fn bars(values_ns: &[(u64, u64)]) -> String {
    let values = values_ns.iter().flat_map(|&(value_ns, count)| (0..count).map(move |_| value_ns));
    Bars(&histogram(values)).to_string()
}

#[test]
fn each_interval_has_a_bar_as_long_as_its_share_of_the_greatest() {
    let full = "\u{2588}".repeat(40);
    let half = format!("{:<40}", "\u{2588}".repeat(20));
    let least = format!("{:<40}", "\u{258f}");
    let expected = format!(
        "     50 \u{2013} 70      {half}  500\n\
         \x20    70 \u{2013} 100     {full}  1000\n\
         \x20   100 \u{2013} 150     {:<40}  0\n\
         \x20   150 \u{2013} 200     {least}  1\n",
        ""
    );
    assert_eq!(bars(&[(60_000, 500), (80_000, 1000), (160_000, 1)]), expected);
}

#[test]
fn any_distribution_is_shown_completely_in_lines_that_fit_a_terminal() {
    let an_hour_ns = 3_600_000_000_000;
    let text = bars(&[(0, 1), (1, 1), (99, 1), (1_499, 3), (an_hour_ns, 1_000)]);
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    let counted = text.lines().filter_map(|line| line.split_whitespace().last()?.parse::<u64>().ok()).sum::<u64>();
    assert_eq!(counted, 1_006, "{text}");
    assert!(text.lines().count() < 70, "{text}");
}

#[test]
fn an_empty_histogram_has_no_bars() {
    assert_eq!(bars(&[]), "");
}

#[test]
fn text_has_the_columns_and_the_footer_of_the_java_library() {
    let text = PercentileText(&histogram([1_000, 2_000, 3_000, 4_000])).to_string();
    let expected = "       Value     Percentile TotalCount 1/(1-Percentile)\n\n       \
        1.000 0.000000000000          1           1.00\n       \
        1.000 0.100000000000          1           1.11\n";
    assert!(text.starts_with(expected), "{text}");
    let footer = "       4.001 1.000000000000          4\n\
        #[Mean    =        2.501, StdDeviation   =        1.118]\n\
        #[Max     =        4.001, Total count    =            4]\n\
        #[Buckets =           32, SubBuckets     =         2048]\n";
    assert!(text.ends_with(footer), "{text}");
}

#[test]
fn rows_increase_up_to_the_total_count() {
    let text = PercentileText(&histogram((0..10_000).map(|i| 1_000 + i * i))).to_string();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(2)
        .take_while(|line| !line.starts_with('#'))
        .map(|line| line.split_whitespace().map(|cell| cell.parse().expect("a number")).collect())
        .collect();
    assert!(rows.len() > 50, "{text}");
    for column in 0..3 {
        assert!(rows.is_sorted_by(|before, after| before[column] <= after[column]), "column {column} of {text}");
    }
    assert_eq!(rows.last().map(|row| (row[1], row[2])), Some((1.0, 10_000.0)));
}

#[test]
fn an_empty_histogram_is_a_table_without_rows() {
    let text = PercentileText(&LatencyHistogram::default()).to_string();
    assert_eq!(text.lines().count(), 5, "{text}");
    assert!(text.contains("Total count    =            0]"), "{text}");
}
