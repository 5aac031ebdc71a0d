//! Two buses, joined by a pair of bridges, and a reader on each.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use bench_dragon::system::clock::monotonic_ns;
use bench_dragon_ipc::{Continuity, Frame, FrameSubscriber};

use crate::cable::Cable;
use crate::shared::{Program, domain};

/// Length of one wait for a frame. Waits are repeated.
const WAIT: Duration = Duration::from_millis(5);

/// The processes of both sides, and the frames read from both buses.
#[derive(Debug)]
pub(crate) struct Joined {
    near: FrameSubscriber,
    far: FrameSubscriber,
    /// The frames of the first bus, by show time.
    sent: HashMap<i64, Sent>,
    journey: Journey,
    receiver: Program,
    _sender: Program,
    _server: Program,
}

#[derive(Clone, Copy, Debug)]
struct Sent {
    due_ns: u64,
    /// Checksum of all values, bit by bit.
    check: u64,
}

/// A frame of the second bus.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Read {
    /// When the frame was due on the first bus.
    pub(crate) due_ns: u64,
    /// When the frame was read on the second bus.
    pub(crate) read_ns: u64,
}

/// Losses and latencies of the frames.
#[derive(Debug, Default)]
pub(crate) struct Journey {
    /// Frames published on the second bus.
    pub(crate) frames: u64,
    /// Frames lost between the buses, counted by the receiving bridge.
    pub(crate) lost: u64,
    /// Frames of the second bus that this reader lost.
    pub(crate) missed: u64,
    pub(crate) runs: u64,
    pub(crate) reads: Vec<Read>,
    pub(crate) latency_ns: Vec<u64>,
}

impl Joined {
    /// Starts both bridges on this machine, connected over loopback.
    pub(crate) fn over_loopback() -> Self {
        Self::new([None, None], "tcp/127.0.0.1:0")
    }

    /// Starts one bridge at each end of a cable.
    pub(crate) fn over(cable: &Cable) -> Self {
        Self::new([Some(&cable.near), Some(&cable.far)], Cable::ENDPOINT)
    }

    fn new(namespaces: [Option<&str>; 2], endpoint: &str) -> Self {
        let (near, far) = (domain("bench-bridge-near"), domain("bench-bridge-far"));
        let start = |namespace: Option<&str>, domain, args: &[&str]| match namespace {
            Some(namespace) => Program::start_within(namespace, domain, args),
            None => Program::start(domain, args),
        };
        let mut server = Program::start(&near, &["serve", "--rate", "1000"]);
        server.until("started");
        let key = ["bridge", "zenoh", "--key", "bench/bridge"];
        let mut sender = start(namespaces[0], &near, &[&key[..], &["--listen", endpoint]].concat());
        let started = sender.until("started");
        let endpoint = started["listens"][0].as_str().expect("the bridge listens").to_owned();
        sender.until("sending");
        let receive = [&key[..], &["--receive", "--connect", &endpoint]].concat();
        let mut receiver = start(namespaces[1], &far, &receive);
        receiver.until("receiving");
        let open = |domain| FrameSubscriber::open(domain, "bench").expect("the source is running");
        Self {
            near: open(&near),
            far: open(&far),
            sent: HashMap::new(),
            journey: Journey::default(),
            receiver,
            _sender: sender,
            _server: server,
        }
    }

    /// Reads both buses for the time of a phase.
    pub(crate) fn watch_on(&mut self, phase: Duration) {
        let end = Instant::now() + phase;
        while Instant::now() < end {
            let frame = self.far.wait(WAIT).expect("the bus is readable");
            let read_ns = monotonic_ns();
            while let Some(sent) = self.near.receive().expect("the bus is readable") {
                let header = sent.header();
                self.sent.insert(header.show_time_ns, Sent { due_ns: header.scheduled_ns, check: check(&sent) });
            }
            if let Some(frame) = frame {
                self.take(&frame, read_ns);
            }
        }
    }

    /// Reads both buses for the time of a phase, then ends all processes.
    pub(crate) fn watch(mut self, phase: Duration) -> Journey {
        self.watch_on(phase);
        let summary = self.receiver.stop("received");
        let count = |key: &str| summary[key].as_u64().expect("a number");
        // The bridge skips frames of a running run until the description arrives, so `foreign` is not checked.
        assert_eq!(count("malformed") + count("not_new") + count("too_fast"), 0, "{summary}");
        Journey { frames: count("frames"), lost: count("lost"), runs: count("runs"), ..self.journey }
    }

    fn take(&mut self, frame: &Frame, read_ns: u64) {
        if let Continuity::Lost(frames) = frame.continuity() {
            self.journey.missed += frames;
        }
        // The frame was sent before the reader of the first bus was opened.
        let Some(&Sent { due_ns, check: sent }) = self.sent.get(&frame.header().show_time_ns) else { return };
        assert_eq!(check(frame), sent, "every received value equals the sent value");
        self.journey.reads.push(Read { due_ns, read_ns });
        self.journey.latency_ns.push(read_ns - due_ns);
    }
}

/// Returns a checksum of the values that are equal on both buses.
fn check(frame: &Frame) -> u64 {
    let header = frame.header();
    let head = [header.head_travel_m.to_bits(), header.head_speed_mps.to_bits(), u64::from(header.state)];
    let values = frame.handles().iter().flat_map(|handle| [handle.position_m, handle.velocity_mps]).flatten();
    head.into_iter().chain(values.map(f64::to_bits)).fold(0, |sum, bits| sum.rotate_left(1) ^ bits)
}
