//! The doctor: its findings on real remains and on a running server, its clean-up, and that it disturbs no other process.

use std::fs::{self, Permissions};
use std::net::TcpListener;
use std::os::unix::fs::{PermissionsExt as _, lchown, symlink};
use std::path::Path;

use bench_dragon_ipc::guard::GuardLock;
use serde_json::Value;
use test_support::eventually::eventually;
use test_support::process::{Ended, Process};

use crate::reader::{Reader, assert_whole};
use crate::stage::{Stage, program};

pub(crate) fn examine(stage: &Stage, args: &[&str]) -> Value {
    let ended = stage.run(&[&["doctor", "--format", "json"], args].concat());
    assert_eq!(ended.stderr, "", "{}", ended.stdout);
    let examination = ended.last_json();
    assert_eq!(ended.code() == Some(0), examination["healthy"] == true, "{examination}");
    examination
}

pub(crate) fn finding<'a>(examination: &'a Value, name: &str) -> &'a Value {
    let checks = examination["checks"].as_array().expect("an array");
    checks.iter().find(|check| check["name"] == name).unwrap_or_else(|| panic!("no {name} in {examination}"))
}

pub(crate) fn status<'a>(examination: &'a Value, name: &str) -> &'a str {
    finding(examination, name)["status"].as_str().expect("a word")
}

#[test]
fn tonight_the_plan_the_ports_and_the_desks_of_a_show_are_checked() {
    let stage = Stage::new();
    let taken = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let port = taken.local_addr().expect("an address").port();
    let config = stage.path("stage.toml");
    let beside = format!("[[show.also]]\ncommand = \"view --listen 127.0.0.1:{port}\"\n");
    let desk = "[[show.also]]\ncommand = \"bridge psn --to 127.0.0.1:56565\"\n";
    fs::write(&config, format!("[route]\nend_s = 400.0\n{beside}{desk}")).expect("a file");
    let flags = ["--tonight", "--config", &config.to_string_lossy()];
    let examination = examine(&stage, &flags);
    let found =
        ["plan", "room for the show", "ports", "desks", "page", "timecode"].map(|name| status(&examination, name));
    assert_eq!(found, ["ok", "ok", "problem", "ok", "problem", "ok"], "{examination}");
    drop(taken);
    assert_eq!(status(&examine(&stage, &flags), "ports"), "ok");
    let [plain, tonight] =
        [&flags[1..], &flags].map(|flags| examine(&stage, flags)["checks"].as_array().map_or(0, Vec::len));
    assert_eq!(tonight, plain + 7);
    fs::write(&config, format!("{beside}[[show.also]]\ncommand = \"dance\"\n")).expect("a file");
    let refused = stage.run(&["doctor", "--tonight", "--config", &config.to_string_lossy()]);
    assert_eq!(refused.code(), Some(2), "{}", refused.stderr);
    assert!(refused.stderr.contains("[[show.also]] command is \"dance\""), "{}", refused.stderr);
}

/// Leaves the service file of a server that was killed while it wrote: unfinished, so still writable.
fn leave_half_made(stage: &Stage) {
    let services = stage.domain().root().join("services");
    fs::create_dir_all(&services).expect("a folder");
    let path = services.join(format!("{}7525bfbf02c438827b2391c92c36b47534b62591.service", stage.domain().prefix()));
    let _ = fs::remove_file(&path);
    fs::write(&path, "").expect("a file");
    fs::set_permissions(&path, Permissions::from_mode(0o600)).expect("this user owns it");
}

#[test]
fn every_finding_is_complete_and_every_problem_has_a_remedy() {
    let stage = Stage::new();
    let examination = examine(&stage, &[]);
    let checks = examination["checks"].as_array().expect("an array");
    assert!(checks.len() >= 15, "{examination}");
    for check in checks {
        let status = check["status"].as_str().expect("a word");
        assert!(["ok", "warning", "problem", "not_known"].contains(&status), "{check}");
        assert_eq!(check["remedy"].is_string(), ["warning", "problem"].contains(&status), "{check}");
        assert!(
            check["value"].is_string() && check["message"].as_str().is_some_and(|text| !text.is_empty()),
            "{check}"
        );
    }
    assert_eq!(examination["fixed"], Value::Array(Vec::new()));
    assert_eq!((status(&examination, "server"), status(&examination, "leftovers")), ("ok", "ok"));
    assert!(stage.remains().is_empty(), "an examination leaves no remains");
}

