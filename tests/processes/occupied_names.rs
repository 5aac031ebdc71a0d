//! Files of other users in shared memory, with the names that this user's processes would use.

use std::ffi::OsStr;
use std::fs;
use std::os::unix::fs::{lchown, symlink};
use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::tempdir;
use test_support::process::Process;
use test_support::skip::skip;

use crate::reader::Reader;
use crate::stage::Stage;

const ANOTHER_USER: u32 = 12_345;
const STATE: &str = ".global_mgmt";

/// Returns the only segment whose name does not contain the number of a process or a port: the state of iceoryx2's unique numbers.
fn state_segment(stage: &Stage) -> PathBuf {
    let is_state = |path: &PathBuf| path.to_string_lossy().ends_with(STATE);
    let mut found = stage.remains().into_iter().filter(is_state);
    let segment = found.next().expect("a server runs");
    assert_eq!(found.next(), None, "there is one state");
    segment
}

/// Returns the name of a segment that follows from user and instance alone: iceoryx2's own.
fn guessed(segment: &Path) -> PathBuf {
    let name = segment.to_str().expect("the name is ASCII");
    let (stem, number) = name.strip_suffix(STATE).and_then(|rest| rest.rsplit_once('.')).expect("a number");
    assert!(number.len() == 32 && number.bytes().all(|byte| byte.is_ascii_hexdigit()), "{number}");
    PathBuf::from(format!("{stem}{STATE}"))
}

#[test]
fn a_file_of_another_user_keeps_no_process_from_starting() {
    type Occupy = fn(&Path);
    let kinds: [(&str, Occupy); 4] = [
        ("an empty file", |path| fs::write(path, "").expect("shared memory")),
        ("a file", |path| fs::write(path, [1; 4_096]).expect("shared memory")),
        ("a folder", |path| fs::create_dir(path).expect("shared memory")),
        ("a link", |path| symlink("/etc/hostname", path).expect("shared memory")),
    ];
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    let taken = guessed(&state_segment(&stage));
    server.stop();
    for (kind, occupy) in kinds {
        occupy(&taken);
        let is_foreign = lchown(&taken, Some(ANOTHER_USER), None).is_ok();
        if !is_foreign {
            skip("only root may give files away");
        }
        let server = stage.serve(&["--rate", "50"]);
        Reader::join(&stage).next();
        let findings = stage.run(&["doctor", "--format", "json"]).last_json();
        server.stop();
        if is_foreign {
            assert_eq!(finding(&findings, "foreign files")["status"], "warning", "{kind}: {findings}");
            if taken.is_dir() { fs::remove_dir(&taken) } else { fs::remove_file(&taken) }.expect("root may do this");
        }
    }
}

#[test]
fn a_name_that_another_user_has_seen_and_occupied_is_taken_no_more() {
    // The random part belongs to the user, so this test has a folder of its own for it.
    let (stage, runtime) = (Stage::new(), tempdir().expect("a folder"));
    let start = |args: &[&str]| {
        let mut command = stage.command(args);
        command.env("XDG_RUNTIME_DIR", runtime.path());
        Process::start(command)
    };
    let serve = || {
        let mut server = start(&["serve", "--format", "json", "--rate", "50"]);
        assert_eq!(server.json()["type"], "started");
        server
    };
    let segments = || {
        let prefix = stage.domain().prefix();
        let entries = fs::read_dir("/dev/shm").expect("shared memory").flatten().map(|entry| entry.path());
        let is_state = |path: &PathBuf| {
            let name = path.file_name().and_then(OsStr::to_str).unwrap_or_default();
            name.starts_with(&prefix) && name.ends_with(STATE)
        };
        entries.filter(is_state).collect::<Vec<PathBuf>>()
    };
    let server = serve();
    let found = segments();
    let [seen] = &found[..] else { panic!("there is one state") };
    server.terminate().expect_clean();
    fs::write(seen, "").expect("shared memory");
    if lchown(seen, Some(ANOTHER_USER), None).is_err() {
        fs::remove_file(seen).expect("its user may remove it");
        return skip("only root may give files away");
    }
    let server = serve();
    start(&["echo", "--count", "1"]).end().expect_clean();
    let states = segments();
    assert!(states.len() == 2 && states.contains(seen), "the server has another name: {states:?}");
    server.terminate().expect_clean();
    fs::remove_file(seen).expect("root may do this");
}

fn finding<'a>(findings: &'a Value, check: &str) -> &'a Value {
    let checks = findings["checks"].as_array().expect("a list");
    checks.iter().find(|finding| finding["name"] == check).expect("the doctor checks it")
}

#[test]
fn the_random_part_of_names_is_the_same_for_all_instances_and_for_this_user_only() {
    use std::os::unix::fs::MetadataExt as _;

    let stage = Stage::new();
    let printed = stage.run(&["iox2-config"]).expect_clean().stdout;
    let server = stage.serve(&["--rate", "50"]);
    let segment = state_segment(&stage);
    let (_, number) =
        segment.to_str().expect("ASCII").strip_suffix(STATE).and_then(|name| name.rsplit_once('.')).expect("one");
    assert!(printed.contains(&format!("global-mgmt-suffix = \".{number}{STATE}\"")), "{printed}");
    assert_eq!(fs::read_to_string(stage.domain().root().join("iceoryx2.toml")).expect("a file"), printed);
    let secret = stage.domain().root().parent().expect("a folder").join("secret");
    assert_eq!(fs::metadata(&secret).expect("a file").mode() & 0o777, 0o600);
    server.stop();
}
