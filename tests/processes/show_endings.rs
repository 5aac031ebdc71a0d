//! The ends of a rehearsal: each has its reason in the summary, in the report, and on the page.

use rustix::process::Signal;
use serde_json::{Value, json};
use test_support::children::{await_child, children, kill};
use test_support::process::Process;

use crate::page_socket::{PageSocket, outcome};
use crate::record::await_frames;
use crate::show::{CALM, Playing};
use crate::show_report::assert_reported;
use crate::stage::Stage;

const VIEW: &str = "--view=127.0.0.1:0";

/// Starts a show with a page. Returns the stream of the page.
fn start_with_page(stage: &Stage, args: &[&str]) -> (Process, String) {
    let mut show = stage.start(&[&["show", "--out", "out", "--format", "json", VIEW], args].concat());
    let line = show.json();
    let url = line["url"].as_str().unwrap_or_else(|| panic!("no address: {line}"));
    let address = url.strip_prefix("http://").and_then(|url| url.split_once('/')).expect("an address").0.to_owned();
    (show, address)
}

/// Plays a rehearsal with a page to its end. Returns its outcome, which summary and page share.
fn outcome_of(args: &[&str]) -> Value {
    let stage = Stage::new();
    let (show, address) = start_with_page(&stage, args);
    let messages = PageSocket::open(&address).read_to_end();
    let ended = show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let summary = ended.last_json();
    let shown = outcome(&messages);
    assert_eq!((&shown["kind"], &shown["text"]), (&summary["outcome"]["kind"], &summary["outcome"]["text"]));
    summary["outcome"].clone()
}

#[test]
fn a_contact_is_the_outcome_of_a_rehearsal_that_it_ends() {
    let outcome = outcome_of(&["--rate", "100", "--start-at", "405", "--time-scale", "20"]);
    assert_eq!((&outcome["kind"], &outcome["benches"]), (&json!("contact"), &json!([0, 8])));
    assert_eq!(outcome["text"], "Benches 0 and 8 touched at 412.473838 s.");
}

#[test]
fn the_guards_permanent_stop_is_the_outcome_of_a_rehearsal_that_it_ends() {
    let outcome = outcome_of(&["--guard", "--rate", "100", "--start-at", "405", "--time-scale", "20"]);
    assert_eq!(outcome["kind"], "guard");
    assert!(outcome["held_at_s"].as_f64().is_some_and(|held_s| (held_s - 412.454_970).abs() < 5e-7), "{outcome}");
}

#[test]
fn a_rehearsal_that_starts_within_the_margin_names_it() {
    let stage = Stage::new();
    let show = ["show", "--guard", "--rate", "100", "--start-at", "412.46", "--out", "out", "--format", "json"];
    let ended = stage.run(&show);
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let outcome = &ended.last_json()["outcome"];
    let text = "The guard does not let the dragon walk from 412.460000 s: margin_m is not proved to be kept there. Start or \
                seek elsewhere.";
    assert_eq!((&outcome["kind"], &outcome["text"]), (&json!("guard"), &json!(text)), "{outcome}");
    let told = "412.460000 s: held by the guard permanently, clearance 0.00";
    assert!(ended.stderr.lines().any(|line| line.contains(told)), "{}", ended.stderr);
}

#[test]
fn the_requested_time_is_the_outcome_of_a_rehearsal_that_reaches_it() {
    let outcome = outcome_of(&["--rate", "50", "--start-at", "100", "--until", "101"]);
    assert_eq!(
        outcome,
        json!({ "kind": "until", "time_s": 101.0, "text": "The show reached its end time, 101.000 s." })
    );
}

#[test]
fn the_end_of_the_run_is_the_outcome_of_a_rehearsal_that_walks_to_it() {
    let stage = Stage::new();
    std::fs::write(stage.path("short.toml"), SHORT).expect("a file");
    let ended = stage.run(&["show", "--config", "short.toml", "--out", "out", "--format", "json"]);
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    assert_eq!(ended.last_json()["outcome"]["kind"], "end_of_run");
}

