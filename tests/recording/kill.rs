//! A recorder that is killed. The recorder runs in a process of its own: this test program, started again.

use std::{
    env,
    ffi::OsStr,
    io::{self, Write},
    path::Path,
    process::Command,
};

use bench_dragon::record::{Recorder, repair};
use tempfile::tempdir;

use crate::{
    dance::{self, BENCHES},
    eventually::eventually,
    process::Process,
};

/// Tells a test that plays a recording process where to record.
pub(crate) const FOLDER: &str = "BENCH_DRAGON_TEST_FOLDER";
const FLUSHED: &str = "every frame is with the operating system";
const FRAMES: u64 = 150;

/// The arguments that make this program run one ignored test and nothing else.
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
    writeln!(io::stderr(), "{FLUSHED}").expect("a listening test");
    loop {
        std::thread::park();
    }
}

fn start_recording(folder: &OsStr) -> Process {
    let mut command = Command::new(env::current_exe().expect("this program"));
    command.args(arguments("kill::recording_process")).env(FOLDER, folder);
    Process::start(command)
}

#[test]
fn frames_reach_the_file_without_further_frames_and_outlive_a_kill() {
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
