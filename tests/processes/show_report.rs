//! The report of a show: `summary.json` and `report.html` are there whatever the end, with the outcome, and who did what.

use std::fs;
use std::path::Path;

use bench_dragon_ipc::Stop;
use rustix::process::Signal;
use serde_json::{Value, json};
use test_support::process::Ended;

use crate::browser::Browser;
use crate::show::{CALM, Playing};
use crate::stage::Stage;

/// The summary and the report of a show in the folder `out`.
fn read(stage: &Stage) -> (Value, String) {
    let text = |name: &str| {
        let path = stage.path("out").join(name);
        fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    };
    (serde_json::from_str(&text("summary.json")).expect("JSON"), text("report.html"))
}

/// Fails unless summary and report have this outcome, times of begin and end, and nothing else than the report's own HTML.
pub(crate) fn assert_reported(stage: &Stage, kind: &str) -> (Value, String) {
    let (summary, html) = read(stage);
    assert_eq!(summary["outcome"]["kind"], kind, "{summary}");
    let words = summary["outcome"]["text"].as_str().expect("a sentence");
    assert!(html.contains(words), "{words} in {html}");
    let time = |key: &str| -> jiff::Timestamp {
        let text = summary[key].as_str().unwrap_or_else(|| panic!("{key} in {summary}"));
        assert!(text.ends_with('Z'), "{text} is in UTC");
        text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
    };
    assert!(time("begin") < time("end"), "{summary}");
    (summary, html)
}

/// Fails unless the printed report has the outcome and the place of the report.
fn assert_printed(ended: &Ended, words: &Value) {
    let line = |start: &str| ended.stdout.lines().find(|line| line.starts_with(start)).map(str::to_owned);
    let words = words.as_str().expect("a sentence");
    assert!(line("outcome").is_some_and(|line| line.ends_with(words)), "{}", ended.stdout);
    assert!(line("report").is_some_and(|line| line.ends_with("out/report.html")), "{}", ended.stdout);
}

#[test]
fn a_show_that_is_interrupted_reports_who_steered_it() {
    let playing = Playing::start(&[]);
    let ctl = |args: &[&str]| playing.stage.run(&[&["ctl", "--format", "json"], args].concat());
    ctl(&["speed", "0.5"]).expect_clean();
    ctl(&["hold"]).expect_clean();
    playing.await_status(|status| status.stops().has(Stop::Held));
    ctl(&["release"]).expect_clean();
    assert_eq!(ctl(&["release"]).code(), Some(1), "there is no hold to release");
    playing.await_status(|status| status.tick > 100);
    let Playing { show, stage } = playing;
    show.signal(Signal::INT);
    let ended = show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);

    let (summary, html) = assert_reported(&stage, "signal");
    assert_eq!(summary, ended.last_json());
    let commands = summary["commands"].as_array().expect("a list");
    let told: Vec<Value> =
        commands.iter().map(|line| json!([line["command"], line["sender"], line["accepted"]])).collect();
    let by_ctl = |command: &str, accepted: bool| json!([command, "ctl", accepted]);
    let expected = [by_ctl("speed", true), by_ctl("hold", true), by_ctl("release", true), by_ctl("release", false)];
    assert_eq!(told[0], json!(["start", "server", true]), "{summary}");
    assert_eq!(told[1..5], expected, "{summary}");
    let hold = &summary["holds"][0];
    assert_eq!((&hold["by"], &hold["by_pid"]), (&json!("ctl"), &commands[2]["pid"]), "{summary}");
    assert_eq!((&hold["released_by"], &hold["begin"].is_string()), (&json!("ctl"), &true), "{summary}");
    let ctl = format!("ctl (process {})", commands[2]["pid"]);
    assert!(html.matches(&ctl).count() >= 2, "{ctl} is in the holds and in the commands: {html}");
    let least = &summary["least_clearance"];
    assert!(least["clearance_m"].as_f64().is_some_and(|metres| metres > 0.1), "{summary}");
    let [a, b] = [0, 1].map(|bench| least["benches"][bench].as_u64().expect("a bench"));
    assert!(html.contains(&format!("benches {a} and {b}")), "{html}");
}

