//! The instants that bridges send with poses, and what they send after a server was killed.

use std::collections::BTreeSet;
use std::net::UdpSocket;

use bench_dragon_ipc::FrameHeader;
use rosc::{OscBundle, OscPacket, OscTime, OscType, decoder};
use serde_json::Value;

use crate::first_tracker::{FirstTracker, receiver, wait_for};
use crate::reader::{Reader, Shot};
use crate::server::Server;
use crate::stage::Stage;
use crate::suspended::suspend_during;

/// Period of the servers below.
const PERIOD_NS: u64 = 50_000_000;
/// A late frame is later than this. A bridge reports the server as silent after 0.3 s.
const LATE_NS: u64 = 200_000_000;
/// Greatest number of packets of a show: those of a minute.
const MAX_PACKETS: usize = 40_000;

/// Starts a server of 20 frames a second, which a reader inside the test has joined. The bus keeps ten seconds for it.
fn serve(stage: &Stage) -> (Server, Reader) {
    let server = stage.serve(&["--rate", "20", "--catch-up", "10", "--readers", "1"]);
    let reader = Reader::join(stage);
    (server, reader)
}

/// Stops the server until its bridge reports it as silent, and until the frame that is due next is late. `await_silence` waits for the
/// report.
fn make_late(server: &Server, await_silence: impl FnOnce()) {
    suspend_during(&server.process, LATE_NS + 2 * PERIOD_NS, await_silence);
}

fn assert_one_is_late(shots: &[Shot]) {
    let lateness_ns = |FrameHeader { scheduled_ns, published_ns, .. }: FrameHeader| published_ns - scheduled_ns;
    assert!(shots.iter().any(|shot| lateness_ns(shot.header) > LATE_NS), "the server was late");
}

fn epoch_ns(started: &Value) -> u64 {
    started["epoch_ns"].as_u64().expect("the bridge's clock has a beginning")
}

#[test]
fn trackers_of_a_late_server_have_the_instants_that_their_poses_are_for() {
    let stage = Stage::new();
    let (socket, target) = receiver();
    let (server, mut reader) = serve(&stage);
    let mut bridge = stage.start(&["bridge", "psn", "--to", &target, "--rate", "250", "--format", "json"]);
    let epoch_ns = epoch_ns(&bridge.json());
    let (mut shots, mut times_us) = (Vec::new(), BTreeSet::new());
    for _ in 0..4 {
        let mut collect = |status: f32| {
            wait_for(&socket, |tracker| {
                // A frame from before the start of the bridge has the time 0.
                times_us.extend((tracker.time_us > 0).then_some(tracker.time_us));
                tracker.status == status
            });
        };
        collect(1.0);
        make_late(&server, || collect(0.0));
        collect(1.0);
        shots.extend(reader.read_unread());
    }
    bridge.terminate().expect_clean();
    server.stop();
    shots.extend(reader.read_unread());
    assert_one_is_late(&shots);
    let due_us: BTreeSet<u64> =
        shots.iter().filter_map(|shot| Some(shot.header.scheduled_ns.checked_sub(epoch_ns)? / 1_000)).collect();
    assert!(times_us.is_subset(&due_us), "{:?}", times_us.difference(&due_us));
    for pair in times_us.iter().collect::<Vec<_>>().windows(2) {
        assert_eq!((pair[1] - pair[0]) % (PERIOD_NS / 1_000), 0, "{pair:?}: whole periods apart");
    }
}

/// Waits for a bundle. Returns its time, the fresh flag of its show, and the speed of its first bench, if it begins a frame.
fn next_frame(socket: &UdpSocket) -> Option<(OscTime, i32, f32)> {
    let mut packet = [0; 1_500];
    let len = socket.recv(&mut packet).expect("the bridge continues to send");
    let (_, decoded) = decoder::decode_udp(&packet[..len]).expect("a packet of OSC");
    let OscPacket::Bundle(OscBundle { timetag, content }) = decoded else { panic!("a bundle, not {decoded:?}") };
    let [OscPacket::Message(show), OscPacket::Message(bench), ..] = content.as_slice() else { return None };
    let (Some(OscType::Int(fresh)), Some(OscType::Float(speed))) = (show.args.last(), bench.args.last()) else {
        return None;
    };
    Some((timetag, *fresh, *speed))
}

/// Waits for a frame with this fresh flag. Returns the times of the frames up to it, and its speed.
fn osc_until(socket: &UdpSocket, fresh: i32) -> (Vec<OscTime>, f32) {
    let mut times = Vec::new();
    for _ in 0..MAX_PACKETS {
        let Some((time, is_fresh, speed)) = next_frame(socket) else { continue };
        times.push(time);
        if is_fresh == fresh {
            return (times, speed);
        }
    }
    panic!("waited {MAX_PACKETS} packets for the fresh flag {fresh}")
}

