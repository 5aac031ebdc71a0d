//! Tonight's checks from real causes: a page that is not there, a timecode that is silent, and the sheet that is signed before the
//! show and is the first page of its report.

use std::fs;
use std::net::{TcpListener, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use serde_json::Value;
use test_support::eventually::eventually;

use crate::browser::{Browser, View};
use crate::doctor::{examine, finding, status};
use crate::show_report::file_url;
use crate::stage::Stage;
use crate::timecode;

/// `/timecode` with the float 62.5.
const TIMECODE: &[u8] = b"/timecode\0\0\0,f\0\0\x42\x7a\0\0";

/// An address that nobody uses at this instant.
fn free_address() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    listener.local_addr().expect("an address").to_string()
}

#[test]
fn a_page_that_is_not_there_is_a_problem_while_the_show_runs() {
    let stage = Stage::new();
    let listen = free_address();
    let flags = ["--tonight", &format!("--view={listen}")];
    let before = examine(&stage, &flags);
    assert_eq!(status(&before, "page"), "ok", "{before}");
    let server = stage.serve(&["--rate", "100"]);
    let missing = examine(&stage, &flags);
    assert_eq!((status(&missing, "page"), &missing["healthy"]), ("problem", &Value::Bool(false)), "{missing}");
    assert_eq!(finding(&missing, "page")["remedy"], format!("start it: `bench-dragon view --listen {listen}`"));
    let view = View::of(&stage);
    let there = examine(&stage, &["--tonight", &format!("--view={}", view.address)]);
    assert_eq!(status(&there, "page"), "ok", "{there}");
    // A page of another instance is no page of this show.
    let other = Stage::new();
    let foreign = other.serve(&["--rate", "100"]);
    let strange = examine(&other, &["--tonight", &format!("--view={}", view.address)]);
    let message = finding(&strange, "page")["message"].as_str().expect("a line").to_owned();
    assert!(message.ends_with(&format!("shows the instance {}", stage.domain().instance())), "{message}");
    foreign.stop();
    view.process.terminate().expect_clean();
    server.stop();
}

#[test]
fn a_page_of_another_program_is_a_problem() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100"]);
    let metrics = View::announced_by(stage.start(&["metrics", "--listen", "127.0.0.1:0", "--format", "json"]));
    let strange = examine(&stage, &["--tonight", &format!("--view={}", metrics.address)]);
    let message = finding(&strange, "page")["message"].as_str().expect("a line").to_owned();
    assert_eq!(message, format!("another program answers at http://{}/", metrics.address));
    metrics.process.terminate().expect_clean();
    server.stop();
}

#[test]
fn a_timecode_that_is_silent_is_a_problem_before_the_show_and_during_it() {
    let stage = Stage::new();
    let silent = examine(&stage, &["--tonight", "--timecode", "osc:127.0.0.1:0"]);
    assert_eq!((status(&silent, "timecode"), &finding(&silent, "timecode")["value"]), ("problem", &"silent".into()));
    let (server, listen) = timecode::serve(&stage, "osc:127.0.0.1:0", &[]);
    let flags = ["--tonight", "--timecode", &format!("osc:{listen}")];
    let waiting = examine(&stage, &flags);
    assert_eq!((status(&waiting, "timecode"), &finding(&waiting, "timecode")["value"]), ("problem", &"waiting".into()));
    let desk = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    let is_over = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            while !is_over.load(Ordering::Relaxed) {
                desk.send_to(TIMECODE, &listen).expect("the server listens");
                thread::yield_now();
            }
        });
        let stands = || {
            let examination = examine(&stage, &flags);
            (status(&examination, "timecode") == "ok").then_some(())
        };
        eventually("the server's status says that the timecode stands", stands);
        is_over.store(true, Ordering::Relaxed);
    });
    server.stop();
}

#[test]
fn a_show_refuses_a_timecode_that_is_sound_and_so_does_the_doctor() {
    let stage = Stage::new();
    for flags in [&["--timecode", "ltc:-"][..], &["--view=127.0.0.1:0"], &["--out", "x", "--until", "-1"]] {
        let ended = stage.run(&[&["doctor"], flags].concat());
        assert_eq!(ended.code(), Some(2), "{flags:?}: {}", ended.stderr);
    }
}

#[test]
fn the_check_sheet_is_the_first_page_of_the_shows_report() {
    let stage = Stage::new();
    let text = "[dragon]\nbenches = 30\n[serve]\nrate_hz = 50\ntime_scale = 2.0\n";
    fs::write(stage.path("<b>.toml"), text).expect("a file");
    let of_show = ["--config", "<b>.toml", "--until", "3", "--out", "tonight"];
    let checked = stage.run(&[&["doctor", "--tonight", "--view=127.0.0.1:0"], &of_show[..]].concat());
    let last: Vec<&str> = checked.stdout.lines().rev().take(2).collect();
    assert_eq!(last[0], "check sheet: tonight/checks.html", "{}{}", checked.stdout, checked.stderr);
    assert!(last[1].contains("eady") && last[1].ends_with("not known."), "{}", checked.stdout);
    let sheet: Value =
        serde_json::from_slice(&fs::read(stage.path("tonight/checks.json")).expect("a file")).expect("JSON");
    assert!(sheet["checks"].as_array().is_some_and(|checks| checks.len() > 20), "{sheet}");

    let show = stage.run(&[&["show"], &of_show[..]].concat());
    assert_eq!(show.code(), Some(0), "{}", show.stderr);
    let html = fs::read_to_string(stage.path("tonight/report.html")).expect("a report");
    let at = |words: &str| html.find(words).unwrap_or_else(|| panic!("{words}: {html}"));
    assert!(at("Checks before the show") < at("Report of a show</p>"), "{html}");
    assert!(!html.contains("another configuration") && !html.contains("<b>.toml"), "{html}");

    let late = stage.run(&[&["doctor", "--tonight"], &of_show[..]].concat());
    assert_eq!(late.code(), Some(2), "{}", late.stdout);
    assert!(late.stderr.contains("summary.json of an earlier show"), "{}", late.stderr);
    prints(&stage);
}

/// Fails unless the sheet prints on one page, before those of the report.
fn prints(stage: &Stage) {
    let Some(browser) = Browser::find() else { return };
    let url = |file: &str| file_url(&stage.path("tonight").join(file));
    let mut shown = browser.play("sheet_prints.mjs", &[&url("checks.html"), &url("report.html")]);
    let printed = shown.json();
    let pages = |name: &str| printed[name].as_u64().unwrap_or_else(|| panic!("{name} in {printed}"));
    assert_eq!((pages("sheet"), pages("whole")), (1, pages("without") + 1), "{printed}");
    shown.end().expect_clean();
}
