//! `latency`: its counts, its output, and the file for the plotter.

use std::fs;
use std::path::Path;

use rustix::process::Signal;
use serde_json::json;
use test_support::process::Ended;

use crate::periods::assert_no_frame_missing;
use crate::reader::Reader;
use crate::stage::Stage;

/// Periods of a show that a reader's buffer holds, so that a late reader loses no frame.
const PERIODS: u64 = 101;

/// Measures a whole show, and ends the measurement by Ctrl-C after the show. Returns the number of frames too.
fn measure_a_show(stage: &Stage, args: &[&str]) -> (Ended, u64) {
    let server = stage.serve(&["--rate", "1000", "--until", "0.1", "--readers", "1"]);
    let latency = stage.start(&[&["latency", "--seconds", "100000"], args].concat());
    let summary = server.summary();
    assert_no_frame_missing(&summary, PERIODS);
    latency.signal(Signal::INT);
    (latency.end().expect_clean(), summary["frames"].as_u64().expect("a count"))
}

/// Returns percentile and count of each row, and the count of the footer.
fn percentile_rows(path: &Path) -> (Vec<(f64, u64)>, u64) {
    let text = fs::read_to_string(path).expect("the file is text");
    let mut lines = text.lines();
    let titles: Vec<&str> = lines.next().expect("titles").split_whitespace().collect();
    assert_eq!(titles, ["Value", "Percentile", "TotalCount", "1/(1-Percentile)"]);
    assert_eq!(lines.next(), Some(""));
    let (footer, rows): (Vec<&str>, Vec<&str>) = lines.partition(|line| line.starts_with('#'));
    let total = footer[1].split_once("Total count    =").expect("the footer has it").1.trim_matches([' ', ']']);
    let row = |line: &&str| {
        let cells: Vec<f64> = line.split_whitespace().map(|cell| cell.parse().expect("a number")).collect();
        assert!(cells[0] > 0.0 && (cells.len() == 4 || cells[1] == 1.0), "{line}");
        (cells[1], cells[2] as u64)
    };
    (rows.iter().map(row).collect(), total.parse().expect("a count"))
}

#[test]
fn every_frame_of_a_show_is_measured_in_each_mode_also_with_ctrl_c() {
    for (args, mode) in [
        (&["--format", "json"][..], "woken"),
        (&["--format", "json", "--poll"], "polling"),
        (&["--format", "json", "--spin-us", "100"], "clock"),
    ] {
        let stage = Stage::new();
        let (ended, frames) = measure_a_show(&stage, args);
        let report = ended.last_json();
        let mut fields: Vec<&String> = report.as_object().expect("an object").keys().collect();
        fields.sort();
        assert_eq!(fields, ["due_us", "frames", "lost", "mode", "restarts", "seconds", "sent_us"]);
        let counts = json!([report["frames"], report["lost"], report["restarts"], report["mode"]]);
        assert_eq!(counts, json!([frames, 0, 0, mode]));
        assert!(report["seconds"].as_f64() > Some(0.0), "{report}");
        for way in ["due_us", "sent_us"] {
            let percentiles: Vec<f64> =
                ["p50", "p99", "p999", "max"].iter().filter_map(|name| report[way][name].as_f64()).collect();
            assert!(percentiles.len() == 4 && percentiles.is_sorted() && percentiles[0] > 0.0, "{report}");
        }
        assert!(
            report["due_us"]["p50"].as_f64() >= report["sent_us"]["p50"].as_f64(),
            "no frame is sent before it is due: {report}"
        );
    }
}

#[test]
fn the_file_for_the_plotter_counts_every_frame() {
    let stage = Stage::new();
    let (_, frames) = measure_a_show(&stage, &["--hgrm", "show.hgrm"]);
    let (rows, total) = percentile_rows(&stage.path("show.hgrm"));
    assert!(rows.is_sorted(), "{rows:?}");
    assert_eq!((rows.last(), total), (Some(&(1.0, frames)), frames));
}

#[test]
fn people_get_a_table_and_bars_that_count_every_frame() {
    let stage = Stage::new();
    let (ended, frames) = measure_a_show(&stage, &[]);
    let text = ended.stdout;
    assert!(
        text.starts_with(&format!("{frames} frames in ")) && text.contains(" s, 0 lost, 0 restarts, woken\n"),
        "{text}"
    );
    assert!(text.contains("\ndue to read ") && text.contains("\nsent to read "), "{text}");
    let (_, bars) = text.split_once("from due to read in").expect("bars follow the table");
    let counted = bars.lines().filter_map(|line| line.split_whitespace().last()?.parse::<u64>().ok()).sum::<u64>();
    assert_eq!(counted, frames, "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
}

#[test]
fn a_measurement_ends_after_its_seconds_also_without_frames() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100"]);
    // The reader keeps the services after the server's end, also the wake-ups. So the command can open them, but gets no frame.
    let mut reader = Reader::join(&stage);
    reader.next();
    server.stop();
    let report = stage.run(&["latency", "--seconds", "0.05", "--format", "json"]).expect_clean().last_json();
    assert_eq!(json!([report["frames"], report["seconds"]]), json!([0, 0.05]));
    assert_eq!(json!([report["due_us"], report["sent_us"]]), json!([null, null]), "no frame, no latency: {report}");
    let text = stage.run(&["latency", "--seconds", "0.05", "--poll"]).expect_clean().stdout;
    assert_eq!(text, "0 frames in 0.1 s, 0 lost, 0 restarts, polling\n\nno latency: no frame was read\n");
    drop(reader);
}

#[test]
fn a_file_that_cannot_be_written_is_reported_before_the_measurement() {
    let ended = Stage::new().run(&["latency", "--hgrm", "none/a.hgrm", "--format", "json"]);
    assert_eq!((ended.code(), ended.stdout.as_str()), (Some(1), ""));
    assert!(ended.stderr.starts_with("error: cannot write none/a.hgrm: No such file"), "{}", ended.stderr);
}
