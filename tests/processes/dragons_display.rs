//! Several dragons on every display: names, colours and places.

use std::fs;

use serde_json::{Value, json};
use test_support::eventually::eventually_from;

use crate::browser::{Browser, View};
use crate::ctl_status::status_with;
use crate::http::get;
use crate::metrics::Exporter;
use crate::stage::Stage;

/// Two straight dragons of 5 benches. Silver crosses the route of gold at a right angle, 20 m ahead of both.
const CROSSING: &str = r##"
[serve]
rate_hz = 100
[[dragons]]
name = "gold"
colour = "#c8a04a"
benches = 5
[dragons.route]
kind = "path"
segments = [{ kind = "line", length_m = 60 }]
[[dragons]]
name = "silver"
benches = 5
[dragons.route]
kind = "path"
start_x_m = 20
start_y_m = -20
start_heading_deg = 90
segments = [{ kind = "line", length_m = 60 }]
"##;
/// The palette's first colour, which silver gets, as a picture in a report has it.
const SILVER: &str = "%230072b2";

fn stage_with_crossing() -> Stage {
    let stage = Stage::new();
    fs::write(stage.path("crossing.toml"), CROSSING).expect("the folder is writable");
    stage
}

/// Serves the crossing half a second before the contact, paused.
const PAUSED: [&str; 5] = ["--config", "crossing.toml", "--start-at", "19", "--paused"];

#[test]
fn status_frames_and_metrics_name_each_dragon() {
    let stage = stage_with_crossing();
    let server = stage.serve(&PAUSED);
    let (status, _) = status_with(&stage, "a forecast", |json| json["ahead"]["kind"] == "contact");
    assert_eq!(status["nearest"]["dragons"], json!(["gold", "silver"]), "{status}");
    assert_eq!((&status["nearest"]["benches"], &status["nearest"]["indices"]), (&json!([0, 5]), &json!([0, 0])));
    assert_eq!(
        (&status["ahead"]["dragons"], &status["ahead"]["benches"]),
        (&json!(["gold", "silver"]), &json!([0, 5]))
    );
    let silver = &status["dragons"][1];
    assert_eq!(
        (&silver["name"], &silver["state"], &silver["travel_m"]),
        (&json!("silver"), &json!("standing"), &json!(19.0))
    );
    let text = stage.run(&["ctl", "status"]).stdout;
    for part in
        ["gold at 0.000 m/s", " mm, gold 0 and silver 0\n", "  silver: standing, 0.000 m/s, 19.000 m of travel\n"]
    {
        assert!(text.contains(part), "{part:?} is missing in\n{text}");
    }

    let exporter = Exporter::start(&stage);
    let metrics = eventually_from("the description has arrived", || {
        let text = exporter.scrape();
        if text.contains("head_travel_meters") { Ok(text) } else { Err(text) }
    });
    for name in ["gold", "silver"] {
        let line = format!("bench_dragon_head_travel_meters{{dragon=\"{name}\"}} 19\n");
        assert!(metrics.contains(&line), "{line} is missing in\n{metrics}");
    }
    assert!(!metrics.contains("head_travel_meters 19"), "no sample without a dragon:\n{metrics}");
    exporter.stop();

    let view = View::of(&stage);
    let address = view.address.parse().expect("an address");
    let frame = eventually_from("a frame with its run", || {
        let frame: Value = serde_json::from_str(&get(address, "/frame").body).unwrap_or_default();
        if frame["nearest"]["dragons"].is_null() { Err(frame.to_string()) } else { Ok(frame) }
    });
    assert_eq!(
        (&frame["nearest"]["dragons"], &frame["nearest"]["indices"]),
        (&json!(["gold", "silver"]), &json!([0, 0]))
    );
    let dragon = |number: usize| frame["dragons"][number].clone();
    assert_eq!(
        (&dragon(1)["name"], &dragon(1)["first_handle"], &dragon(1)["benches"]),
        (&json!("silver"), &json!(6), &json!(5))
    );
    assert_eq!(frame["positions_m"].as_array().map(Vec::len), Some(12));
    view.process.terminate().expect_clean();
    server.stop();
}

