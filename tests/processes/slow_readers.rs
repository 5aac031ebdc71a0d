//! Readers that are stopped, hold their frames, or join and leave: each loses only its own frames, and counts them.

use bench_dragon::recording::FrameReader;
use bench_dragon::system::clock::monotonic_ns;
use bench_dragon_ipc::service::{MAX_BORROWED_FRAMES, frame_buffer};
use bench_dragon_ipc::{FrameSubscriber, HandleState};
use rustix::process::Signal;
use serde_json::Value;
use test_support::eventually::eventually;
use test_support::process::Process;

use crate::reader::{Reader, Shot, assert_whole};
use crate::server::Server;
use crate::stage::Stage;

const RATE_HZ: usize = 50;
const PAPER_BENCHES: usize = 223;

/// Starts a server without an end, which begins once this many readers are connected.
fn serve(stage: &Stage, rate_hz: usize, readers: usize) -> Server {
    stage.serve(&["--rate", &rate_hz.to_string(), "--readers", &readers.to_string()])
}

/// Reads on until the server has published more frames than the buffer of a reader that reads nothing holds.
fn read_beyond_a_buffer(witness: &mut Reader, shots: &mut Vec<Shot>) {
    let tick = shots.last().expect("the witness has read a frame").header.tick;
    shots.extend(witness.read_to_tick(tick + 2 * frame_buffer(PAPER_BENCHES + 1) as u64));
}

/// Stops a server and fails unless the witness has read all its frames: one in each period that the server did not miss.
fn stop_and_assert_steady(server: Server, rate_hz: usize, witness: &mut Reader, shots: &mut Vec<Shot>) {
    let run_id = server.run_id;
    let summary = server.stop();
    let ended_ns = monotonic_ns();
    shots.extend(witness.read_unread());
    assert_whole(shots, run_id);
    assert_eq!((&summary["frames"], witness.lost()), (&Value::from(shots.len()), 0), "no other reader lost a frame");
    let [first_ns, last_ns] = [0, shots.len() - 1].map(|index| shots[index].header.scheduled_ns);
    // The server may have missed more periods after its last frame, up to its end.
    let [skipped, most] = [last_ns, ended_ns].map(|until_ns| periods(first_ns, until_ns, rate_hz) - shots.len());
    let overruns = summary["overruns"].as_u64().expect("a number") as usize;
    assert!((skipped..=most).contains(&overruns), "{overruns} overruns, not from {skipped} to {most}");
}

/// Number of periods from one instant to another, both included.
fn periods(first_ns: u64, last_ns: u64, rate_hz: usize) -> usize {
    ((last_ns - first_ns) as f64 * rate_hz as f64 / 1e9).round() as usize + 1
}

#[test]
fn only_a_stopped_reader_loses_frames_and_it_counts_them() {
    let stage = Stage::new();
    let server = serve(&stage, RATE_HZ, 3);
    let mut monitor = stage.start(&["monitor", "--format", "json", "--progress", "0.01"]);
    let recorder = stage.start(&["record", "a.mcap", "--format", "json"]);
    let mut witness = Reader::join(&stage);
    let mut shots = vec![witness.next()];
    // From here on, both have read tick 0.
    monitor.json_until("the monitor has read a frame", |line| line["frames"].as_u64() > Some(0));
    let path = stage.path("a.mcap");
    eventually("the recording has a frame", || {
        shots.extend(witness.read_unread());
        FrameReader::open(&path).ok()?.next()?.ok()
    });
    let stopped = [monitor, recorder];
    for process in &stopped {
        process.signal(Signal::STOP);
    }
    read_beyond_a_buffer(&mut witness, &mut shots);
    stop_and_assert_steady(server, RATE_HZ, &mut witness, &mut shots);
    for process in stopped {
        process.signal(Signal::CONT);
        let account = process.terminate().expect_clean().last_json();
        let [read, lost] = ["frames", "lost"].map(|name| account[name].as_u64().expect("a number") as usize);
        assert_eq!(read + lost, shots.len(), "read and lost frames are all frames: {account}");
        assert!(lost > 0, "the show was longer than its buffer");
    }
}

#[test]
fn a_reader_that_holds_frames_keeps_them_unchanged_and_counts_its_losses() {
    let stage = Stage::new();
    let server = serve(&stage, RATE_HZ, 2);
    let mut holder = FrameSubscriber::open(stage.domain(), "holder").expect("a server has created the services");
    let mut witness = Reader::join(&stage);
    let mut shots = vec![];
    let mut held = vec![];
    while held.len() < MAX_BORROWED_FRAMES {
        shots.push(witness.next());
        held.extend(holder.receive().expect("the bus is readable"));
    }
    read_beyond_a_buffer(&mut witness, &mut shots);
    for (frame, shot) in held.iter().zip(&shots) {
        assert_eq!((frame.header(), bits(frame.handles())), (&shot.header, bits(&shot.handles)));
    }
    stop_and_assert_steady(server, RATE_HZ, &mut witness, &mut shots);
    let mut read = held.len();
    drop(held);
    while holder.receive().expect("the bus is readable").is_some() {
        read += 1;
    }
    assert_eq!(read as u64 + holder.lost(), shots.len() as u64);
    assert!(holder.lost() > 0, "the show was longer than its buffer");
}

fn bits(handles: &[HandleState]) -> Vec<u64> {
    handles.iter().flat_map(|handle| [handle.position_m, handle.velocity_mps]).flatten().map(f64::to_bits).collect()
}

#[test]
fn sixteen_readers_join_and_leave_and_no_other_reader_loses_a_frame() {
    const READERS: usize = 16;
    // At this rate the bus keeps ten seconds for the witness, which does not read while a reader ends.
    const CALM_HZ: usize = 20;
    let stage = Stage::new();
    let server = serve(&stage, CALM_HZ, 1);
    let mut witness = Reader::join(&stage);
    let mut shots = vec![witness.next()];
    for wave in 0..3 {
        let readers: Vec<Process> = (0..READERS)
            .map(|_| {
                shots.extend(witness.read_unread());
                stage.start(&["echo", "--count", "10", "--format", "json"])
            })
            .collect();
        for (number, mut reader) in readers.into_iter().enumerate() {
            if (number + wave) % 4 == 0 {
                // The reader is killed after it has joined.
                reader.json();
                reader.kill();
            } else {
                // The reader may report that it has removed the remains of a killed one.
                let ended = reader.end();
                assert_eq!((ended.code(), ended.json_lines().len()), (Some(0), 10), "{}", ended.stderr);
            }
            shots.extend(witness.read_unread());
        }
    }
    stop_and_assert_steady(server, CALM_HZ, &mut witness, &mut shots);
}