/// Three benches walk three metres.
const SHORT: &str = "[dragon]\nbenches = 3\n[serve]\nrate_hz = 50\n[route]\nkind = \"path\"\n[[route.segments]]\nkind = \
                     \"line\"\nlength_m = 3.0\n";

#[test]
fn a_stop_is_the_outcome_with_its_sender() {
    let Playing { show, stage } = Playing::start(&[]);
    stage.run(&["ctl", "stop"]).expect_clean();
    let ended = show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let outcome = &ended.last_json()["outcome"];
    assert_eq!((&outcome["kind"], &outcome["sender"]), (&json!("stopped"), &json!("ctl")), "{outcome}");
    assert!(outcome["pid"].as_u64().is_some(), "{outcome}");
}

#[test]
fn a_signal_is_the_outcome_of_a_show_that_it_ends() {
    let (summary, _) = Playing::start(&[]).interrupt();
    let text = "Ctrl-C ended the show.";
    assert_eq!(summary["outcome"], json!({ "kind": "signal", "signal": "Ctrl-C", "text": text }));
}

#[test]
fn the_report_for_people_has_the_outcome() {
    let stage = Stage::new();
    let ended = stage.run(&[&CALM[..], &["text", "--until", "100.1", "--out", "out"]].concat());
    assert!(ended.stdout.contains("\noutcome         The show reached its end time, 100.100 s.\n"), "{}", ended.stdout);
}

/// The last restart comes some 80 seconds after the first end.
#[test]
fn a_rehearsal_whose_server_is_killed_again_and_again_fails_and_its_page_names_the_reason() {
    let stage = Stage::new();
    let (show, address) = start_with_page(&stage, &["--rate", "50", "--start-at", "100"]);
    let pid = show.pid();
    await_frames(&stage.path("out/recording.mcap"));
    let mut server = await_child(pid, "serve", None);
    for restart in 1..=11 {
        kill(server);
        let line = show.complaint_with("serve ended with signal: 9 (SIGKILL): starting it again");
        assert_eq!(line.ends_with(" s"), restart > 5, "only longer waits are named: {line}");
        server = await_child(pid, "serve", Some(server));
    }
    let page = PageSocket::open(&address);
    kill(server);
    let messages = page.read_to_end();
    let text = "The show failed: serve ended with signal: 9 (SIGKILL), after 11 restarts.";
    assert_eq!(outcome(&messages), &json!({ "type": "outcome", "kind": "failed", "text": text }));
    let ended = show.end();
    assert_eq!(ended.code(), Some(1), "{}", ended.stderr);
    let reason = "serve ended with signal: 9 (SIGKILL), after 11 restarts in a row: giving up";
    assert!(ended.stderr.contains(reason), "{}", ended.stderr);
    let summary = std::fs::read(stage.path("out/summary.json")).expect("a failed show has a summary");
    let outcome = serde_json::from_slice::<Value>(&summary).expect("JSON")["outcome"].take();
    assert_eq!((&outcome["kind"], &outcome["process"]), (&json!("failed"), &json!("serve")), "{outcome}");
    assert_eq!(children(pid), []);
    let (summary, html) = assert_reported(&stage, "failed");
    assert_eq!(summary["restart_log"].as_array().map(Vec::len), Some(12), "{summary}");
    assert!(html.contains("not started again") && html.contains("class=\"verdict danger\""), "{html}");
}

#[test]
fn the_page_of_a_killed_show_names_the_kill() {
    let stage = Stage::new();
    let (show, address) = start_with_page(&stage, &["--rate", "50", "--start-at", "100"]);
    let pid = show.pid();
    await_child(pid, "record", None);
    let page = PageSocket::open(&address);
    show.signal(Signal::KILL);
    assert_eq!(outcome(&page.read_to_end())["kind"], "killed");
    show.end();
    test_support::eventually::eventually("the children of the killed show are gone", || {
        children(pid).is_empty().then_some(())
    });
}
