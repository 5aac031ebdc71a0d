//! The planner's page: in Chromium, compared with `solve`, and its requests.

use std::fmt::Write as _;
use std::fs;
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};
use test_support::process::Process;

use crate::browser::{Browser, View};
use crate::stage::{Stage, program};

/// A loop that the dragon's head closes: it walks into its own body.
const LOOP: &str = "# a loop
[dragon]
benches = 60 # all that we have

[route]
kind = \"path\"
start_x_m = -30.0

[[route.segments]]
kind = \"line\"
length_m = 30.0

[[route.segments]]
kind = \"arc\"
radius_m = 4.0 # at the well
turn_deg = 90.0

[[route.segments]]
kind = \"line\"
length_m = 12.0

[[route.segments]]
kind = \"arc\"
radius_m = 4.0
turn_deg = 90.0

[[route.segments]]
kind = \"line\"
length_m = 12.0

[[route.segments]]
kind = \"arc\"
radius_m = 4.0
turn_deg = 90.0

[[route.segments]]
kind = \"line\"
length_m = 40.0
";

fn planner(file: &Path) -> View {
    let file = file.display().to_string();
    View::announced_by(Process::start(program(&["plan", &file, "--listen", "127.0.0.1:0", "--format", "json"])))
}

fn solve(question: &[&str], file: &Path) -> Value {
    let config = file.display().to_string();
    let args = [&["solve"], question, &["--config", &config, "--format", "json"]].concat();
    Process::start(program(&args)).end().expect_clean().last_json()
}

/// A number of the answer as the page writes it.
fn shown(answer: &Value, key: &str, digits: usize, unit: &str) -> Value {
    let number = answer[key].as_f64().unwrap_or_else(|| panic!("{answer} has no {key}"));
    json!(format!("{number:.digits$}{unit}"))
}

#[test]
fn a_plan_is_dragged_undone_and_saved_and_its_numbers_are_those_of_solve() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let file = stage.path("loop.toml");
    fs::write(&file, LOOP).expect("a file");
    let planner = planner(&file);
    let pictures = std::env::var("BENCH_DRAGON_PICTURES").map_or_else(|_| stage.path("."), Into::into);
    let args = [&*planner.url, &file.display().to_string(), &pictures.display().to_string()];
    let mut page = browser.play("planner_drags.mjs", &args);

    let dragged = page.json();
    println!("a dragged corner is drawn after {} ms (p50), {} ms (p95)", dragged["p50_ms"], dragged["p95_ms"]);
    let saved = page.json();
    // The file itself changes again.
    let copy = stage.path("saved.toml");
    assert_eq!(saved["text"], fs::read_to_string(&copy).expect("the file"), "{saved}");
    let (contact, route) = (solve(&["contact"], &copy), solve(&["route"], &copy));
    let numbers = &saved["numbers"];
    assert_eq!(numbers["First contact"], shown(&contact, "time_s", 6, " s"));
    assert_eq!(numbers["Route"], shown(&route, "length_m", 3, " m"));
    assert_eq!(numbers["Tightest bend"], shown(&route, "tightest_radius_m", 3, " m"));
    let speed = solve(&["speed-limit", "--limit", "2"], &copy);
    assert_eq!(numbers["Fastest handle"], shown(&speed, "largest_ratio", 3, " × head"));

    let refused = page.json();
    assert!(refused["reason"].as_str().is_some_and(|reason| reason.starts_with("loop.toml has changed")), "{refused}");
    let done = page.json();
    assert!(fs::read_to_string(&file).expect("the file").ends_with("# another program\n"));
    assert_eq!(done["text"], fs::read_to_string(stage.path("other.toml")).expect("the other file"));
    page.end().expect_clean();
    planner.process.terminate().expect_clean();
}

/// A spiral that ends after its first contact.
const SPIRAL: &str = "[dragon]
benches = 40
[route] # ours
kind = \"spiral\"
pitch_m = 0.5 # narrow
end_s = 360.0
";

#[test]
fn an_answer_and_a_fix_are_put_into_the_plan_and_a_cancelled_question_ends() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let file = stage.path("spiral.toml");
    fs::write(&file, SPIRAL).expect("a file");
    let planner = planner(&file);
    let pictures = std::env::var("BENCH_DRAGON_PICTURES").map_or_else(|_| stage.path("."), Into::into);
    let of_planner = planner.process.pid().to_string();
    let mut page = browser.play("planner_asks.mjs", &[&planner.url, &pictures.display().to_string(), &of_planner]);
    let done = page.json();
    println!("beside a question, a dragged pitch is drawn after {} ms (p95)", done["beside_p95_ms"]);
    page.end().expect_clean();
    planner.process.terminate().expect_clean();

    // The page has the answer of `solve`, and what was put into the plan is what `--save-config` writes.
    let saved = stage.path("saved.toml");
    let config = file.display().to_string();
    let args = ["solve", "pitch", "--config", &config, "--save-config", &saved.display().to_string()];
    let ended = Process::start(program(&args)).end().expect_clean();
    assert_eq!(done["answer"].as_str().map(str::trim_end), Some(ended.stdout.trim_end()));
    let put = stage.path("put.toml");
    fs::write(&put, done["put"].as_str().expect("a text")).expect("a file");
    assert_eq!(solve(&["contact"], &put), solve(&["contact"], &saved));
    assert_eq!(solve(&["route"], &put), solve(&["route"], &saved));
    let fixed = stage.path("fixed.toml");
    fs::write(&fixed, done["fixed"].as_str().expect("a text")).expect("a file");
    assert_eq!(solve(&["contact"], &fixed)["time_s"], Value::Null, "{done}");
}