#[test]
fn people_get_a_line_for_each_check() {
    let stage = Stage::new();
    let stdout = stage.run(&["doctor"]).stdout;
    for name in ["shared memory", "open files", "real-time priority", "processor governor", "clock source", "timers"] {
        assert!(stdout.lines().any(|line| line.contains(name)), "{name} in {stdout}");
    }
}

#[test]
fn a_killed_server_is_found_and_its_remains_are_removed() {
    let stage = Stage::new();
    stage.serve(&[]).process.kill();
    assert!(!stage.remains().is_empty(), "a killed server leaves remains");
    let before = examine(&stage, &[]);
    assert_eq!(status(&before, "leftovers"), "warning", "{before}");
    assert!(!stage.remains().is_empty(), "an examination removes nothing");
    let fixed = examine(&stage, &["--fix"]);
    assert!(!fixed["fixed"].as_array().expect("an array").is_empty(), "{fixed}");
    assert_eq!(status(&fixed, "leftovers"), "ok", "{fixed}");
    assert!(stage.remains().is_empty(), "{:#?}", stage.remains());
}

#[test]
fn a_half_made_service_is_a_problem_that_fix_removes() {
    let stage = Stage::new();
    stage.serve(&[]).process.kill();
    leave_half_made(&stage);
    let before = examine(&stage, &[]);
    assert_eq!(
        (status(&before, "half-made services"), &before["healthy"]),
        ("problem", &Value::Bool(false)),
        "{before}"
    );
    let remedy = finding(&before, "half-made services")["remedy"].as_str().expect("a remedy").to_owned();
    assert!(
        remedy.contains(&format!("`bench-dragon doctor --fix --instance {}`", stage.domain().instance())),
        "{remedy}"
    );
    let fixed = examine(&stage, &["--fix"]);
    assert_eq!(status(&fixed, "half-made services"), "ok", "{fixed}");
    assert!(stage.remains().is_empty(), "{:#?}", stage.remains());
}

#[test]
fn remains_without_a_directory_are_found_and_removed() {
    let stage = Stage::new();
    let segment = Path::new("/dev/shm").join(format!("{}1234.data", stage.domain().prefix()));
    fs::write(&segment, "left").expect("shared memory");
    assert_eq!(status(&examine(&stage, &[]), "leftovers"), "warning");
    let fixed = examine(&stage, &["--fix"]);
    assert!(fixed["fixed"].to_string().contains("1234.data"), "{fixed}");
    assert!(!segment.exists());
}

#[test]
fn foreign_files_in_shared_memory_do_no_harm() {
    const ANOTHER_USER: u32 = 12_345;
    let stage = Stage::new();
    let path = |name: &str| Path::new("/dev/shm").join(format!("{}{name}", stage.domain().prefix()));
    let (file, folder, link) = (path("junk"), path("junk-folder"), path("junk-link"));
    fs::write(&file, "junk").expect("shared memory");
    fs::create_dir(&folder).expect("shared memory");
    fs::write(folder.join("inner"), "junk").expect("shared memory");
    symlink("/etc/hostname", &link).expect("shared memory");
    let are_foreign = [&file, &folder, &link].iter().all(|path| lchown(path, Some(ANOTHER_USER), None).is_ok());
    let server = stage.serve(&["--rate", "200"]);
    let examination = examine(&stage, &[]);
    server.stop();
    if are_foreign {
        // Only root may give files away, so only root runs this part.
        let message = finding(&examination, "foreign files")["message"].as_str().expect("a line").to_owned();
        assert!(message.contains("3 files of other users") && message.contains("of user 12345"), "{message}");
        assert!(!message.contains("harmless"), "{message}");
        let fixed = examine(&stage, &["--fix"]);
        assert_eq!((status(&fixed, "leftovers"), &fixed["fixed"]), ("ok", &Value::Array(Vec::new())), "{fixed}");
        assert!(file.exists() && folder.join("inner").exists(), "the files of other users remain");
        fs::remove_file(&file).expect("root may do this");
        fs::remove_dir_all(&folder).expect("root may do this");
        fs::remove_file(&link).expect("root may do this");
    }
    // Files of the user are removed, of any kind.
    fs::create_dir(&folder).expect("shared memory");
    symlink("/etc/hostname", &link).expect("shared memory");
    stage.serve(&["--rate", "200"]).stop();
    assert!(stage.remains().is_empty() && Path::new("/etc/hostname").exists(), "{:#?}", stage.remains());
}

