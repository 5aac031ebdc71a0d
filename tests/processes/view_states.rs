//! The view's page in each state of a show, in Chromium. The scenarios are in `tests/node`.

use std::fs;

use rustix::process::Signal;
use test_support::eventually::eventually;
use test_support::process::Process;

use crate::browser::{Browser, View};
use crate::record::await_frames;
use crate::replay::replay;
use crate::replay_steering::record_contact;
use crate::stage::Stage;

/// A head that brakes for as long as it has walked, up to 25 s of wall time. It has walked while the browser started.
const SLOW_TO_STOP: &str = "[head]\naccel_mps2 = 0.02\n";

fn expect_next(page: &mut Process, wanted: &str) {
    let line = page.json();
    assert_eq!(line["type"], wanted, "{line}");
}

#[test]
fn the_page_shows_the_rest_of_a_stopping_head_the_senders_of_commands_and_an_orderly_end() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    fs::write(stage.path("show.toml"), SLOW_TO_STOP).expect("a file");
    // After a standstill of a busy machine the show jumps: one that catches up has a countdown at another pace.
    let show = ["--config", "show.toml", "--rate", "100", "--start-at", "50", "--time-scale", "2", "--catch-up", "10"];
    let server = stage.serve(&show);
    let recorder = stage.start(&["record", "show.mcap"]);
    await_frames(&stage.path("show.mcap"));
    let view = View::of(&stage);
    let mut page = browser.play("page_tells.mjs", &[&view.url]);
    let forecast = page.json();
    let number = |key: &str| forecast[key].as_f64().unwrap_or_else(|| panic!("{forecast}"));
    let wall_s = (number("time_s") - number("now_s")) / 2.0;
    // The forecast is up to 0.2 s older than the clock beside it.
    assert!((number("left_s") - wall_s).abs() < 2.0, "{forecast}");
    expect_next(&mut page, "hold");
    assert_eq!(stage.run(&["ctl", "hold"]).code(), Some(0));
    expect_next(&mut page, "resume");
    assert_eq!(stage.run(&["ctl", "resume"]).code(), Some(1));
    expect_next(&mut page, "stop");
    assert_eq!(stage.run(&["ctl", "stop"]).code(), Some(0));
    server.summary();
    expect_next(&mut page, "ended");
    recorder.terminate().expect_clean();
    let (replayed, _) = replay(&stage, &["show.mcap", "--loop"]);
    expect_next(&mut page, "passed");
    page.end().expect_clean();
    view.process.terminate().expect_clean();
    replayed.terminate();
}

#[test]
fn the_page_announces_the_guards_stop_and_distinguishes_its_situations() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    // Two minutes before the guard's stop, so that a busy browser sees the forecast of it.
    let server = stage.serve(&["--guarded", "--rate", "100", "--start-at", "300"]);
    let guard = stage.start(&["monitor", "--guard"]);
    let view = View::of(&stage);
    let mut page = browser.play("page_is_guarded.mjs", &[&view.url]);
    expect_next(&mut page, "seek");
    // `ctl` waits 5 s for the guard's proof, which may take longer on a busy machine.
    eventually("the seek is accepted", || (stage.run(&["ctl", "seek", "405"]).code() == Some(0)).then_some(()));
    expect_next(&mut page, "kill the guard");
    guard.signal(Signal::KILL);
    expect_next(&mut page, "passed");
    page.end().expect_clean();
    view.process.terminate().expect_clean();
    server.stop();
}

#[test]
fn a_replayed_show_has_its_alerts_and_commands_and_is_steered_by_its_bar() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    record_contact(&stage, "show.mcap");
    let (replayed, _) = replay(&stage, &["show.mcap", "--paused", "--stay"]);
    let view = View::of(&stage);
    let pictures = std::env::var_os("BENCH_DRAGON_PICTURES").map_or_else(|| stage.path(""), Into::into);
    let mut page = browser.play("page_replays.mjs", &[&view.url, &pictures.display().to_string()]);
    for wanted in ["sought", "told", "passed"] {
        expect_next(&mut page, wanted);
    }
    page.end().expect_clean();
    view.process.terminate().expect_clean();
    replayed.terminate().expect_clean();
}

#[test]
fn a_contact_stays_on_the_page_until_it_is_acknowledged_and_alerts_are_filtered() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    // The show is held until monitor and page have joined, since a later subscriber gets no earlier alert.
    let server = stage.serve(&["--rate", "100", "--start-at", "411", "--held"]);
    assert_eq!(stage.run(&["ctl", "hold"]).code(), Some(0));
    let mut monitor = stage.start(&["monitor", "--format", "json"]);
    monitor.json_until("the monitor reports that the show is held", |line| line["kind"] == "held");
    let view = View::of(&stage);
    let mut page = browser.play("page_keeps_contacts.mjs", &[&view.url]);
    expect_next(&mut page, "release");
    assert_eq!(stage.run(&["ctl", "release"]).code(), Some(0));
    expect_next(&mut page, "seek");
    assert_eq!(stage.run(&["ctl", "seek", "100"]).code(), Some(0));
    expect_next(&mut page, "passed");
    page.end().expect_clean();
    view.process.terminate().expect_clean();
    monitor.terminate();
    server.stop();
}
