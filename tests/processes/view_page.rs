//! The view's page in Chromium, compared with the bus. The scenarios are in `tests/node`.

use std::fs;
use std::path::Path;
use std::process::Command;

use bench_dragon::config::Config;
use bench_dragon_geometry::clearance::{ClearanceSearch, PairClearance};
use bench_dragon_ipc::ShowState;
use glam::{DVec2, DVec3};
use rustix::process::Signal;
use serde_json::{Value, json};
use test_support::process::Process;
use test_support::skip::{has_programs, is_possible};

use crate::browser::{Browser, View};
use crate::reader::{Reader, Shot};
use crate::stage::Stage;

/// The show starts before its middle, so that the page has a forecast and no benches touch.
const SHOW: [&str; 4] = ["--rate", "100", "--start-at", "200"];

#[test]
fn the_page_draws_the_dragon_and_shows_the_clearance_of_the_bus() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let server = stage.serve(&SHOW);
    let view = View::of(&stage);
    let pixels = stage.path("plan.rgba");
    let mut page = browser.play("page_draws.mjs", &[&view.url, &pixels.display().to_string()]);
    let picture = page.json();
    let shot = paused_shot(&stage);
    let nearest = nearest_pair(&shot);
    assert_eq!(picture["benches"], shot.header.bench_count);
    assert_eq!(picture["clearance_m"], nearest.clearance_m, "at tick {}", shot.header.tick);
    assert_eq!(picture["nearest"], json!(nearest.benches));
    assert_eq!(picture["read"], format!("{:.1}", nearest.clearance_m * 1e3));
    assert_is_drawn(&picture, &pixels, &shot);

    let bench = page.json();
    let [front, rear] = [17, 18].map(|handle| DVec2::from_slice(&shot.handles[handle].position_m));
    let (centre, heading) = ((front + rear) / 2.0, (front - rear).to_angle().to_degrees());
    let details = [
        "of the body".to_owned(),
        format!("{:.3}, {:.3} m", centre.x, centre.y).replace('-', "−"),
        format!("{heading:.1}°").replace('-', "−"),
        "0.000 m/s".to_owned(),
    ];
    assert_eq!(bench["details"], json!(details));
    page.end().expect_clean();
    view.process.terminate().expect_clean();
    server.stop();
}

#[test]
fn every_control_works_by_button_and_by_key() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    // The page proposes the middle of the show, at 217 s, which the show does not reach by itself. At this rate the bus keeps ten
    // seconds for the reader.
    let server = stage.serve(&["--rate", "20", "--start-at", "50"]);
    let mut reader = Reader::join(&stage);
    let view = View::of(&stage);
    let mut page = browser.play("page_steers.mjs", &[&view.url]);
    for state in ["paused", "running", "paused", "running", "held", "held", "held", "held", "held", "held"] {
        let line = page.json();
        assert_eq!(line["type"], state, "{line}");
        reader.read_until(&format!("the show is {state}"), |header| {
            header.show_state().is_some_and(|now| now.name() == state)
        });
    }
    assert_eq!(page.json()["type"], "released");
    reader.read_until("the show is not held", |header| header.show_state() != Some(ShowState::Held));

    let proposed_s = page.json()["time_s"].as_f64().expect("a time");
    let before = reader.read_unread();
    assert!(
        before.iter().all(|shot| (shot.header.show_time_s() - proposed_s).abs() > 0.5),
        "a proposed time is not sought"
    );
    let sought_s = page.json()["time_s"].as_f64().expect("a time");
    reader.read_until("the show is where the page sought", |header| {
        (sought_s..sought_s + 60.0).contains(&header.show_time_s())
    });
    let speed_mps = page.json()["head_speed_mps"].as_f64().expect("a speed");
    reader.read_until("the head has the speed of the page", |header| (header.head_speed_mps - speed_mps).abs() < 1e-6);
    page.end().expect_clean();
    view.process.terminate().expect_clean();
    server.stop();
}

#[test]
fn the_page_works_under_a_path_of_a_proxy() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let server = stage.serve(&SHOW);
    let view = View::of(&stage);
    let mut page = browser.play("page_behind_proxy.mjs", &[&view.url]);
    assert_eq!(page.json()["type"], "held");
    page.end().expect_clean();
    view.process.terminate().expect_clean();
    server.stop();
}

