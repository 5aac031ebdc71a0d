//! Unfinished recordings of killed recorders: a show finishes them, and does not wait for them.

use std::fs::{self, File};
use std::path::PathBuf;
use std::sync::mpsc;
use std::thread;

use rustix::process::Signal;
use test_support::children::{await_child, kill};
use test_support::eventually::eventually;

use crate::record;
use crate::show::{CALM, Playing};
use crate::stage::Stage;

/// Takes the lock of a recording when its recorder releases it, so that no process can finish the file until `release` is
/// dropped.
fn lock_after_recorder(file: File) -> (mpsc::Receiver<()>, mpsc::Sender<()>) {
    let (locked, is_locked) = mpsc::channel();
    let (release, released) = mpsc::channel::<()>();
    thread::spawn(move || {
        file.lock().expect("the lock can be taken");
        // The send fails if the test has failed.
        let _ = locked.send(());
        let _ = released.recv();
    });
    (is_locked, release)
}

#[test]
fn a_killed_server_and_recorder_are_restarted_while_the_file_is_unfinished() {
    let playing = Playing::start(&["--auto-resume"]);
    let pid = playing.show.pid();
    let (mut server, mut recorder) = (await_child(pid, "serve", None), await_child(pid, "record", None));
    // The show and this test race for the lock of the file. If the show wins, the test tries the next file.
    for number in 1..=4 {
        let name = |number: u32| if number == 1 { String::new() } else { format!("-{number}") };
        let path = |number| playing.stage.path(&format!("out/recording{}.mcap", name(number)));
        record::await_frames(&path(number));
        let (is_locked, release) = lock_after_recorder(File::open(path(number)).expect("a recording"));
        kill(recorder);
        kill(server);
        is_locked.recv().expect("the lock is taken after the recorder's end");
        let is_pending = record::read(&path(number)).1;
        server = await_child(pid, "serve", Some(server));
        recorder = await_child(pid, "record", Some(recorder));
        // The new recorder records the new server.
        record::await_frames(&path(number + 1));
        if is_pending {
            assert!(record::read(&path(number)).1, "both were restarted while the file is unfinished");
            drop(release);
            break;
        }
        assert!(number < 4, "the show has finished {number} files before they could be locked");
    }
    // The counts balance: the frames of the unfinished file are counted.
    let (summary, ended) = playing.interrupt();
    assert!(summary["restarts"]["record"].as_u64() >= Some(1), "{summary}");
    assert!(ended.stderr.contains("finished out/recording.mcap, which a killed recorder left:"), "{}", ended.stderr);
}

/// Leaves the unfinished recording of a show, its recorder and all other processes killed. Returns its path.
fn leave_unfinished(stage: &Stage, out: &str) -> PathBuf {
    let show = stage.start(&[&CALM[..], &["json", "--out", out]].concat());
    let recording = stage.path(&format!("{out}/recording.mcap"));
    let recorder = await_child(show.pid(), "record", None);
    record::await_frames(&recording);
    // In this order of kills, neither the recorder nor the show finishes the file.
    rustix::process::kill_process(pid(show.pid()), Signal::STOP).expect("the process runs");
    kill(recorder);
    show.kill();
    assert!(record::read(&recording).1);
    recording
}

#[test]
fn a_playing_show_finishes_the_recording_of_an_earlier_one() {
    let stage = Stage::new();
    let earlier = leave_unfinished(&stage, "show-earlier");
    let show = stage.start(&[&CALM[..], &["json", "--out", "out"]].concat());
    eventually("the earlier recording is finished", || (!record::read(&earlier).1).then_some(()));
    // The show itself has begun before that.
    record::await_frames(&stage.path("out/recording.mcap"));
    show.signal(Signal::INT);
    let ended = show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let finished = "finished ./show-earlier/recording.mcap, which a killed recorder left:";
    assert!(ended.stderr.contains(finished), "{}", ended.stderr);
    assert_eq!(ended.last_json()["frames"]["missed_by_recorder"], 0, "the earlier show's frames are not counted");
}

#[test]
fn an_earlier_recording_that_another_process_has_open_is_finished_once_it_is_closed() {
    let stage = Stage::new();
    let open = leave_unfinished(&stage, "show-earlier-1");
    let closed = stage.path("show-earlier-2/recording.mcap");
    fs::create_dir(stage.path("show-earlier-2")).expect("the folder is writable");
    fs::copy(&open, &closed).expect("the folder is writable");
    let is_open = File::open(&open).expect("the recording");
    let show = stage.start(&[&CALM[..], &["json", "--out", "out"]].concat());
    // The show looks through the folders in the order of their names.
    eventually("the second recording is finished", || (!record::read(&closed).1).then_some(()));
    assert!(record::read(&open).1, "this test has the file open");
    drop(is_open);
    eventually("the first recording is finished", || (!record::read(&open).1).then_some(()));
    show.signal(Signal::INT);
    let ended = show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
}

fn pid(process: u32) -> rustix::process::Pid {
    rustix::process::Pid::from_raw(process.cast_signed()).expect("a process id is not 0")
}
