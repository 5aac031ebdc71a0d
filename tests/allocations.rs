//! Heap allocations of the loop, and of a reader of its frames, in steady state.
//!
//! A short and a long run differ only in their number of ticks. So the difference between the allocations of the loop's thread
//! is exactly the allocations of the additional ticks. Allocations of other threads do not count: the reporter may allocate.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use allocation_counter::AllocationInfo;
use bench_dragon::config::Config;
use bench_dragon::source::server::{Server, ServerSettings, TimecodeFollowing};
use bench_dragon::source::timecode::{FollowerSettings, FrameRate, TimecodeReceiver};
use bench_dragon_ipc::{Domain, FrameSubscriber, Instance, ShowState, StatusReader, TimecodeKind};
use test_support::eventually::eventually;

#[path = "processes/steady_desk.rs"]
mod steady_desk;

use steady_desk::send_timecode;

/// Ticks per second.
const RATE_HZ: u64 = 2000;
/// Ticks of the shorter run. By then its reader has fallen behind, and loses a frame with each tick.
const LEAD_TICKS: u64 = 600;
/// Additional ticks of the longer run.
const MORE_TICKS: u64 = 1000;

/// iceoryx2 allocates once for each loaned sample, for the reference that keeps the sample's publisher alive.
const OF_ICEORYX2: u64 = 1;

#[test]
fn a_tick_that_follows_timecode_allocates_as_much_as_any_other() {
    const TRIES: usize = 5;
    // The number of ticks up to a show time depends on the arrival of the timecodes.
    let others = |ticks| {
        let (allocations, frames) = run_after_timecode(ticks);
        allocations.count_total - frames * OF_ICEORYX2
    };
    let mut seen = Vec::new();
    for _ in 0..TRIES {
        let (short, long) = (others(LEAD_TICKS), others(LEAD_TICKS + MORE_TICKS));
        if short == long {
            return;
        }
        seen.push([short, long]);
    }
    panic!("longer runs allocate more: {seen:?}")
}

#[test]
fn a_tick_allocates_nothing_but_what_iceoryx2_does_for_its_sample() {
    for spin_us in [0, 100] {
        assert_ticks_allocate_nothing(spin_us);
    }
}

/// Start and end of a run rarely allocate once more or once less, depending on other processes. A tick that allocates adds
/// [`MORE_TICKS`] to every longer run. So one pair of equal runs proves that no tick allocates.
fn assert_ticks_allocate_nothing(spin_us: u32) {
    const TRIES: usize = 5;
    let mut seen = Vec::new();
    for _ in 0..TRIES {
        let (short, long) = (run(LEAD_TICKS, spin_us), run(LEAD_TICKS + MORE_TICKS, spin_us));
        if short == long {
            return;
        }
        seen.push([short, long]);
    }
    panic!("longer runs allocate more, or keep more: {seen:?}")
}

#[test]
fn a_reader_allocates_once_a_second_for_its_report_and_for_nothing_else() {
    const PERIODS: u64 = 5000;
    let (domain, server) = create(PERIODS, 0);
    let (allocations, longest) = thread::scope(|scope| {
        let reading = scope.spawn(|| read_to_end(&domain));
        server.run(&AtomicBool::new(false)).expect("frames can be published");
        reading.join().expect("the reader does not panic")
    });
    // A report at the start of the time, and one after each second.
    let reports = 1..=longest.as_secs() + 1;
    assert!(reports.contains(&allocations.count_total), "{allocations:?} in {longest:?} of frames");
    assert_eq!(allocations.count_current, 0, "the reader keeps memory: {allocations:?}");
}

/// Reads frames up to the end of the show. Returns the allocations after the second frame, and the time that this took.
fn read_to_end(domain: &Domain) -> (AllocationInfo, Duration) {
    let mut reader = FrameSubscriber::open(domain, "test").expect("the server has created the services");
    let mut next =
        || eventually("the next frame", || reader.receive().expect("the bus is readable").map(|frame| *frame.header()));
    let (_, mut last) = (next(), next());
    let begun = Instant::now();
    let allocations = allocation_counter::measure(|| {
        while last.show_state() != Some(ShowState::Ended) {
            last = next();
        }
    });
    (allocations, begun.elapsed())
}