#[test]
fn the_page_distinguishes_a_lost_server_from_a_lost_view_and_recovers() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let server = stage.serve(&SHOW);
    let view = View::of(&stage);
    let address = view.address.clone();
    let mut page = browser.play("page_loses.mjs", &[&view.url]);
    assert_eq!(page.json()["type"], "kill the server");
    server.process.kill();
    let lost = page.json();
    assert_eq!(lost["type"], "start a server");
    println!("a killed server was shown {} ms after its last frame", lost["shown_after_ms"]);
    let server = stage.serve(&SHOW);

    assert_eq!(page.json()["type"], "kill the view");
    view.process.kill();
    let lost = page.json();
    assert_eq!(lost["type"], "start a view");
    println!("a killed view was shown {} ms after its last frame", lost["shown_after_ms"]);
    let view = View::start(&stage, &["--listen", &address]);
    assert_eq!(page.json()["type"], "end the view");
    // The page still shows the token of the killed view.
    end_with_wrong_tokens(view);
    assert_eq!(page.json()["type"], "seen");
    page.end().expect_clean();
    server.stop();
}

#[test]
fn the_page_is_accessible_on_a_desk_in_the_dark_and_on_a_phone() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let server = stage.serve(&SHOW);
    let monitor = stage.start(&["monitor"]);
    let view = View::of(&stage);
    let without_server = Stage::new();
    let waiting = View::of(&without_server);
    let mut page = browser.play("page_is_accessible.mjs", &[&view.url, &waiting.url]);
    assert_eq!(page.json()["type"], "suspend the server");
    server.process.signal(Signal::STOP);
    assert_eq!(page.json()["type"], "kill the view");
    server.process.signal(Signal::CONT);
    view.process.kill();
    println!("axe-core: {}", page.json()["rules"]);
    page.end().expect_clean();
    waiting.process.terminate().expect_clean();
    monitor.terminate();
    server.stop();
}

#[test]
fn without_the_token_or_read_only_the_page_shows_and_does_not_steer() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let server = stage.serve(&SHOW);
    let views = [View::of(&stage), View::start(&stage, &["--listen", "127.0.0.1:0", "--read-only"])];
    let page = browser.play("page_may_not.mjs", &[&views[0].url, &views[1].url]);
    assert_eq!(page.end().expect_clean().last_json()["type"], "passed");
    let shot = Reader::join(&stage).next();
    assert_eq!(shot.state(), ShowState::Running, "no page has changed the state");
    views.into_iter().for_each(end_with_wrong_tokens);
    server.stop();
}

/// Ends a view, to which nobody but a page with a wrong token gave a reason to complain.
fn end_with_wrong_tokens(view: View) {
    let ended = view.process.terminate();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    assert!(ended.stderr.lines().all(|line| line.contains("1 wrong token from 127.0.0.1")), "{}", ended.stderr);
}

#[test]
fn off_loopback_a_page_without_the_token_asks_for_it() {
    let Some(browser) = Browser::find() else { return };
    if !is_possible(&["unshare", "--net"]) || !has_programs(&["ip"]) {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&SHOW);
    let mut alone = Command::new("unshare");
    alone.args(["--net", "sh", "-c", "ip link set lo up && ip address add 10.77.0.1/32 dev lo && exec \"$@\"", "sh"]);
    let args = [env!("CARGO_BIN_EXE_bench-dragon"), stage.domain().instance().as_str(), "10.77.0.1:0"];
    browser.give(alone.arg("node"), "page_asks_for_token.mjs", &args);
    assert_eq!(Process::start(alone).end().expect_clean().last_json()["type"], "passed");
    server.stop();
}

#[test]
fn the_timeline_shows_the_planned_clearance_of_the_whole_show() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--start-at", "20"]);
    assert_eq!(stage.run(&["ctl", "pause"]).code(), Some(0));
    let view = View::of(&stage);
    let mut page = browser.play("page_plans.mjs", &[&view.url]);
    for screen in ["desk", "phone"] {
        let shown = page.json();
        let summary = "planned: 3 near misses, the nearest 0.9 mm at 409.8 s · contact at 412.5 s";
        assert_eq!(shown["summary"], summary, "{screen}");
        assert_eq!(shown["flags"][1], "contact 412.5", "{screen}: {shown}");
        // 600 points, three near misses and a contact.
        assert_eq!(shown["points"], 604, "{screen}");
        // The contact is at 93 % of the show: the line covers nearly all of the second half.
        assert!(shown["ahead"].as_f64().is_some_and(|share| share > 0.6), "{screen}: {shown}");
    }
    page.end().expect_clean();
    view.process.terminate().expect_clean();
    server.stop();
}

