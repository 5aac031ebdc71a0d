//! Show time as Art-Net timecode. The receivers are the crate `artnet_protocol`, and a second show.

use std::net::UdpSocket;

use artnet_protocol::{ArtCommand, FrameType, Timecode};
use bench_dragon_ipc::{FrameHeader, ShowState};
use test_support::eventually::DEADLINE;
use test_support::process::Process;

use crate::bad_input::assert_one_error;
use crate::reader::Reader;
use crate::stage::Stage;
use crate::timecode::{event, serve};

/// A receiver of timecode, and its address.
fn receiver() -> (UdpSocket, String) {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    socket.set_read_timeout(Some(DEADLINE)).expect("a timeout");
    let address = socket.local_addr().expect("a bound socket has an address").to_string();
    (socket, address)
}

/// Receives a packet as another implementation of the protocol decodes it.
#[track_caller]
fn receive(socket: &UdpSocket) -> Timecode {
    let mut packet = [0; 1500];
    let length = socket.recv(&mut packet).expect("a packet arrives");
    assert_eq!(length, 19, "the packet has no more than its fields");
    match ArtCommand::from_buffer(&packet[..length]) {
        Ok(ArtCommand::OpTimeCode(timecode)) => timecode,
        other => panic!("no timecode: {other:?}"),
    }
}

/// The number of a frame at 25 frames a second.
fn frame(timecode: &Timecode) -> u32 {
    assert_eq!((timecode.version, timecode.stream_id, timecode.frame_type), ([0, 14], 0, FrameType::EBU));
    let [hours, minutes, seconds, frames] =
        [timecode.hours, timecode.minutes, timecode.seconds, timecode.frames].map(u32::from);
    ((hours * 60 + minutes) * 60 + seconds) * 25 + frames
}

fn bridge(stage: &Stage, to: &str, args: &[&str]) -> Process {
    stage.start(&[&["bridge", "timecode", "--format", "json", "--art-net", to], args].concat())
}

#[test]
fn a_running_show_sends_each_frame_once_and_in_order() {
    let stage = Stage::new();
    let (socket, address) = receiver();
    let server = stage.serve(&["--rate", "50", "--start-at", "30"]);
    let mut bridge = bridge(&stage, &address, &[]);
    let started = bridge.json();
    assert_eq!(started["to"], address.as_str());
    let settings = started["settings"].as_str().expect("a text");
    assert!(settings.ends_with("25 frames a second, show time +0 s"), "{settings}");
    let frames: Vec<u32> = (0..100).map(|_| frame(&receive(&socket))).collect();
    assert!(frames[0] >= 30 * 25, "{frames:?}");
    let left_out: u32 = frames.windows(2).map(|pair| pair[1].checked_sub(pair[0] + 1).expect("the next frame")).sum();
    let summary = bridge.terminate().expect_clean().last_json();
    assert!(summary["missed"].as_u64() >= Some(u64::from(left_out)), "{left_out} frames are missing: {summary}");
    assert!(summary["frames"].as_u64() >= Some(100), "{summary}");
    server.stop();
}

#[test]
fn a_standing_show_repeats_its_frame_and_a_seek_changes_it() {
    let stage = Stage::new();
    let (socket, address) = receiver();
    let server = stage.serve(&["--rate", "50", "--start-at", "61.2", "--held"]);
    let bridge = bridge(&stage, &address, &["--offset", "3600"]);
    let expected = (3600 + 61) * 25 + 5;
    assert_eq!((0..50).map(|_| frame(&receive(&socket))).collect::<Vec<_>>(), [expected; 50]);
    stage.run(&["ctl", "seek", "90"]).expect_clean();
    while frame(&receive(&socket)) == expected {}
    assert_eq!(frame(&receive(&socket)), (3600 + 90) * 25);
    server.process.kill();
    // A silent server counts as a show that stands.
    for _ in 0..50 {
        assert_eq!(frame(&receive(&socket)), (3600 + 90) * 25);
    }
    bridge.terminate().expect_clean();
    let server = stage.serve(&["--rate", "50"]);
    server.stop();
}

