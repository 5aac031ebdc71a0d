//! A suspended server keeps time with the clock: it jumps after a short suspension, and catches up after a long one.

use bench_dragon::system::clock::monotonic_ns;
use bench_dragon_ipc::{FrameHeader, StatusReader};
use rustix::process::Signal;
use serde_json::Value;
use test_support::eventually::eventually;
use test_support::process::Process;

use crate::periods::{missed, period};
use crate::reader::{Reader, Shot, assert_whole};
use crate::stage::Stage;

const RATE_HZ: u64 = 100;
const PERIOD_NS: u64 = 1_000_000_000 / RATE_HZ;

/// Stops a process for at least this time.
pub(crate) fn suspend(process: &Process, suspended_ns: u64) {
    suspend_during(process, suspended_ns, || ());
}

/// Stops a process for at least this time, and as long as `wait` takes.
pub(crate) fn suspend_during(process: &Process, suspended_ns: u64, wait: impl FnOnce()) {
    process.signal(Signal::STOP);
    let until_ns = monotonic_ns() + suspended_ns;
    wait();
    eventually("the server has been suspended for long enough", || (monotonic_ns() >= until_ns).then_some(()));
    process.signal(Signal::CONT);
}

/// Fails unless every frame is due in a period of its own, no frame is due before the previous one was sent, and the server
/// counts all periods in between as missed.
fn assert_no_burst(shots: &[Shot], summary: &Value) {
    let epoch_ns = shots[0].header.scheduled_ns;
    for pair in shots.windows(2) {
        let [before, after] = [&pair[0].header, &pair[1].header];
        assert_eq!(after.scheduled_ns, epoch_ns + period(&shots[0].header, after, RATE_HZ) * PERIOD_NS);
        assert!(after.scheduled_ns >= before.published_ns, "passed periods are skipped, without a burst");
    }
    let last = &shots[shots.len() - 1].header;
    assert_eq!(summary["frames"], shots.len());
    assert_eq!(
        summary["overruns"],
        period(&shots[0].header, last, RATE_HZ) - last.tick,
        "each missed period is counted: {summary}"
    );
}

/// Returns the delay of a frame behind the clock in nanoseconds, for a show that starts at 0.
fn behind_ns(first: &FrameHeader, header: &FrameHeader) -> i64 {
    (header.scheduled_ns - first.scheduled_ns) as i64 - header.show_time_ns
}

#[test]
fn after_short_suspensions_every_frame_shows_where_the_dragon_should_be() {
    const SUSPENDED_NS: u64 = 100_000_000;
    let stage = Stage::new();
    // A busy machine may delay the server for longer than its suspension.
    let serve = ["--rate", &RATE_HZ.to_string(), "--catch-up", "10", "--until", "10", "--readers", "1"];
    let server = stage.serve(&serve);
    let run_id = server.run_id;
    let mut reader = Reader::join(&stage);
    let mut shots = vec![reader.next()];
    for _ in 0..5 {
        let tick = shots.last().expect("at least one frame").header.tick + 10;
        shots.extend(reader.read_to_tick(tick));
        suspend(&server.process, SUSPENDED_NS);
    }
    shots.extend(reader.read_to_end());
    let summary = server.summary();
    assert_whole(&shots, run_id);
    assert_no_burst(&shots, &summary);
    let (last, walked) = shots.split_last().expect("the frames of a show");
    for shot in walked {
        assert_eq!(behind_ns(&shots[0].header, &shot.header), 0, "tick {}", shot.header.tick);
        assert!((shot.header.head_travel_m - shot.header.show_time_s()).abs() < 1e-12, "tick {}", shot.header.tick);
        assert_eq!(shot.header.time_scale, 1.0);
    }
    assert_eq!(last.header.show_time_ns, 10_000_000_000, "the show ends exactly at its end");
    let jumps = shots.windows(2).filter(|pair| missed(&pair[0].header, &pair[1].header, RATE_HZ) >= 8).count();
    assert!(jumps >= 5, "five suspensions, {jumps} jumps");
    assert_eq!((&summary["behind_s"], &summary["most_behind_s"]), (&Value::from(0.0), &Value::from(0.0)));
}

#[test]
fn after_a_long_suspension_the_server_catches_up_at_a_tenth_more() {
    const SUSPENDED_NS: u64 = 1_000_000_000;
    const MOST_JUMPED: u64 = RATE_HZ / 4;
    let stage = Stage::new();
    let server = stage.serve(&["--rate", &RATE_HZ.to_string(), "--readers", "1"]);
    let run_id = server.run_id;
    let statuses = StatusReader::open(stage.domain(), "test").expect("a server has created the services");
    let mut reader = Reader::join(&stage);
    let mut shots = reader.read_to_tick(20);
    suspend(&server.process, SUSPENDED_NS);
    shots.push(
        reader
            .read_until("the show catches up", |header| header.time_scale > 1.0)
            .pop()
            .expect("the wanted frame comes last"),
    );
    let first = shots[0].header;
    let status = eventually("a status says that the show is behind", || {
        statuses.poll().expect("the bus is readable").filter(|status| status.behind_ns > 0)
    });
    assert!(status.most_behind_ns >= SUSPENDED_NS - 2 * PERIOD_NS, "{} ns", status.most_behind_ns);
    shots.clear();
    shots.extend(reader.read_until("the show has caught up", |header| behind_ns(&first, header) == 0));
    let summary = server.stop();

    for pair in shots.windows(2) {
        let [before, after] = [&pair[0].header, &pair[1].header];
        let missed = missed(before, after, RATE_HZ);
        let periods = if missed > MOST_JUMPED { 1.0 } else { (missed + 1) as f64 };
        let step_ns = after.time_scale * periods * PERIOD_NS as f64;
        assert!((1.0..=1.1).contains(&after.time_scale), "{after:?}");
        assert!(((after.show_time_ns - before.show_time_ns) as f64 - step_ns).abs() < 2.0, "{before:?} {after:?}");
    }
    assert!(shots.iter().all(|shot| shot.header.run_id == run_id));
    assert!(shots.windows(2).all(|pair| pair[1].header.tick == pair[0].header.tick + 1), "ticks have no hole");
    assert!(summary["most_behind_s"].as_f64() >= Some((SUSPENDED_NS - 2 * PERIOD_NS) as f64 * 1e-9), "{summary}");
}
