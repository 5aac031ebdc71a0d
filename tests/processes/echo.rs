//! `echo` and `hz`: the frames as text and JSON.

use bench_dragon_ipc::HandleState;
use serde_json::{Value, json};

use crate::reader::{Reader, assert_whole};
use crate::stage::Stage;

#[test]
fn echo_prints_the_requested_number_of_frames_with_every_value_of_the_bus() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--until", "1", "--readers", "2"]);
    let mut echo = stage.start(&["echo", "--count", "20", "--format", "json"]);
    let mut reader = Reader::join(&stage);
    let mut lines = vec![echo.json()];
    lines.extend(echo.end().expect_clean().json_lines());
    let shots = reader.read_to_end();
    assert_whole(&shots, server.run_id);
    assert_eq!(lines.len(), 20);
    for (line, shot) in lines.iter().zip(&shots) {
        let header = &shot.header;
        let handle =
            |handle: &HandleState| json!({ "position_m": handle.position_m, "velocity_mps": handle.velocity_mps });
        let expected = json!({
            "run_id": header.run_id,
            "tick": header.tick,
            "sim_time_ns": header.show_time_ns,
            "scheduled_ns": header.scheduled_ns,
            "published_ns": header.published_ns,
            "head_travel_m": header.head_travel_m,
            "head_speed_mps": header.head_speed_mps,
            "time_scale": header.time_scale,
            "bench_count": header.bench_count,
            "state": header.state,
            "handles": shot.handles.iter().map(handle).collect::<Vec<_>>(),
        });
        assert_eq!(*line, expected, "tick {}", header.tick);
    }
    server.summary();
}

#[test]
fn echo_in_text_prints_one_line_per_frame() {
    let stage = Stage::new();
    let server = stage.serve(&["--held"]);
    let text = stage.run(&["echo", "--count", "2"]).expect_clean().stdout;
    for line in text.lines() {
        assert!(line.starts_with("tick ") && line.contains("0.000000 s  ready"), "{line}");
        assert!(line.contains("front hinge (   8.800000, ") && line.contains("rear hinge ("), "{line}");
    }
    assert_eq!(text.lines().count(), 2);
    server.stop();
}

#[test]
fn hz_prints_the_requested_number_of_lines_and_ends() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100"]);
    let lines = stage.run(&["hz", "--seconds", "2", "--format", "json"]).expect_clean().json_lines();
    assert_eq!(lines.len(), 2);
    for line in &lines {
        let mut fields: Vec<&String> = line.as_object().expect("an object").keys().collect();
        fields.sort();
        assert_eq!(fields, ["frames", "latency_us", "lost", "rate_hz", "restarts"]);
        assert_eq!(line["restarts"], 0);
        // A server without a processor for a second publishes no frame.
        let has_frames = line["frames"].as_u64() > Some(0);
        assert_eq!(line["rate_hz"].as_f64() > Some(0.0), has_frames, "{line}");
        let latency = &line["latency_us"];
        assert_eq!(latency.is_null(), !has_frames, "{line}");
        if !has_frames {
            continue;
        }
        let percentiles: Vec<f64> =
            ["p50", "p99", "p999", "max"].iter().filter_map(|name| latency[name].as_f64()).collect();
        assert!(percentiles.len() == 4 && percentiles.is_sorted(), "{line}");
        assert!(percentiles[0] > 0.0, "{line}");
    }
    server.stop();
}

#[test]
fn hz_reports_a_restart_in_json_and_in_text() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--readers", "1"]);
    let mut hz = stage.start(&["hz", "--format", "json"]);
    hz.json_until("frames are counted", |line| line["frames"].as_u64() > Some(0));
    server.stop();
    let server = stage.serve(&["--rate", "100"]);
    let lines = hz.json_until("a restart is counted", |line| line["restarts"] != 0);
    assert_eq!(lines.last().map(|line| &line["restarts"]), Some(&Value::from(1)));
    hz.terminate().expect_clean();
    let text = stage.run(&["hz", "--seconds", "1"]).expect_clean().stdout;
    assert!(text.contains(" Hz  lost ") && text.contains("restarts 0  latency "), "{text}");
    server.stop();
}