#[test]
fn a_negative_show_time_is_that_of_the_day_before() {
    let stage = Stage::new();
    std::fs::write(stage.path("turn.toml"), "[route]\nkind = \"turnaround\"\n").expect("a file");
    let (socket, address) = receiver();
    let server = stage.serve(&["--config", "turn.toml", "--start-at", "-100", "--held"]);
    for (offset, clock) in [("0", [23, 58, 20]), ("3600", [0, 58, 20])] {
        let bridge = bridge(&stage, &address, &["--offset", offset]);
        // Packets of the first bridge may still wait in the socket.
        let mut timecode = receive(&socket);
        while [timecode.hours, timecode.minutes, timecode.seconds] != clock {
            timecode = receive(&socket);
        }
        assert_eq!(timecode.frames, 0);
        bridge.terminate().expect_clean();
    }
    server.stop();
}

/// Reads frames of both shows until they have agreed in 50 frames: show times of one instant differ by less than a frame of
/// timecode.
pub(crate) fn read_until_they_agree(leading: &mut Reader, following: &mut Reader) -> FrameHeader {
    let (mut agreed, mut lead) = (0, leading.next().header);
    for _ in 0..4_000 {
        let header = following.next().header;
        while lead.scheduled_ns < header.scheduled_ns {
            lead = leading.next().header;
        }
        let ahead_s = (lead.scheduled_ns - header.scheduled_ns) as f64 * 1e-9;
        let is_running = header.show_state() == Some(ShowState::Running);
        agreed += usize::from(is_running && (lead.show_time_s() - ahead_s - header.show_time_s()).abs() < 0.04);
        if agreed == 50 {
            return header;
        }
    }
    panic!("only {agreed} frames agree");
}

#[test]
fn a_second_show_follows_the_timecode_of_the_first() {
    for (rate, kind) in [("25", 1), ("29.97", 2)] {
        let [one, other] = [Stage::new(), Stage::new()];
        let (mut second, address) = serve(&other, "artnet:127.0.0.1:0", &["--timecode-timeout", "5"]);
        let first = one.serve(&["--rate", "50", "--start-at", "100"]);
        let (mut leading, mut following) = (Reader::join(&one), Reader::join(&other));
        let bridge = bridge(&one, &address, &["--rate", rate]);
        event(&mut second.process, "follows");
        let header = read_until_they_agree(&mut leading, &mut following);
        assert!(header.show_time_s() > 100.0, "type {kind}");
        one.run(&["ctl", "hold"]).expect_clean();
        event(&mut second.process, "stands");
        let held = leading.read_until("the first show is held", |header| header.show_state() == Some(ShowState::Held));
        let held_s = held.last().expect("the wanted frame").header.show_time_s();
        let what = "the second show stands where the first one does";
        following.read_until(what, |header| {
            header.show_state() == Some(ShowState::Paused) && (header.show_time_s() - held_s).abs() < 0.04
        });
        one.run(&["ctl", "seek", "200"]).expect_clean();
        one.run(&["ctl", "release"]).expect_clean();
        let header = read_until_they_agree(&mut leading, &mut following);
        assert!(header.show_time_s() > 150.0, "type {kind}: the second show follows the seek");
        bridge.terminate().expect_clean();
        first.stop();
        second.stop();
    }
}

#[test]
fn a_rate_that_art_net_does_not_have_is_refused() {
    let stage = Stage::new();
    let cases: &[(&[&str], &[&str])] = &[
        (&["--art-net", "10.0.0.255", "--rate", "29.97ndf"], &["--rate is 29.97ndf, must be 24, 25, 29.97 or 30"]),
        (
            &["--art-net", "10.0.0.255", "--rate", "60"],
            &["--rate", "'60'", "must be 24, 25, 29.97 (drop-frame), 29.97ndf or 30"],
        ),
        (&["--art-net", "house"], &["--art-net", "'house'", "must be an IPv4 address, and perhaps a port"]),
        (&["--art-net", "10.0.0.255:0"], &["--art-net", "'10.0.0.255:0'"]),
        (&[], &["--art-net"]),
    ];
    for (args, named) in cases {
        assert_one_error(&stage.run(&[&["bridge", "timecode"], *args].concat()), 2, named);
    }
}
