//! Exhausted resources: shared memory, disks, files, rights. Each is reported in one line with the remedy, and leaves no
//! remains.

use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::Command;

use test_support::eventually::eventually;
use test_support::executable::write_executable;
use test_support::process::{Ended, Process};
use test_support::skip::{can_start, is_possible};

use crate::stage::Stage;

const NOBODY: &str = "65534";

/// Fails unless the process ended with status 1 and one line of error that contains this text.
fn assert_error(ended: &Ended, what: &str) {
    assert_eq!(ended.code(), Some(1), "{what}: {}", ended.stderr);
    let lines: Vec<&str> = ended.stderr.lines().collect();
    assert!(
        matches!(lines[..], [line] if line.starts_with("error: ") && line.contains(what)),
        "{what}: {}",
        ended.stderr
    );
}

/// Starts a command on the stage through another program.
pub(crate) fn behind(launcher: &[&str], command: &Command) -> Process {
    let [program, args @ ..] = launcher else { panic!("a launcher has a name") };
    let mut launched = Command::new(program);
    launched.args(args).arg(command.get_program()).args(command.get_args());
    launched.env_remove("RUST_LOG").current_dir(command.get_current_dir().expect("the stage has a folder"));
    Process::start(launched)
}

/// Returns a launcher that gives a process its own /dev/shm.
fn with_shared_memory(options: &str) -> Vec<String> {
    let script = format!(r#"mount -t tmpfs -o {options} none /dev/shm && exec "$@""#);
    ["unshare", "--mount", "sh", "-c", &script, "sh"].map(str::to_owned).to_vec()
}

fn words(launcher: &[String]) -> Vec<&str> {
    launcher.iter().map(String::as_str).collect()
}

#[test]
fn every_file_limit_that_is_too_small_is_reported_in_one_line() {
    if !is_possible(&["prlimit", "--nofile=64"]) {
        return;
    }
    let stage = Stage::new();
    // With fewer files no program can be loaded: it needs four, and those that this process has inherited.
    let fewest = (4..64).find(|files| can_start(&["prlimit", &format!("--nofile={files}")])).expect("64 are enough");
    for files in fewest..=64 {
        let limit = format!("--nofile={files}");
        for args in [&["serve", "--until", "0.01"][..], &["ctl", "pause"], &["echo", "--count", "1"], &["monitor"]] {
            let is_client = args[0] != "serve";
            if is_client && files > 48 {
                continue;
            }
            let ended = behind(&["prlimit", &limit], &stage.command(args)).end();
            assert_error(&ended, "ulimit -n 1024");
        }
        assert!(stage.remains().is_empty(), "{files}: {:#?}", stage.remains());
    }
}

#[test]
fn a_limit_that_the_program_may_raise_is_raised() {
    if !is_possible(&["prlimit", "--nofile=16:4096"]) {
        return;
    }
    let stage = Stage::new();
    behind(&["prlimit", "--nofile=16:4096"], &stage.command(&["serve", "--until", "0.01", "--format", "json"]))
        .end()
        .expect_clean();
}

#[test]
fn too_little_shared_memory_is_reported_before_anything_is_created() {
    for (options, what) in [
        ("size=64k", "/dev/shm has less than the 6.3 MB free"),
        ("size=8m", "/dev/shm has less than the 57.5 MB free"),
        ("ro", "/dev/shm cannot be written (Read-only file system"),
    ] {
        let launcher = with_shared_memory(options);
        if !is_possible(&words(&launcher)) {
            return;
        }
        let stage = Stage::new();
        assert_error(&behind(&words(&launcher), &stage.command(&["serve", "--until", "0.01"])).end(), what);
        let doctor = behind(&words(&launcher), &stage.command(&["doctor", "--format", "json"])).end();
        let told = doctor.last_json()["checks"].to_string();
        assert!(options == "ro" || told.contains("mount -o remount,size="), "{told}");
    }
}

#[test]
fn a_server_without_shared_memory_at_all_ends_with_an_error() {
    let launcher =
        ["unshare", "--mount", "sh", "-c", r#"mount -t tmpfs none /dev && mknod /dev/null c 1 3 && exec "$@""#, "sh"];
    if !is_possible(&launcher) {
        return;
    }
    let stage = Stage::new();
    let ended = behind(&launcher, &stage.command(&["serve", "--until", "0.01"])).end();
    assert_error(&ended, "/dev/shm: No such file or directory (os error 2): mount it");
}

#[test]
fn a_file_size_limit_is_an_error_and_not_a_signal() {
    if !is_possible(&["prlimit", "--fsize=100"]) {
        return;
    }
    let stage = Stage::new();
    let mut command = stage.command::<&str>(&[]);
    command = {
        let mut solve = Command::new(command.get_program());
        solve.args(["solve", "poses", "--at", "0", "--xlsx", "poses.xlsx"]).current_dir(stage.path("."));
        solve
    };
    assert_error(&behind(&["prlimit", "--fsize=100"], &command).end(), "ulimit -f unlimited");
    let left: Vec<_> =
        fs::read_dir(stage.path(".")).expect("a folder").flatten().map(|entry| entry.file_name()).collect();
    assert!(left.is_empty(), "partial files remain: {left:?}");
    assert_error(
        // The domain's own files are smaller.
        &behind(&["prlimit", "--fsize=4000"], &stage.command(&["serve", "--until", "0.01"])).end(),
        "ulimit -f unlimited",
    );
}

#[test]
fn a_full_stdout_is_named() {
    let stage = Stage::new();
    let ended = behind(&["sh", "-c", r#"exec "$@" > /dev/full"#, "sh"], &stage.command(&["iox2-config"])).end();
    assert_error(&ended, "cannot write to stdout: No space left on device");
}

#[test]
fn two_users_have_two_buses_and_neither_may_use_the_others() {
    let as_nobody = ["setpriv", "--reuid", NOBODY, "--regid", NOBODY, "--clear-groups"];
    if !is_possible(&as_nobody) {
        return;
    }
    let stage = Stage::new();
    // A copy of the program that another user can read, and a folder for the buses that belongs to root.
    let runtime_dir = tempfile::Builder::new().prefix("bd").tempdir_in("/tmp").expect("a folder");
    let others = runtime_dir.path().join("bench-dragon");
    fs::create_dir(&others).expect("a folder");
    let program = runtime_dir.path().join("program");
    write_executable(&program, fs::read(env!("CARGO_BIN_EXE_bench-dragon")).expect("the program"));
    let readable = std::os::unix::fs::PermissionsExt::from_mode(0o755);
    fs::set_permissions(runtime_dir.path(), readable).expect("this user owns it");
    let server = stage.serve(&[]);
    let run = |args: &[&str], runtime_dir: Option<&Path>| {
        let mut command = Command::new(as_nobody[0]);
        command.args(&as_nobody[1..]).arg(&program).args(args).current_dir("/").env_remove("RUST_LOG");
        command.args(["--instance", stage.domain().instance().as_str()]);
        match runtime_dir {
            Some(path) => command.env("XDG_RUNTIME_DIR", path),
            None => command.env_remove("XDG_RUNTIME_DIR"),
        };
        Process::start(command).end()
    };
    // The instance has the same name, but is another user's.
    assert_error(&run(&["ctl", "pause"], None), "no server runs on instance");
    run(&["serve", "--until", "0.01", "--format", "json"], None).expect_clean();
    for args in [&["serve"][..], &["ctl", "pause"], &["echo"]] {
        assert_error(&run(args, Some(runtime_dir.path())), "belongs to user 0, must belong to user 65534");
    }
    server.stop();
    let _ = fs::remove_dir(Path::new("/tmp/bench-dragon-65534"));
}

#[test]
fn a_missing_runtime_directory_is_reported_by_readers_too() {
    for args in [&["serve"][..], &["ctl", "pause"], &["echo"], &["monitor"]] {
        let mut command = crate::stage::program(args);
        command.env("XDG_RUNTIME_DIR", OsStr::new("/tmp/bench-dragon-is-not-there"));
        assert_error(
            &Process::start(command).end(),
            "XDG_RUNTIME_DIR is /tmp/bench-dragon-is-not-there, must be an existing directory",
        );
    }
}

/// Starts a show on a disk with six megabytes of room. Returns it with its messages once it is not recorded any more.
pub(crate) fn fill_disk(stage: &Stage) -> (Process, Vec<String>) {
    fs::create_dir(stage.path("disk")).expect("the folder is there");
    let script = r#"mount -t tmpfs -o size=300m none disk && fallocate --length 294MiB disk/filler && exec "$@""#;
    let launcher = ["unshare", "--mount", "sh", "-c", script, "sh"];
    let show = behind(&launcher, &stage.command(&["show", "--rate", "1000", "--out", "disk/show"]));
    let mut told = vec![show.complaint()];
    while !told[told.len() - 1].contains("the show is not recorded from here on") {
        told.push(show.complaint());
    }
    (show, told)
}

/// Makes room on the disk of such a show, which no other process sees.
pub(crate) fn empty_disk(stage: &Stage, show: &Process) {
    let filler = format!("/proc/{}/root{}", show.pid(), stage.path("disk/filler").display());
    fs::remove_file(filler).expect("the show's disk has a filler");
}

#[test]
fn a_show_reports_a_full_disk_once_and_records_again_when_there_is_room() {
    if !is_possible(&["unshare", "--mount"]) {
        return;
    }
    let stage = Stage::new();
    let (show, told) = fill_disk(&stage);
    assert!(
        told.last()
            .is_some_and(|line| line.contains("  the show is not recorded from here on, until its disk has 268.4 MB")),
        "{told:?}"
    );
    empty_disk(&stage, &show);
    show.complaint_with("the disk has room again: the show is recorded from here on, in another file");
    let second = format!("/proc/{}/root{}", show.pid(), stage.path("disk/show/recording-2.mcap").display());
    eventually("the second recording", || fs::exists(&second).expect("the path can be checked").then_some(()));
    let ended = show.terminate();
    assert_eq!(ended.code(), Some(1), "the recording has a hole: {}", ended.stderr);
    assert_eq!(told.iter().filter(|line| line.contains("the disk is full")).count(), 1, "{told:?}");
    assert!(!ended.stderr.contains("the disk is full"), "{}", ended.stderr);
}
