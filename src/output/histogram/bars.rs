//! A distribution as bars for a terminal: how many values lie in each of a row of intervals, six to a power of ten.

use std::fmt;

use super::LatencyHistogram;

/// Where intervals begin, times a power of ten: about a factor of 1.5 apart, and short to write.
const MANTISSAS: [u64; 6] = [10, 15, 20, 30, 50, 70];
/// Least beginning in nanoseconds; what is less is counted with it.
const LEAST_NS: u64 = 100;
/// Widest bar in characters.
const BAR_WIDTH: usize = 40;
/// A character filled from the left by 1 to 8 eighths.
const EIGHTHS: [char; 8] =
    ['\u{258f}', '\u{258e}', '\u{258d}', '\u{258c}', '\u{258b}', '\u{258a}', '\u{2589}', '\u{2588}'];

/// Shows a distribution as lines of microseconds, bar and count, from the interval of the least value to that of the
/// greatest. No line is wider than 80 characters, and none is shown where nothing was counted.
///
/// An interval is as exact as the histogram, to three digits.
#[derive(Clone, Copy, Debug)]
pub struct Bars<'a>(pub &'a LatencyHistogram);

impl fmt::Display for Bars<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = self.counts();
        let most = counts.iter().map(|&(_, count)| count).max().unwrap_or(0);
        for ((from_ns, count), to_ns) in counts.iter().zip(beginnings().skip_while(|&ns| ns <= counts[0].0)) {
            let (from, to) = (micros(*from_ns), micros(to_ns));
            let line = format!("{from:>7} \u{2013} {to:<7} {:<BAR_WIDTH$}  {count}", bar(*count, most));
            writeln!(formatter, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

impl Bars<'_> {
    /// The intervals by their beginnings in nanoseconds, with what each has counted; none where nothing was.
    fn counts(self) -> Vec<(u64, u64)> {
        let histogram = &self.0.0;
        if histogram.is_empty() {
            return Vec::new();
        }
        let mut counts: Vec<(u64, u64)> = Vec::new();
        let mut beginnings = beginnings().peekable();
        let mut interval_ns = LEAST_NS;
        for recorded in histogram.iter_recorded() {
            let value_ns = histogram.median_equivalent(recorded.value_iterated_to());
            while let Some(next_ns) = beginnings.next_if(|&ns| ns <= value_ns) {
                interval_ns = next_ns;
                if !counts.is_empty() {
                    counts.push((interval_ns, 0));
                }
            }
            if counts.is_empty() {
                counts.push((interval_ns, 0));
            }
            let last = counts.last_mut().expect("one has just been made where there was none");
            last.1 += recorded.count_at_value();
        }
        counts
    }
}

/// Where the intervals begin, in nanoseconds, without end.
fn beginnings() -> impl Iterator<Item = u64> {
    let powers = std::iter::successors(Some(LEAST_NS / MANTISSAS[0]), |power| power.checked_mul(10));
    powers.flat_map(|power| MANTISSAS.map(|mantissa| power.saturating_mul(mantissa)))
}

/// Nanoseconds as microseconds, in as few letters as these intervals need.
fn micros(nanos: u64) -> String {
    format!("{}", nanos as f64 / 1e3)
}

/// A bar of this share of the greatest width. What was counted at all is seen.
fn bar(count: u64, most: u64) -> String {
    if count == 0 {
        return String::new();
    }
    let eighths = (count as f64 / most as f64 * (8 * BAR_WIDTH) as f64).round().max(1.0) as usize;
    let whole = EIGHTHS[7].to_string().repeat(eighths / 8);
    match eighths % 8 {
        0 => whole,
        rest => format!("{whole}{}", EIGHTHS[rest - 1]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bars(values_ns: &[(u64, u64)]) -> String {
        let mut histogram = LatencyHistogram::new();
        for &(value_ns, count) in values_ns {
            (0..count).for_each(|_| histogram.record(value_ns));
        }
        Bars(&histogram).to_string()
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
    fn any_distribution_is_shown_whole_and_in_lines_that_a_terminal_holds() {
        let an_hour_ns = 3_600_000_000_000;
        let text = bars(&[(0, 1), (1, 1), (99, 1), (1_499, 3), (an_hour_ns, 1_000)]);
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        let counted = text.lines().filter_map(|line| line.split_whitespace().last()?.parse::<u64>().ok()).sum::<u64>();
        assert_eq!(counted, 1_006, "{text}");
        assert!(text.lines().count() < 70, "{text}");
    }

    #[test]
    fn nothing_counted_has_no_bars() {
        assert_eq!(bars(&[]), "");
    }
}
