//! The layout of the view's page in Chromium, in each state of a show. The scenarios are in `tests/node`.

use std::fs;
use std::path::PathBuf;

use rustix::process::Signal;
use test_support::eventually::eventually;
use test_support::process::Process;

use crate::browser::{Browser, View};
use crate::server::Server;
use crate::stage::Stage;

/// A head that brakes for up to 25 s of wall time. A page that is not measured meanwhile asks for another stop.
const SLOW_TO_STOP: &str = "[head]\naccel_mps2 = 0.02\n";
const SLOW: [&str; 8] = ["--config", "show.toml", "--rate", "60", "--start-at", "50", "--time-scale", "2"];

fn expect_next(page: &mut Process, wanted: &str) {
    let line = page.json();
    assert_eq!(line["type"], wanted, "{line}");
}

fn ask(stage: &Stage, command: &[&str]) {
    assert_eq!(stage.run(&[&["ctl"], command].concat()).code(), Some(0), "{command:?}");
}

/// Lets the head walk and stop as often as the page asks for it, until the next state.
fn stop_again_until(stage: &Stage, page: &mut Process, wanted: &str) {
    let lines = page.json_until("the pages have seen the head brake", |line| {
        match line["type"].as_str() {
            Some("walking") => ask(stage, &["release"]),
            Some("stopping") => ask(stage, &["hold"]),
            _ => return true,
        }
        false
    });
    assert_eq!(lines.last().expect("json_until returns the last line")["type"], wanted);
}

/// The folder for the pictures of the pages, if somebody wants to look at them.
fn pictures(stage: &Stage) -> PathBuf {
    let wanted = std::env::var_os("BENCH_DRAGON_PICTURES").map(PathBuf::from);
    let folder = wanted.unwrap_or_else(|| stage.path("pictures"));
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

#[test]
fn in_every_state_hold_stays_in_its_place_and_no_text_covers_another_or_is_cut_off() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    fs::write(stage.path("show.toml"), SLOW_TO_STOP).expect("a file");
    let server = stage.serve(&[&SLOW[..], &["--held"]].concat());
    let monitor = stage.start(&["monitor"]);
    let view = View::of(&stage);
    let mut page = browser.play("page_layout.mjs", &[&view.url, &pictures(&stage).display().to_string()]);
    expect_next(&mut page, "ready");
    expect_next(&mut page, "running");
    ask(&stage, &["release"]);
    expect_next(&mut page, "stopping");
    ask(&stage, &["hold"]);
    stop_again_until(&stage, &mut page, "held by an operator");
    expect_next(&mut page, "silent");
    server.process.signal(Signal::STOP);
    expect_next(&mut page, "lost");
    server.process.kill();
    expect_next(&mut page, "held after a restart");
    let server = stage.serve(&[&SLOW[..], &["--restarted"]].concat());
    expect_next(&mut page, "paused");
    // The head stands, so both hold from the next frame on.
    ask(&stage, &["pause"]);
    ask(&stage, &["release"]);
    expect_next(&mut page, "overlap");
    server.stop();
    // The boards of the paper's dragon overlap from 412.5 s to the end of its run, at 432.8 s.
    let server = stage.serve(&["--rate", "60", "--start-at", "412.6", "--time-scale", "0.5"]);
    expect_next(&mut page, "finished");
    ask(&stage, &["seek", "432"]);
    expect_next(&mut page, "without a guard");
    end(server);
    let server = stage.serve(&["--guarded", "--rate", "60", "--start-at", "300"]);
    expect_next(&mut page, "ended");
    server.stop();
    expect_next(&mut page, "without a view");
    view.process.kill();
    expect_next(&mut page, "passed");
    page.end().expect_clean();
    monitor.terminate();
}

/// Ends a server whose run may be over.
fn end(server: Server) {
    server.process.terminate();
}

#[test]
fn the_wall_has_five_large_texts_and_nothing_else() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "60", "--start-at", "200"]);
    let view = View::of(&stage);
    let page = browser.play("page_wall.mjs", &[&view.url, &pictures(&stage).display().to_string()]);
    assert_eq!(page.end().expect_clean().last_json()["type"], "passed");
    view.process.terminate().expect_clean();
    server.stop();
}

#[test]
fn on_a_slow_network_the_page_shows_the_age_of_its_picture_and_is_not_green() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "60", "--start-at", "50"]);
    let view = View::of(&stage);
    let page = browser.play("page_lags.mjs", &[&view.url]);
    assert_eq!(page.end().expect_clean().last_json()["type"], "passed");
    view.process.terminate().expect_clean();
    server.stop();
}

#[test]
fn a_restarted_view_shows_what_was_measured_before_and_an_open_page_says_how_it_steers_again() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "60", "--start-at", "200"]);
    let monitor = stage.start(&["monitor"]);
    let view = View::of(&stage);
    let address = view.address.clone();
    let token = "a-token-of-the-restarted-view";
    let restarted = format!("http://{address}/#token={token}");
    let mut page = browser.play("page_survives.mjs", &[&view.url, &restarted]);
    let before = page.json();
    assert_eq!(before["type"], "restart the view", "{before}");
    let parts = before["measured"].as_u64().expect("a number");
    eventually("the view has kept what it has measured", || (kept_parts(&stage)? >= parts).then_some(()));
    view.process.kill();
    expect_next(&mut page, "lost");
    let mut again = stage.command(&["view", "--format", "json", "--listen", &address]);
    again.env("BENCH_DRAGON_TOKEN", token);
    let mut view = Process::start(again);
    assert_eq!(view.json()["url"], restarted);
    for name in ["the open page", "a new page"] {
        let shown = page.json();
        assert_eq!(shown["type"], name, "{shown}");
        assert!(shown["measured"].as_u64().is_some_and(|measured| measured >= parts), "{shown}, {parts} parts before");
    }
    expect_next(&mut page, "passed");
    page.end().expect_clean();
    let ended = view.terminate();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    // The open page tries the token of the earlier view.
    assert!(ended.stderr.lines().all(|line| line.contains("wrong token")), "{}", ended.stderr);
    monitor.terminate();
    server.stop();
}

/// The number of measured parts in the file that the view keeps.
fn kept_parts(stage: &Stage) -> Option<u64> {
    let path = stage.domain().root().join(format!("{}measured.json", stage.domain().prefix()));
    let measured: serde_json::Value = serde_json::from_slice(&fs::read(path).ok()?).ok()?;
    Some(measured["least_m"].as_array()?.iter().filter(|part| !part.is_null()).count() as u64)
}