#[test]
fn a_monitor_names_both_dragons_of_a_contact_in_text_and_json() {
    for format in ["text", "json"] {
        let stage = stage_with_crossing();
        let monitor = stage.start_waiting(&["monitor", "--fail-on-contact", "--format", format]);
        let server = stage.serve(&["--config", "crossing.toml", "--start-at", "17", "--readers", "1"]);
        let ended = monitor.end();
        assert_eq!(ended.code(), Some(3), "{}", ended.stderr);
        if format == "text" {
            for line in ["  gold 0 and silver 0, clearance ", "first contact at 19.", " s, gold 0 and silver 0\n"] {
                assert!(ended.stdout.contains(line), "{line:?} is missing in\n{}", ended.stdout);
            }
        } else {
            let summary = ended.last_json();
            for report in [&summary["contact"], &summary["least_clearance"]] {
                assert_eq!(
                    (&report["dragons"], &report["indices"]),
                    (&json!(["gold", "silver"]), &json!([0, 0])),
                    "{summary}"
                );
                assert_eq!(report["benches"], json!([0, 5]));
            }
        }
        server.stop();
    }
}

#[test]
fn the_report_of_a_show_names_and_draws_both_dragons_at_their_nearest() {
    let stage = stage_with_crossing();
    let ended = stage.run(&["show", "--config", "crossing.toml", "--start-at", "15", "--out", "night"]);
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    assert!(ended.stdout.contains(" s, gold 0 and silver 0\n"), "{}", ended.stdout);
    assert!(ended.stdout.contains("outcome         gold 0 and silver 0 touched at 19."), "{}", ended.stdout);
    assert!(ended.stderr.contains("s: contact, gold 0 and silver 0"), "{}", ended.stderr);
    let text = fs::read_to_string(stage.path("night/summary.json")).expect("a summary");
    let summary: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(summary["outcome"]["dragons"], json!(["gold", "silver"]), "{summary}");
    assert_eq!(summary["least_clearance"]["dragons"], json!(["gold", "silver"]), "{summary}");
    let report = fs::read_to_string(stage.path("night/report.html")).expect("a report");
    for part in ["mm between gold 0 and silver 0", "gold%20bench%204", "silver%20bench%204", "%23c8a04a", SILVER] {
        assert!(report.contains(part), "{part} is missing in the report");
    }
}

#[test]
fn the_guard_stops_the_show_before_two_dragons_that_it_names() {
    let stage = stage_with_crossing();
    let guard = stage.start_waiting(&["monitor", "--guard"]);
    let server = stage.serve(&["--config", "crossing.toml", "--start-at", "15", "--guarded"]);
    let (status, _) = status_with(&stage, "the guard's stop", |json| json["guard"]["kind"] == "at_end");
    assert_eq!(status["standing"]["remedy"], "Only a seek moves the show: a release does not.", "{status}");
    assert_eq!(status["nearest"]["dragons"], json!(["gold", "silver"]), "{status}");
    assert!(status["nearest"]["clearance_m"].as_f64().is_some_and(|clearance_m| clearance_m >= 0.0005), "{status}");
    server.stop();
    guard.terminate().expect_clean();
}

#[test]
fn the_page_draws_each_dragon_in_its_colour_and_no_board_between_them() {
    let Some(browser) = Browser::find() else { return };
    let stage = stage_with_crossing();
    // Ten metres before the crossing, so that there is room between the two.
    let server = stage.serve(&["--config", "crossing.toml", "--start-at", "10", "--paused"]);
    let view = View::of(&stage);
    let mut page = browser.play("page_dragons.mjs", &[&view.url]);
    let picture = page.json();
    assert_eq!((&picture["dragons"], &picture["pair"]), (&json!("2"), &json!("gold 0 and gold 2")), "{picture}");
    assert_eq!(
        (&picture["gold"], &picture["silver"], &picture["between"]),
        (&json!(true), &json!(true), &json!(false)),
        "{picture}"
    );
    assert_eq!(picture["details"], json!("silver 1, of the body"), "{picture}");
    page.end().expect_clean();
    view.process.terminate().expect_clean();
    server.stop();
}

#[test]
fn a_dragon_that_cannot_walk_its_whole_route_is_named_at_the_start() {
    let stage = Stage::new();
    let bend = "[{ kind = \"line\", length_m = 5 }, { kind = \"arc\", radius_m = 0.5, turn_deg = 350 }]";
    let (gold, silver) = CROSSING.split_at(CROSSING.find("name = \"silver\"").expect("silver"));
    let silver = silver.replace("[{ kind = \"line\", length_m = 60 }]", bend);
    fs::write(stage.path("crossing.toml"), format!("{gold}{silver}")).expect("the folder is writable");
    let server = stage.serve(&["--config", "crossing.toml", "--paused"]);
    let ended = server.process.terminate();
    assert!(ended.stderr.contains("silver ends at ") && !ended.stderr.contains("gold ends"), "{}", ended.stderr);
}