#[test]
fn the_tests_of_the_pages_pure_modules_pass() {
    if !has_programs(&["node"]) {
        return;
    }
    let mut command = Command::new("node");
    command.args(["--test", "tests/node/modules/"]).current_dir(env!("CARGO_MANIFEST_DIR"));
    let ended = Process::start(command).end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stdout);
}

#[test]
fn the_types_of_the_pages_modules_are_correct() {
    let Some(Browser { node, .. }) = Browser::find() else { return };
    let mut command = Command::new("node");
    command.arg(node.join("node_modules/typescript/bin/tsc")).args(["--project", "tests/node/tsconfig.json"]);
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    let ended = Process::start(command).end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stdout);
}

/// Returns a frame of a paused show.
fn paused_shot(stage: &Stage) -> Shot {
    let mut reader = Reader::join(stage);
    let mut shots = reader.read_until("the show is paused", |header| header.show_state() == Some(ShowState::Paused));
    shots.pop().expect("at least one frame")
}

/// Returns the nearest pair of a frame of the paper's dragon.
fn nearest_pair(shot: &Shot) -> PairClearance {
    let config = Config::from_toml("").expect("the paper's dragon");
    let mut boards = Vec::new();
    let position = |handle: &bench_dragon_ipc::HandleState| DVec3::from(handle.position_m);
    config.lead().place_boards_at(&shot.handles, position, &mut boards);
    ClearanceSearch::default().nearest(&boards).expect("more than two benches")
}

/// Fails unless the benches have the colour of wood, the head has its colour, and the edges of the plan are empty.
fn assert_is_drawn(picture: &Value, pixels: &Path, shot: &Shot) {
    let bytes = fs::read(pixels).expect("the scenario has written them");
    let number = |key: &str| picture[key].as_u64().unwrap_or_else(|| panic!("{picture}")) as usize;
    let (width, height) = (number("width"), number("height"));
    assert_eq!(bytes.len(), width * height * 4);
    let at = |x: usize, y: usize| json!(bytes[(y * width + x) * 4..][..3]);
    let camera: Vec<f64> =
        picture["camera"].as_array().expect("three values").iter().filter_map(Value::as_f64).collect();
    let [x_m, y_m, scale] = camera[..] else { panic!("{picture}") };
    let colour_of = |bench: usize, share: f64| {
        let [front, rear] = [bench, bench + 1].map(|handle| DVec2::from_slice(&shot.handles[handle].position_m));
        let place = rear.lerp(front, share);
        let x = width as f64 / 2.0 + (place.x - x_m) * scale;
        let y = height as f64 / 2.0 - (place.y - y_m) * scale;
        at(x as usize, y as usize)
    };
    // The mark of the nearest pair and its label cover some benches, and possibly a part of the head.
    let benches = shot.header.bench_count as usize;
    let wooden = (1..benches).filter(|&bench| colour_of(bench, 0.5) == picture["wood"]).count();
    assert!(wooden > benches - 20, "{wooden} of {benches} benches are drawn at their pose");
    assert!(
        (1..20).any(|part| colour_of(0, f64::from(part) / 20.0) == picture["head"]),
        "the head is drawn at its pose"
    );
    for (x, y) in [(1, height / 2), (width - 2, height / 2), (width / 2, 1)] {
        assert_eq!(at(x, y), picture["ground"], "at {x}, {y}");
    }
}

#[test]
fn a_finished_show_keeps_its_plan_on_the_page() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let walk = ["--start-at", "400", "--until", "412", "--time-scale", "20", "--held", "--stay"];
    let server = stage.serve(&[&["--rate", "100"][..], &walk].concat());
    for command in [&["speed", "2"][..], &["release"]] {
        stage.run(&[&["ctl"], command].concat()).expect_clean();
    }
    let view = View::of(&stage);
    let mut page = browser.play("page_keeps_plan.mjs", &[&view.url]);
    let summary = "planned: 3 near misses, the nearest 0.9 mm, passed · contact, passed";
    assert_eq!(page.json()["summary"], summary);
    page.end().expect_clean();
    view.process.terminate().expect_clean();
    server.stop();
}
