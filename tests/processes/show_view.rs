//! A show with its page: opened before the first frame, supervised like the other children, ended last.

use std::net::TcpListener;

use rustix::process::Signal;
use serde_json::{Value, json};
use test_support::children::{await_child, children, kill};
use test_support::eventually::eventually;
use test_support::process::Process;

use crate::show::{assert_published, logged};
use crate::stage::Stage;

const SHOW: [&str; 9] = ["show", "--out", "out", "--rate", "50", "--start-at", "100", "--view=127.0.0.1:0", "--format"];

/// Starts a show with a page. Returns the address and the token of the page.
fn start(stage: &Stage, args: &[&str]) -> (Process, String, String) {
    let mut show = stage.start(&[&SHOW[..], &["json"], args].concat());
    let line = show.json();
    assert_eq!(line["type"], "view", "the first line: {line}");
    let url = line["url"].as_str().expect("an address").to_owned();
    let (page, token) = url.split_once("/#token=").expect("a token to steer with");
    let address = page.strip_prefix("http://").expect("a page").to_owned();
    (show, address, token.to_owned())
}

/// Whether a process listens at an address.
fn listens(address: &str) -> bool {
    std::net::TcpStream::connect(address).is_ok()
}

#[test]
fn the_page_opens_first_and_every_frame_reaches_monitor_and_recorder() {
    let stage = Stage::new();
    let (show, address, token) = start(&stage, &["--until", "103"]);
    assert_eq!(token.len(), 32);
    let ended = show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let summary = ended.last_json();
    assert_published(&summary, 151);
    assert_eq!(
        (&summary["frames"]["missed_by_monitor"], &summary["frames"]["missed_by_recorder"]),
        (&json!(0), &json!(0))
    );
    assert_eq!(summary["restarts"], json!({ "serve": 0, "monitor": 0, "record": 0, "view": 0 }));
    assert!(!listens(&address), "the page ends with the show");
}

#[test]
fn a_killed_page_is_restarted_at_its_address_with_its_token() {
    let stage = Stage::new();
    let (show, address, _) = start(&stage, &[]);
    let pid = show.pid();
    await_child(pid, "record", None);
    let page = await_child(pid, "view", None);
    kill(page);
    let again = await_child(pid, "view", Some(page));
    assert_ne!(page, again);
    eventually("the page listens again", || listens(&address).then_some(()));
    assert_eq!(logged(&show), "view ended with signal: 9 (SIGKILL): starting it again");
    show.signal(Signal::INT);
    let ended = show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    assert_eq!(children(pid), []);
    assert_eq!(ended.last_json()["restarts"]["view"], 1);
}

#[test]
fn a_show_does_not_begin_if_the_address_of_its_page_is_taken() {
    let stage = Stage::new();
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("the socket is bound");
    let ended = stage.run(&["show", &format!("--view={address}"), "--until", "1"]);
    assert_eq!(ended.code(), Some(1), "{}", ended.stdout);
    let reason = "Address already in use (os error 98)";
    assert_eq!(ended.stderr, format!("error: cannot listen on {address}: {reason}; port 0 takes a free one\n"));
    assert_eq!(ended.stdout, "");
    assert!(
        std::fs::read_dir(stage.path(".")).expect("the test's folder").next().is_none(),
        "no folder of a show is left"
    );
}

#[test]
fn the_text_output_begins_with_the_address_on_a_line() {
    let stage = Stage::new();
    let mut show = stage.start(&[&SHOW[..], &["text", "--until", "101"]].concat());
    let line = show.next_line().expect("a line");
    assert!(line.starts_with("http://127.0.0.1:"), "{line}");
    let ended = show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let summary = std::fs::read(stage.path("out/summary.json")).expect("a summary");
    assert_eq!(serde_json::from_slice::<Value>(&summary).expect("JSON")["restarts"]["view"], 0);
}
