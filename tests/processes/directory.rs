//! The directory of the bus: it belongs to the user, or is refused. Only the processes of these tests use another directory.

use std::fs::{self, Permissions};
use std::os::unix::fs::{MetadataExt, PermissionsExt, chown};
use std::path::Path;
use std::process::Command;

use bench_dragon_ipc::FrameSubscriber;
use tempfile::TempDir;
use test_support::process::{Ended, Process};

use crate::stage::{Stage, program};

fn run_in(runtime_dir: &Path, args: &[&str]) -> Ended {
    let mut command = program(args);
    command.env("XDG_RUNTIME_DIR", runtime_dir);
    Process::start(command).end()
}

/// Creates a runtime directory with a directory of the bus.
fn runtime_dir() -> TempDir {
    let runtime_dir = tempfile::Builder::new().prefix("bd").tempdir_in("/tmp").expect("a folder");
    fs::create_dir(runtime_dir.path().join("bench-dragon")).expect("a folder");
    runtime_dir
}

fn assert_refused(runtime_dir: &Path, why: &str) {
    assert_ended(1, runtime_dir, why);
}

fn assert_ended(code: i32, runtime_dir: &Path, why: &str) {
    for args in [&["serve"][..], &["ctl", "pause"], &["echo"], &["monitor"]] {
        let Ended { status, stderr, .. } = run_in(runtime_dir, args);
        assert_eq!((status.code(), stderr.lines().count()), (Some(code), 1), "{args:?}: {stderr}");
        assert!(stderr.contains(why), "{args:?}: {stderr}");
    }
}

#[test]
fn a_directory_that_others_may_write_is_refused() {
    let runtime_dir = runtime_dir();
    let bus = runtime_dir.path().join("bench-dragon");
    for mode in [0o777, 0o770, 0o702] {
        fs::set_permissions(&bus, Permissions::from_mode(mode)).expect("this user owns it");
        let why = format!("{} has mode {mode:04o}, must not be writable by others: chmod 0700 it", bus.display());
        assert_refused(runtime_dir.path(), &why);
    }
    assert_eq!(fs::read_dir(&bus).expect("a folder").count(), 0, "nothing was created in the directory");
}

#[test]
fn a_directory_of_another_user_is_refused() {
    const ANOTHER_USER: u32 = 12_345;
    let runtime_dir = runtime_dir();
    let bus = runtime_dir.path().join("bench-dragon");
    if chown(&bus, Some(ANOTHER_USER), None).is_err() {
        // Only root may give a directory away. Other users test a directory that belongs to the system.
        return assert_not_usable_for_us();
    }
    fs::set_permissions(&bus, Permissions::from_mode(0o700)).expect("root may do this");
    assert_refused(
        runtime_dir.path(),
        &format!("{} belongs to user {ANOTHER_USER}, must belong to user 0", bus.display()),
    );
}

/// `/proc/1` belongs to another user, and nothing can be created in it.
fn assert_not_usable_for_us() {
    let ended = run_in(Path::new("/proc/1"), &["serve"]);
    assert_eq!((ended.code(), ended.stderr.lines().count()), (Some(1), 1), "{}", ended.stderr);
}

#[test]
fn a_link_in_place_of_the_directory_is_refused() {
    let runtime_dir = tempfile::Builder::new().prefix("bd").tempdir_in("/tmp").expect("a folder");
    let elsewhere = runtime_dir.path().join("elsewhere");
    fs::create_dir(&elsewhere).expect("a folder");
    std::os::unix::fs::symlink(&elsewhere, runtime_dir.path().join("bench-dragon")).expect("a link");
    assert_refused(runtime_dir.path(), "is not a directory: remove it");
}

#[test]
fn a_directory_with_a_relative_long_or_non_ascii_path_is_bad_input() {
    let long = format!("/tmp/{}", "d".repeat(60));
    for path in ["relative", &long, "/tmp/\u{fc}", "/tmp/\"", "/tmp/*", "/tmp/\u{1b}[31m", "/tmp/\n"] {
        assert_ended(
            2,
            Path::new(path),
            "must be absolute, under 60 bytes and of printable ASCII characters but <>\"|?*: \
             set XDG_RUNTIME_DIR to another path or unset it",
        );
    }
}

#[test]
fn the_directory_is_private_and_is_removed_at_the_end() {
    let runtime_dir = runtime_dir();
    let bus = runtime_dir.path().join("bench-dragon");
    fs::remove_dir(&bus).expect("an empty folder");
    let name = format!("directory-{}", std::process::id());
    // iceoryx2 sets this strict umask for an instant, and a process that is started then inherits it.
    let mut command = Command::new("sh");
    command.args(["-c", "umask 0177; exec \"$0\" serve --format json --instance \"$1\""]);
    command.args([env!("CARGO_BIN_EXE_bench-dragon"), &name]);
    command.env_remove("RUST_LOG").env("XDG_RUNTIME_DIR", runtime_dir.path());
    let mut server = Process::start(command);
    server.json();
    for made in [bus.clone(), bus.join(&name)] {
        assert_eq!(fs::metadata(&made).expect("a folder").mode() & 0o7777, 0o700, "{}", made.display());
    }
    let shared = fs::read_dir("/dev/shm").expect("a folder").flatten();
    let is_of_frames = |file: &str| file.contains(&format!("_{name}_")) && file.contains(".data");
    let segments: Vec<_> = shared.filter(|entry| is_of_frames(&entry.file_name().to_string_lossy())).collect();
    assert!(!segments.is_empty(), "the frames are in shared memory");
    for segment in segments {
        let mode = segment.metadata().expect("a server runs").mode();
        assert_eq!(mode & 0o077, 0, "{:?} is open to others", segment.path());
    }
    server.terminate().expect_clean();
    assert!(!bus.join(&name).exists());
}

#[test]
fn iox2_config_prints_the_root_path_and_the_prefix_of_the_instance() {
    let stage = Stage::new();
    let printed = stage.run(&["iox2-config"]).expect_clean().stdout;
    assert_eq!(printed, stage.domain().iceoryx2_toml());
}

#[test]
fn no_file_of_an_instance_is_open_to_other_users() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    let reader = FrameSubscriber::open(stage.domain(), "test").expect("a server has created the services");
    let shared: Vec<_> = stage.remains().into_iter().filter(|path| path.starts_with("/dev/shm")).collect();
    assert!(shared.len() > 10, "{shared:?}");
    for path in shared {
        let mode = fs::metadata(&path).expect("the server keeps it").mode() & 0o777;
        assert_eq!(mode & 0o077, 0, "{} has mode {mode:04o}", path.display());
    }
    drop(reader);
    server.stop();
}

#[test]
fn the_folder_of_a_show_is_private_under_any_umask() {
    let stage = Stage::new();
    for umask in ["000", "022", "077"] {
        let show = stage.command(&["show", "--rate", "50", "--until", "0.2", "--out", umask]);
        let mut command = Command::new("sh");
        command
            .args(["-c", &format!("umask {umask}; exec \"$@\""), "sh"])
            .arg(show.get_program())
            .args(show.get_args());
        command.current_dir(stage.path(""));
        Process::start(command).end().expect_clean();
        let mode = fs::metadata(stage.path(umask)).expect("a folder").mode() & 0o777;
        assert_eq!(mode, 0o700, "umask {umask}");
    }
}