fn pictures(stage: &Stage) -> String {
    std::env::var("BENCH_DRAGON_PICTURES").unwrap_or_else(|_| stage.path(".").display().to_string())
}

#[test]
fn routes_borders_dragons_and_dropped_drawings_are_drawn_with_mouse_keys_and_finger() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let file = stage.path("loop.toml");
    fs::write(&file, LOOP).expect("a file");
    let planner = planner(&file);
    let args = [&*planner.url, &file.display().to_string(), &pictures(&stage)];
    let mut page = browser.play("planner_draws.mjs", &args);
    page.json();
    page.end().expect_clean();
    planner.process.terminate().expect_clean();
    let left = fs::read_dir(stage.path("."))
        .expect("the folder")
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let mut drawings: Vec<String> =
        left.filter(|name| Path::new(name).extension().is_some_and(|end| end != "png" && end != "toml")).collect();
    drawings.sort();
    assert_eq!(drawings, ["street.svg", "walk.csv"]);
}

#[test]
fn a_draft_survives_other_tabs_and_a_killed_program() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let file = stage.path("loop.toml");
    fs::write(&file, LOOP).expect("a file");
    let first = planner(&file);
    let args = [&*first.url, &file.display().to_string(), &pictures(&stage)];
    let mut node = Command::new("node");
    browser.give(&mut node, "planner_keeps.mjs", &args);
    let (mut page, mut stdin) = Process::start_with_stdin(node);
    assert_eq!(page.json()["type"], "kill");
    let token = first.url.split_once("#token=").expect("the address has the token").1.to_owned();
    let address = first.address.clone();
    first.process.kill();
    assert_eq!(page.json()["type"], "start");
    let mut again = program(&["plan", &file.display().to_string(), "--listen", &address, "--format", "json"]);
    again.env("BENCH_DRAGON_TOKEN", token);
    let second = View::announced_by(Process::start(again));
    stdin.write_all(b"started\n").expect("the scenario waits for it");
    let done = page.json();
    assert_eq!(done["text"], fs::read_to_string(&file).expect("the file"), "{done}");
    page.end().expect_clean();
    second.process.terminate().expect_clean();
}

#[test]
fn a_beginner_draws_a_street_removes_a_contact_and_saves_a_show() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let readme = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).expect("the README");
    assert!(readme.contains("`bench-dragon plan` "), "the README has the planner");
    let mut command = program(&["plan", "--listen", "127.0.0.1:0", "--format", "json"]);
    command.current_dir(stage.path("."));
    let planner = View::announced_by(Process::start(command));
    let mut page = browser.play("planner_first_show.mjs", &[&planner.url]);
    let done = page.json();
    println!("a first show takes the page {} s: {}", done["seconds"], done["steps"]);
    let saved = stage.path("first-show.toml");
    assert_eq!(done["text"], fs::read_to_string(&saved).expect("the show"));
    assert_eq!(solve(&["contact"], &saved)["time_s"], Value::Null);
    page.end().expect_clean();
    planner.process.terminate().expect_clean();
}

/// Sends a request, and returns its status and its body.
fn request(address: &str, head: &str, body: &str) -> (u16, String) {
    let mut stream = TcpStream::connect(address).expect("the planner listens");
    let length = body.len();
    let request = format!("{head}\r\nHost: {address}\r\nConnection: close\r\nContent-Length: {length}\r\n\r\n{body}");
    stream.write_all(request.as_bytes()).expect("it reads the request");
    let mut reply = String::new();
    stream.read_to_string(&mut reply).expect("it replies");
    let status = reply.split(' ').nth(1).and_then(|status| status.parse().ok()).expect("a status");
    (status, reply.split_once("\r\n\r\n").expect("a body").1.to_owned())
}

