//! A server that was suspended goes on with its schedule.

use bench_dragon::clock::monotonic_ns;
use rustix::process::Signal;

use crate::eventually::eventually;
use crate::reader::Reader;
use crate::stage::Stage;

const RATE_HZ: u64 = 100;
const SUSPENDED_NS: u64 = 2_000_000_000;

#[test]
fn a_suspended_server_counts_its_overruns_and_goes_on_without_a_burst() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", &RATE_HZ.to_string(), "--until", "3", "--readers", "1"]);
    let mut reader = Reader::join(&stage);
    let mut shots = reader.read_to_tick(20);
    server.process.signal(Signal::STOP);
    let until_ns = monotonic_ns() + SUSPENDED_NS;
    eventually("two seconds of releases have passed", || (monotonic_ns() >= until_ns).then_some(()));
    server.process.signal(Signal::CONT);
    // To its own end: at a signal, releases that it skipped after its last frame are counted too.
    shots.extend(reader.read_to_end());
    let summary = server.summary();

    let epoch_ns = shots[0].header.scheduled_ns;
    let release = |scheduled_ns: u64| ((scheduled_ns - epoch_ns) * RATE_HZ + 500_000_000) / 1_000_000_000;
    let mut skipped = 0;
    let mut longest_ns = 0;
    for pair in shots.windows(2) {
        let [before, after] = [&pair[0].header, &pair[1].header];
        assert_eq!(after.tick, before.tick + 1, "ticks have no hole");
        assert_eq!(after.sim_time_ns - before.sim_time_ns, 10_000_000, "show time never jumps");
        assert_eq!(after.scheduled_ns, epoch_ns + release(after.scheduled_ns) * 1_000_000_000 / RATE_HZ);
        assert!(after.scheduled_ns >= before.published_ns, "a release that has passed is skipped: no burst");
        skipped += release(after.scheduled_ns) - release(before.scheduled_ns) - 1;
        longest_ns = longest_ns.max(after.scheduled_ns - before.scheduled_ns);
    }
    assert_eq!(summary["frames"], shots.len());
    assert_eq!(summary["overruns"], skipped, "each release that was skipped is counted");
    assert!(longest_ns >= SUSPENDED_NS - 2 * 1_000_000_000 / RATE_HZ, "it was suspended: {longest_ns} ns");
}