#[test]
fn a_running_show_is_reported_and_loses_no_frame() {
    let stage = Stage::new();
    // Slow, so that the reader's buffer holds twenty seconds.
    let server = stage.serve(&["--rate", "10", "--readers", "1"]);
    let mut reader = Reader::join(&stage);
    let mut shots = vec![reader.next()];
    // A killed client leaves an entry beside those of the running ones.
    let mut client = stage.start(&["echo"]);
    assert!(client.next_line().is_some(), "it reads");
    let pid = client.pid();
    client.kill();
    let before = examine(&stage, &[]);
    let value = finding(&before, "server")["value"].as_str().expect("a word").to_owned();
    assert_eq!(value, format!("pid {}", server.process.pid()), "{before}");
    assert_eq!((status(&before, "leftovers"), status(&before, "services")), ("warning", "ok"), "{before}");
    let fixed = examine(&stage, &["--fix"]);
    assert_eq!(status(&fixed, "leftovers"), "ok", "{fixed}");
    assert!(fixed["fixed"].to_string().contains(&format!("pid {pid}")), "{fixed}");
    let run_id = server.run_id;
    let published = server.stop()["frames"].clone();
    shots.extend(reader.read_unread());
    assert_whole(&shots, run_id);
    assert_eq!(published, shots.len());
}

#[test]
fn a_directory_that_others_may_write_is_a_problem_and_is_left_alone() {
    let runtime_dir = tempfile::Builder::new().prefix("bd").tempdir_in("/tmp").expect("a folder");
    let bus = runtime_dir.path().join("bench-dragon");
    fs::create_dir(&bus).expect("a folder");
    fs::set_permissions(&bus, Permissions::from_mode(0o777)).expect("this user owns it");
    for args in [&["doctor", "--format", "json"][..], &["doctor", "--format", "json", "--fix"]] {
        let mut command = program(args);
        command.env("XDG_RUNTIME_DIR", runtime_dir.path());
        let ended: Ended = Process::start(command).end();
        let examination = ended.last_json();
        assert_eq!((ended.code(), ended.stderr.as_str()), (Some(1), ""), "{examination}");
        assert_eq!(status(&examination, "directory"), "problem");
        assert_eq!(finding(&examination, "directory")["remedy"], "chmod 0700 it");
        assert_eq!(status(&examination, "server"), "not_known");
    }
    assert_eq!(fs::read_dir(&bus).expect("a folder").count(), 0);
}

#[test]
fn a_guarded_server_without_a_guard_is_a_problem() {
    let stage = Stage::new();
    assert_eq!(finding(&examine(&stage, &[]), "guard")["message"], "no server, and no guard");
    let server = stage.serve(&["--rate", "100"]);
    assert_eq!(status(&examine(&stage, &[]), "guard"), "ok");
    server.stop();
    let server = stage.serve(&["--guarded", "--rate", "100"]);
    let missing = examine(&stage, &[]);
    assert_eq!((status(&missing, "guard"), &missing["healthy"]), ("problem", &Value::Bool(false)));
    let guard = crate::guard::start_guard(&stage);
    eventually("the guard has its lock", || GuardLock::holder(stage.domain()));
    assert_eq!(status(&examine(&stage, &[]), "guard"), "ok");
    guard.terminate().expect_clean();
    server.stop();
}
