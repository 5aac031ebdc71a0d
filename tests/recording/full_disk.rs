//! A disk or a file that cannot grow. Only the recorder's own process has the limit.

use std::{
    env, fs,
    io::{self, Write as _},
    path::{Path, PathBuf},
    process::Command,
};

use bench_dragon::recording::{Kept, RecordError, Recorder, RepairError, repair};
use tempfile::tempdir;
use test_support::process::Process;
use test_support::skip::is_possible;

use crate::dance::{self, BENCHES};
use crate::kill::{FOLDER, arguments};

/// Mounts a small disk for this process only, which vanishes with it, then runs the test program.
const ON_A_SMALL_DISK: &str = r#"mount -t tmpfs -o size=8m none "$BENCH_DRAGON_TEST_FOLDER" && exec "$@""#;
/// Limits the size of a file, then runs the test program. A write beyond the limit is cut short, the next one fails.
fn with_files_of_at_most(bytes: u64) -> String {
    format!(r#"trap "" XFSZ && ulimit -f {} && exec "$@""#, bytes / 512)
}

/// Records until an error. Returns the error and the number of frames that the recorder reported as written.
fn record_until_it_fails(folder: &Path) -> (RecordError, u64) {
    let mut recorder = Recorder::start(dance::settings(folder)).expect("a recorder");
    recorder.describe(dance::RUN_ID, dance::TOML).expect("the configuration");
    for tick in 0.. {
        let dance::Frame { header, handles } = dance::frame(tick, BENCHES);
        if let Err(error) = recorder.frame(&header, &handles) {
            let again = recorder.frame(&header, &handles).expect_err("an ended recording");
            assert!(matches!(again, RecordError::Ended), "{again}");
            return (error, recorder.progress().frames);
        }
    }
    unreachable!("a recording without an end")
}

/// Runs an ignored test below in a process that a launcher prepares.
fn run(launcher: &str, launcher_arguments: &[&str], test: &str, folder: &Path) {
    let mut command = Command::new(launcher);
    command.args(launcher_arguments).arg("sh").arg(env::current_exe().expect("the path of this program"));
    command.args(arguments(test)).env(FOLDER, folder);
    let ended = Process::start(command).end();
    assert!(ended.status.success(), "{test}: {}{}", ended.stdout, ended.stderr);
}

fn folder_from_starter() -> PathBuf {
    env::var_os(FOLDER).expect("a folder from the test that starts this process").into()
}

#[test]
#[ignore = "the process that the next test gives a small disk"]
fn process_on_a_small_disk() {
    let folder = folder_from_starter();
    let path = folder.join("show.mcap");
    let (error, frames) = record_until_it_fails(&folder);
    let text = error.to_string();
    assert!(text.contains("the disk is full") && text.contains(path.to_str().expect("the path is UTF-8")), "{text}");
    assert!(matches!(error, RecordError::DiskFull { kept: Kept::Finished, .. }), "{error:?}");
    let (recorded, was_cut) = dance::read(&path);
    assert!(!was_cut && dance::summary(&path).is_some(), "a finished file");
    dance::assert_same(&recorded, &dance::frames(frames, BENCHES));
    assert!(frames > 500, "most of the disk was used: {frames} frames");
}

#[test]
#[ignore = "the process that a test below gives a small disk"]
fn process_that_repairs_on_a_full_disk() {
    let folder = folder_from_starter();
    let frames = dance::frames(100, BENCHES);
    let path = dance::record(dance::settings(&folder), &frames);
    let finished = fs::read(&path).expect("the recording");
    let summary_start = mcap::read::footer(&finished).expect("a footer").summary_start as usize;
    // The index needs more room than the file's last page has, and its end is missing.
    fs::write(&path, &finished[..summary_start + 40]).expect("an unfinished recording");
    let unfinished = fs::read(&path).expect("the recording");
    let mut filler = fs::File::create(folder.join("filler")).expect("a file");
    let full = (0..).find_map(|_| filler.write_all(&[1; 4096]).err()).expect("a small disk");
    assert_eq!(full.kind(), io::ErrorKind::StorageFull);
    for _ in 0..2 {
        let error = repair(&path).expect_err("a full disk");
        assert!(matches!(error, RepairError::DiskFull { .. }), "{error:?}");
        let text = error.to_string();
        assert!(
            text.contains("the disk is full") && text.contains(path.to_str().expect("the path is UTF-8")),
            "{text}"
        );
        assert!(fs::read(&path).expect("the recording") == unfinished, "it is as it was");
    }
    // An open file keeps its space.
    drop(filler);
    fs::remove_file(folder.join("filler")).expect("the filler");
    assert_eq!(repair(&path).expect("a repair").frames, 100);
    dance::assert_same(&dance::read(&path).0, &frames);
}

#[test]
fn a_repair_on_a_full_disk_is_a_clear_error_changes_nothing_and_can_be_repeated() {
    on_a_small_disk("full_disk::process_that_repairs_on_a_full_disk");
}

#[test]
fn a_full_disk_is_a_clear_error_and_leaves_a_finished_file() {
    on_a_small_disk("full_disk::process_on_a_small_disk");
}

/// Runs an ignored test of this file on its own disk.
fn on_a_small_disk(test: &str) {
    let folder = tempdir().expect("a folder");
    let own_mounts = ["--user", "--map-root-user", "--mount"];
    let trial =
        [&["unshare"], &own_mounts[..], &["sh", "-c", "mount -t tmpfs none /mnt && exec \"$@\"", "sh"]].concat();
    if !is_possible(&trial) {
        return;
    }
    let arguments = [&own_mounts[..], &["sh", "-c", ON_A_SMALL_DISK]].concat();
    run("unshare", &arguments, test, folder.path());
    assert!(folder.path().read_dir().expect("a folder").next().is_none(), "the disk vanished with its process");
}

#[test]
#[ignore = "the process that the next test gives a limit"]
fn process_with_a_small_file() {
    let folder = folder_from_starter();
    let path = folder.join("show.mcap");
    let (error, frames) = record_until_it_fails(&folder);
    assert!(matches!(error, RecordError::Write { kept: Kept::Unfinished, .. }), "{error:?}");
    assert!(error.to_string().contains(path.to_str().expect("the path is UTF-8")), "{error}");
    dance::assert_same(&dance::read(&path).0, &dance::frames(frames, BENCHES));
}

#[test]
fn a_failed_write_leaves_every_whole_chunk_and_repair_finishes_the_file() {
    let folder = tempdir().expect("a folder");
    run("sh", &["-c", &with_files_of_at_most(5_000_000)], "full_disk::process_with_a_small_file", folder.path());
    let path = folder.path().join("show.mcap");
    let frames = dance::read(&path).0.len() as u64;
    assert!(frames > 200, "several chunks were written: {frames} frames");
    let repaired = repair(&path).expect("a repair");
    assert_eq!((repaired.frames, repaired.was_unfinished), (frames, true));
    dance::assert_same(&dance::read(&path).0, &dance::frames(frames, BENCHES));
}

#[test]
#[ignore = "the process that the next test gives a limit"]
fn process_without_room_for_the_summary() {
    let folder = folder_from_starter();
    let mut recorder = Recorder::start(dance::settings(&folder)).expect("a recorder");
    recorder.describe(dance::RUN_ID, dance::TOML).expect("the configuration");
    for dance::Frame { header, handles } in dance::frames(3, BENCHES) {
        recorder.frame(&header, &handles).expect("a frame");
    }
    let error = recorder.finish().expect_err("a summary that does not fit");
    assert!(matches!(error, RecordError::Write { kept: Kept::Unfinished, .. }), "{error:?}");
}

#[test]
fn a_summary_that_cannot_be_written_costs_no_frame() {
    let folder = tempdir().expect("a folder");
    let frames = dance::frames(3, BENCHES);
    let path = dance::record(dance::settings(folder.path()), &frames);
    let whole = fs::read(&path).expect("a recording");
    let summary_start = mcap::read::footer(&whole).expect("a footer").summary_start;
    fs::remove_file(&path).expect("a recording");

    let limit = with_files_of_at_most(summary_start + 1_024);
    run("sh", &["-c", &limit], "full_disk::process_without_room_for_the_summary", folder.path());
    dance::assert_same(&dance::read(&path).0, &frames);
    assert_eq!(repair(&path).expect("a repair").frames, 3);
}