#[test]
fn saving_needs_the_token_and_stays_in_the_folder() {
    let stage = Stage::new();
    let file = stage.path("loop.toml");
    fs::write(&file, LOOP).expect("a file");
    let planner = planner(&file);
    let (status, text) = request(&planner.address, "GET /text HTTP/1.1", "");
    assert_eq!(status, 200, "a browser on this machine may look: {text}");
    let told: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!((&told["name"], &told["text"]), (&json!("loop.toml"), &json!(LOOP)));

    let json = "Content-Type: application/json";
    let token = planner.url.split_once("#token=").expect("the address has the token").1;
    let with_token = format!("POST /save HTTP/1.1\r\n{json}\r\nX-Bench-Dragon-Token: {token}");
    let save = |head: &str, name: &str, known: &Value| {
        request(&planner.address, head, &json!({ "name": name, "text": "# mine\n", "known": known }).to_string())
    };
    let (status, reason) = save(&format!("POST /save HTTP/1.1\r\n{json}"), "loop.toml", &told["mark"]);
    assert_eq!(status, 401, "{reason}");
    let (status, reason) = save(&with_token, "../outside.toml", &Value::Null);
    assert_eq!(status, 400, "{reason}");
    let (status, reason) = save(&with_token, "loop.toml", &json!("00000000-0"));
    assert_eq!(status, 409, "{reason}");
    assert_eq!(fs::read_to_string(&file).expect("the file"), LOOP);
    let (status, reason) = save(&with_token, "loop.toml", &told["mark"]);
    assert_eq!(status, 200, "{reason}");
    assert_eq!(fs::read_to_string(&file).expect("the file"), "# mine\n");
    planner.process.terminate().expect_clean();
}

#[test]
fn a_configuration_that_is_not_valid_is_one_line_and_exit_status_2() {
    let stage = Stage::new();
    let file = stage.path("bad.toml");
    fs::write(&file, "[route]\nkind = \"spirale\"\n").expect("a file");
    for config in [file.display().to_string(), stage.path("missing.toml").display().to_string()] {
        let ended = Process::start(program(&["plan", &config, "--listen", "127.0.0.1:0"])).end();
        assert_eq!((ended.code(), ended.stdout.as_str()), (Some(2), ""), "{}", ended.stderr);
        assert_eq!(ended.stderr.lines().count(), 1, "{}", ended.stderr);
        assert!(ended.stderr.contains(&config), "{}", ended.stderr);
    }
}

/// Greatest memory of a process so far, in MiB.
fn most_memory_mib(process: &Process) -> u64 {
    let status = fs::read_to_string(format!("/proc/{}/status", process.pid())).expect("the process is there");
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("its memory");
    line.trim().trim_end_matches(" kB").parse::<u64>().expect("a number") >> 10
}

#[test]
fn a_drawing_that_takes_too_much_memory_is_refused_and_the_planner_goes_on() {
    let stage = Stage::new();
    let file = stage.path("loop.toml");
    fs::write(&file, LOOP).expect("a file");
    let mut points = "x_m,y_m\n".to_owned();
    let (mut heading, mut x_m, mut y_m) = (0.0_f64, 0.0, 0.0);
    for number in 0..1_500_000 {
        heading += 0.3 * (f64::from(number) * 0.37).sin() + 0.001;
        (x_m, y_m) = (x_m + 0.01 * heading.cos(), y_m + 0.01 * heading.sin());
        writeln!(points, "{x_m:.6},{y_m:.6}").expect("a string takes every line");
    }
    fs::write(stage.path("there.csv"), &points).expect("a file");
    let planner = planner(&file);
    let token = planner.url.split_once("#token=").expect("the address has the token").1;
    let post = |path: &str, kind: &str, body: &str| {
        let head = format!("POST {path} HTTP/1.1\r\nContent-Type: {kind}\r\nX-Bench-Dragon-Token: {token}");
        request(&planner.address, &head, body)
    };
    let text = "[dragon]\nbenches = 3\n[route]\nkind = \"drawing\"\nfile = \"there.csv\"\n";
    let saving = json!({ "name": "big.toml", "text": text, "known": null }).to_string();
    let (status, reason) = post("/save", "application/json", &saving);
    assert_eq!(status, 400, "{reason}");
    assert!(reason.contains("takes more than 1024 MiB of memory, the most that is allowed"), "{reason}");
    assert!(!stage.path("big.toml").exists());
    let (status, reason) = post("/import?name=dropped.csv", "application/octet-stream", &points);
    assert_eq!(status, 400, "{reason}");
    assert!(reason.contains("takes more than 1024 MiB of memory, the most that is allowed"), "{reason}");
    assert!(!stage.path("dropped.csv").exists(), "a file without a route is taken back");
    assert!(most_memory_mib(&planner.process) < 512, "another process reads the drawing");

    // Importing needs the token, and stays in the folder.
    let (status, reason) = request(&planner.address, "POST /import?name=walk.csv HTTP/1.1", "x_m,y_m\n0,0\n9,9\n");
    assert_eq!(status, 401, "{reason}");
    let (status, reason) = post("/import?name=..%2Fwalk.csv", "application/octet-stream", "x_m,y_m\n0,0\n9,9\n");
    assert_eq!(status, 400, "{reason}");
    let (status, route) = post("/import?name=walk.csv", "application/octet-stream", "x_m,y_m\n0,0\n9,9\n");
    assert_eq!(status, 200, "{route}");
    assert_eq!(fs::read_to_string(stage.path("walk.csv")).expect("the file"), "x_m,y_m\n0,0\n9,9\n");
    planner.process.terminate().expect_clean();
}
