//! A killed recorder. It runs in its own process: this test program, started again.

use std::{
    env,
    ffi::OsStr,
    fs,
    io::{self, Write},
    os::unix::process::ExitStatusExt as _,
    path::Path,
    process::{Command, Stdio},
};

use bench_dragon::recording::{Recorder, repair};
use tempfile::tempdir;
use test_support::eventually::eventually;
use test_support::process::Process;
use test_support::skip::is_possible;

use crate::dance::{self, BENCHES};

/// Environment variable with the folder for a recording process.
pub(crate) const FOLDER: &str = "BENCH_DRAGON_TEST_FOLDER";
const FLUSHED: &str = "every frame is with the operating system";
const FRAMES: u64 = 150;

/// Returns the arguments that make this program run one ignored test only.
pub(crate) fn arguments(test: &str) -> [&str; 4] {
    [test, "--exact", "--ignored", "--nocapture"]
}

#[test]
#[ignore = "the process that the next test kills"]
fn recording_process() {
    let folder = env::var_os(FOLDER).expect("a folder from the test that starts this process");
    let mut recorder = Recorder::start(dance::settings(Path::new(&folder))).expect("a recorder");
    for dance::Frame { header, handles } in dance::frames(FRAMES, BENCHES) {
        recorder.frame(&header, &handles).expect("a frame");
    }
    eventually("every frame is written", || (recorder.progress().frames == FRAMES).then_some(()));
    writeln!(io::stderr(), "{FLUSHED}").expect("stderr is open");
    loop {
        std::thread::park();
    }
}

fn start_recording(folder: &OsStr) -> Process {
    let mut command = Command::new(env::current_exe().expect("the path of this program"));
    command.args(arguments("kill::recording_process")).env(FOLDER, folder);
    Process::start(command)
}

#[test]
fn written_frames_outlive_a_kill_of_their_recorder() {
    let folder = tempdir().expect("a folder");
    let recording = start_recording(folder.path().as_os_str());
    recording.complaint_with(FLUSHED);
    recording.kill();

    let path = folder.path().join("show.mcap");
    let (recorded, was_cut) = dance::read(&path);
    assert!(was_cut);
    dance::assert_same(&recorded, &dance::frames(FRAMES, BENCHES));
    assert_eq!(repair(&path).expect("a repair").frames, FRAMES);
    assert!(dance::summary(&path).is_some(), "an index");
}

#[test]
#[ignore = "the process that the next test has killed"]
fn repairing_process() {
    let folder = env::var_os(FOLDER).expect("a folder from the test that starts this process");
    repair(&Path::new(&folder).join("show.mcap")).expect("a repair");
}

#[test]
fn a_repair_that_is_killed_at_some_byte_loses_nothing_and_is_repeated() {
    const KILLS: u64 = 40;
    if !is_possible(&["prlimit", "--fsize=100", "--core=0"]) {
        return;
    }
    let folder = tempdir().expect("a folder");
    let frames = dance::frames(FRAMES, BENCHES);
    let path = dance::record(dance::settings(folder.path()), &frames);
    let finished = fs::read(&path).expect("the recording");
    let data_end = mcap::read::footer(&finished).expect("a footer").summary_start - 13;
    let mut killed = 0;
    for kill in 0..KILLS {
        fs::write(&path, &finished[..data_end as usize]).expect("an unfinished recording");
        // The limits are spread over all written bytes, and one is after the last byte. A write beyond the limit kills a
        // process that does not ignore the signal.
        let at = data_end + (finished.len() as u64 - data_end) * kill / (KILLS - 1);
        let status = Command::new("prlimit")
            .args([format!("--fsize={at}"), "--core=0".to_owned()])
            .arg(env::current_exe().expect("the path of this program"))
            .args(arguments("kill::repairing_process"))
            .env(FOLDER, folder.path())
            .stdout(Stdio::null())
            .status()
            .expect("prlimit is installed with util-linux");
        if at < finished.len() as u64 {
            assert!(status.signal().is_some(), "byte {at}: {status}");
            let length = fs::metadata(&path).expect("the recording").len();
            assert_eq!(length, at, "the limit ended the write");
            killed += 1;
        }
        dance::assert_same(&dance::read(&path).0, &frames);
        let repaired = repair(&path).expect("a repair");
        assert_eq!((repaired.frames, repaired.was_unfinished), (FRAMES, at < finished.len() as u64), "byte {at}");
        dance::assert_same(&dance::read(&path).0, &frames);
        assert_eq!(
            dance::summary(&path).and_then(|summary| summary.stats).map(|stats| stats.message_count > FRAMES),
            Some(true)
        );
    }
    assert_eq!(killed, KILLS - 1);
}