#[test]
fn a_show_that_ends_at_its_time_and_one_that_is_stopped_have_their_reports() {
    let stage = Stage::new();
    let ended = stage.run(&[&CALM[..], &["text", "--until", "101", "--out", "out"]].concat());
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let (summary, html) = assert_reported(&stage, "until");
    assert_printed(&ended, &summary["outcome"]["text"]);
    assert!(html.contains("class=\"verdict good\"") && html.contains("The dragon was not held."), "{html}");

    let Playing { show, stage } = Playing::start(&[]);
    stage.run(&["ctl", "stop"]).expect_clean();
    assert_eq!(show.end().code(), Some(0));
    let (summary, _) = assert_reported(&stage, "stopped");
    assert_eq!(summary["outcome"]["sender"], "ctl", "{summary}");
}

#[test]
fn a_guards_stop_is_the_outcome_without_the_guards_grants() {
    let stage = Stage::new();
    let show = ["show", "--guard", "--out", "out", "--start-at", "405", "--time-scale", "10", "--format", "json"];
    let ended = stage.run(&show);
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let (summary, html) = assert_reported(&stage, "guard");
    let commands = summary["commands"].as_array().expect("a list");
    assert!(!commands.is_empty() && commands.iter().all(|line| line["command"] != "grant"), "{summary}");
    assert!(!html.contains("grant of"), "{html}");
    let least = summary["least_clearance"]["clearance_m"].as_f64().expect("a clearance");
    // The margin of half a millimetre.
    assert!((0.0005..0.002).contains(&least), "{summary}");
    assert_eq!(summary["least_clearance"]["benches"], json!([0, 8]));
    // The words of a picture stand in its address.
    assert!(html.contains("margin%20of%20the%20guard"), "{html}");
}

#[test]
fn a_contact_is_the_outcome_with_its_alerts_and_its_picture() {
    let stage = Stage::new();
    let ended = stage.run(&[
        "show",
        "--start-at",
        "405",
        "--time-scale",
        "20",
        "--rate",
        "100",
        "--out",
        "out",
        "--format",
        "json",
    ]);
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let (summary, html) = assert_reported(&stage, "contact");
    let counts = summary["alert_counts"].as_object().expect("an object");
    assert_eq!(counts["contact"], 1, "{summary}");
    let alerts = summary["alerts"].as_array().expect("a list");
    let counted: u64 = counts.values().filter_map(Value::as_u64).sum();
    assert_eq!(alerts.len() as u64 + summary["alerts_left_out"].as_u64().expect("a count"), counted);
    let contact = alerts.iter().find(|alert| alert["kind"] == "contact").expect("the contact is in the list");
    assert_eq!((&contact["benches"], contact["at"].is_string()), (&json!([0, 8]), true));
    assert!(summary["least_clearance"]["clearance_m"].as_f64().is_some_and(|metres| metres < 0.001), "{summary}");
    assert!(html.contains("class=\"verdict danger\""), "{html}");
    assert_eq!(html.matches("data:image/svg+xml").count(), 2, "the nearest approach and the timeline");
}

#[test]
fn a_browser_shows_the_report_and_runs_nothing_that_a_name_contains() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let name = "<img src=x onerror=alert(1)> & \"friends\"";
    fs::create_dir(stage.path("<b>")).expect("a folder");
    let text = "# <script>alert(2)</script>\n[dragon]\nbenches = 30\n[serve]\nrate_hz = 50\ntime_scale = 2.0\n[[show.also]]\ncommand = \"hz --format 'json'\"\n";
    fs::write(stage.path("<b>/stage.toml"), text).expect("a file");
    let ended = stage.run(&["show", "--config", "<b>/stage.toml", "--until", "3", "--out", name, "--format", "json"]);
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let report = stage.path(name).join("report.html");
    let html = fs::read_to_string(&report).expect("a report");
    assert!(html.contains("&lt;img src=x onerror=alert(1)&gt;") && html.contains("&lt;b&gt;/stage.toml"), "{html}");
    assert!(!html.contains("<img src=x") && !html.contains("<b>"), "{html}");
    let mut shown = browser.play("report_reads.mjs", &[&file_url(&report), name]);
    let printed = shown.json();
    assert!(printed["bytes"].as_u64().is_some_and(|bytes| bytes > 10_000), "{printed}");
    shown.end().expect_clean();
}

/// The address of a file, for a browser.
pub(crate) fn file_url(path: &Path) -> String {
    let escaped = |byte: u8| match byte {
        b'/' | b'.' | b'-' | b'_' => char::from(byte).to_string(),
        byte if byte.is_ascii_alphanumeric() => char::from(byte).to_string(),
        byte => format!("%{byte:02X}"),
    };
    let path = path.to_str().expect("the path is UTF-8");
    format!("file://{}", path.bytes().map(escaped).collect::<String>())
}