#[test]
fn bundles_of_a_late_server_have_the_instants_that_their_poses_are_for() {
    /// Greatest error of the mapping to the wall clock: that of reading two clocks one after the other.
    const MAX_ERROR_NS: u64 = 100_000;
    let stage = Stage::new();
    let (socket, target) = receiver();
    let (server, mut reader) = serve(&stage);
    let bridge = stage.start(&[
        "bridge",
        "osc",
        "--bundle",
        "--to",
        &target,
        "--rate",
        "250",
        "--benches",
        "0",
        "--format",
        "json",
    ]);
    let (mut shots, mut times) = (Vec::new(), Vec::new());
    for _ in 0..4 {
        let mut collect = |fresh| times.extend(osc_until(&socket, fresh).0);
        collect(1);
        make_late(&server, || collect(0));
        collect(1);
        shots.extend(reader.read_unread());
    }
    bridge.terminate().expect_clean();
    server.stop();
    shots.extend(reader.read_unread());
    assert_one_is_late(&shots);
    let ns =
        |time: &OscTime| u64::from(time.seconds) * 1_000_000_000 + ((u64::from(time.fractional) * 1_000_000_000) >> 32);
    for time in &times {
        let apart_ns = (ns(time) - ns(&times[0])) % PERIOD_NS;
        assert!(apart_ns.min(PERIOD_NS - apart_ns) < MAX_ERROR_NS, "{time:?}: {apart_ns} ns beside a whole period");
    }
}

#[test]
fn trackers_of_a_killed_server_are_stale_after_the_chosen_time() {
    let cases: [(&[&str], u64); 2] = [(&[], 300_000_000), (&["--stale-after", "0.8"], 800_000_000)];
    for (flags, limit_ns) in cases {
        let stage = Stage::new();
        let (socket, target) = receiver();
        let (server, mut reader) = serve(&stage);
        let args = ["bridge", "psn", "--to", &target, "--rate", "250", "--format", "json"];
        let mut bridge = stage.start(&[&args[..], flags].concat());
        let epoch_ns = epoch_ns(&bridge.json());
        // The bridge knows the period from the second frame on.
        let first = wait_for(&socket, |tracker| tracker.time_us > 0);
        wait_for(&socket, |tracker| tracker.status == 1.0 && tracker.time_us > first.time_us);
        server.process.kill();
        let last = reader.read_unread().pop().expect("frames").header;
        let last_us = (last.scheduled_ns - epoch_ns) / 1_000;
        // Ages are of the last frame, from its sending. Both clocks of the packet are rounded down to a microsecond.
        let age_ns = |tracker: &FirstTracker| epoch_ns + tracker.sent_us * 1_000 - last.published_ns;
        let mut oldest_fresh_ns = None;
        let stale = wait_for(&socket, |tracker| {
            if tracker.time_us == last_us && tracker.status == 1.0 {
                oldest_fresh_ns = Some(age_ns(tracker));
            }
            tracker.time_us == last_us && tracker.status == 0.0
        });
        assert_eq!(stale.speed, [0.0; 3]);
        assert!(age_ns(&stale) + 1_000 > limit_ns, "{} ns", age_ns(&stale));
        assert!(oldest_fresh_ns.is_none_or(|age_ns| age_ns <= limit_ns), "{oldest_fresh_ns:?}");
        bridge.terminate().expect_clean();
    }
}

#[test]
fn the_show_of_a_killed_server_is_not_fresh_and_its_benches_stand() {
    let stage = Stage::new();
    let (socket, target) = receiver();
    let (server, _reader) = serve(&stage);
    let bridge = stage.start(&["bridge", "osc", "--bundle", "--to", &target, "--benches", "0", "--format", "json"]);
    assert!(osc_until(&socket, 1).1 > 0.5);
    server.process.kill();
    assert_eq!(osc_until(&socket, 0).1, 0.0);
    bridge.terminate().expect_clean();
}

#[test]
fn the_slowest_server_is_never_stale_between_two_frames() {
    let stage = Stage::new();
    let (socket, target) = receiver();
    let server = stage.serve(&["--rate", "1", "--readers", "0"]);
    let args = ["bridge", "psn", "--to", &target, "--rate", "50", "--stale-after", "0.05", "--format", "json"];
    let bridge = stage.start(&args);
    wait_for(&socket, |tracker| tracker.time_us > 0);
    let mut times_us = BTreeSet::new();
    wait_for(&socket, |tracker| {
        assert_eq!(tracker.status, 1.0, "{tracker:?}");
        times_us.insert(tracker.time_us);
        times_us.len() == 4
    });
    bridge.terminate().expect_clean();
    server.stop();
}