/// Allocations of the loop's thread in a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Allocations {
    /// Allocations except those of iceoryx2 for each frame.
    beside_frames: u64,
    current: i64,
    most: u64,
}

/// Measures a run of this many periods after tick 0, with a reader that falls behind. A busy machine misses periods, so there
/// may be fewer frames.
fn run(periods: u64, spin_us: u32) -> Allocations {
    let (domain, server) = create(periods, spin_us);
    let (AllocationInfo { count_total, count_current, count_max, .. }, frames) = measure(&domain, server);
    assert!(frames <= periods + 1, "{frames} frames");
    Allocations { beside_frames: count_total - frames * OF_ICEORYX2, current: count_current, most: count_max }
}

/// Measures a run that follows timecode, with a hundred timecodes per second. Returns the allocations and the number of frames.
fn run_after_timecode(ticks: u64) -> (AllocationInfo, u64) {
    let (domain, mut server) = create(ticks, 0);
    let source = "osc:0".parse().expect("a source");
    let (receiver, inbox) = TimecodeReceiver::start(source, FrameRate::default(), 1_000_000_000).expect("a port");
    let settings = FollowerSettings {
        offset_s: 0.0,
        timeout_ns: 1_000_000_000,
        period_s: 1.0 / RATE_HZ as f64,
        first_s: 0.0,
        last_s: 100.0,
    };
    server.follow(TimecodeFollowing::new(settings, TimecodeKind::Osc, inbox).0);
    let (begun, over) = mpsc::channel::<()>();
    let listen = receiver.listen;
    let measured = thread::scope(|scope| {
        scope.spawn(move || send_timecode(listen, &over));
        // Dropped at the end of this scope, also if the test fails.
        let _begun = begun;
        measure(&domain, server)
    });
    assert!(receiver.counts().taken > 0, "the show followed the timecode");
    measured
}

/// Returns a number that is unique to the test's thread.
fn thread_number() -> usize {
    static THREADS: AtomicUsize = AtomicUsize::new(0);
    thread_local!(static NUMBER: usize = THREADS.fetch_add(1, Ordering::Relaxed));
    NUMBER.with(|number| *number)
}

/// Creates a server that ends this many ticks after tick 0.
fn create(ticks: u64, spin_us: u32) -> (Domain, Server) {
    // The tests run in parallel, each on its own thread.
    let name = format!("allocations-{}-{}", std::process::id(), thread_number());
    let domain = Domain::new(Instance::new(&name).expect("allowed characters")).expect("a short path");
    let text = format!("[serve]\nrate_hz = {RATE_HZ}\nspin_us = {spin_us}\n");
    let mut settings = ServerSettings::planned(Config::from_toml(&text).expect("the paper's dragon"), 0.0);
    settings.start.until_s = Some(ticks as f64 / RATE_HZ as f64);
    let server = Server::create(&domain, settings).expect("the instance is this test's own");
    (domain, server)
}

/// Returns the allocations of the loop's thread, and the number of frames.
fn measure(domain: &Domain, server: Server) -> (AllocationInfo, u64) {
    let reader = FrameSubscriber::open(domain, "test").expect("the server has created the services");
    await_status(domain);
    let mut summary = None;
    let allocations = allocation_counter::measure(|| {
        summary = Some(server.run(&AtomicBool::new(false)).expect("frames can be published"));
    });
    drop(reader);
    (allocations, summary.expect("the server has run").frames)
}

/// Waits until the reporting thread has waited once. The loop's thread frees the memory of that wait at the end of every run.
fn await_status(domain: &Domain) {
    let status = StatusReader::open(domain, "test").expect("the server has created the services");
    eventually("the first status", || status.poll().expect("the bus is readable"));
}
