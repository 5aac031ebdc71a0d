//! Measures the latency and the losses of a network: frames of the paper's dragon pass at 1 kHz from one bus, through a pair of
//! zenoh bridges, to another bus.
//!
//! The bridges use TCP on loopback, then a virtual cable between two network namespaces, which requires root. Latency counts
//! from the instant at which a frame was due on the first bus until a reader of the second bus has read it. At the end the
//! cable is cut for five seconds, and the bench measures when frames return. Every frame is compared with the sent frame
//! before it is counted.

#[path = "../../../benches/shared/mod.rs"]
mod shared;

#[path = "../../../tests/processes/zenoh/cable.rs"]
mod cable;
mod joined;

use std::thread;
use std::time::Duration;

use bench_dragon::system::clock::monotonic_ns;
use serde_json::Value;

use shared::{Figures, quantile, seconds_or};

use cable::Cable;
use joined::{Joined, Journey};

/// Default length of a phase in seconds; `--seconds` overrides it.
const SECONDS: u32 = 20;
/// Duration of the cut.
const CUT: Duration = Duration::from_secs(5);
/// Time for which the bench reads frames after the cut.
const AFTERMATH: Duration = Duration::from_secs(15);

fn main() {
    let phase = Duration::from_secs(seconds_or(SECONDS).into());
    let mut figures = Figures::of("bridge");
    figures.set("seconds_per_phase", phase.as_secs());
    let loopback = Joined::over_loopback().watch(phase);
    report(&mut figures, "loopback", Some(&loopback));
    let cable = lay_cable();
    let over_cable = cable.as_ref().map(|cable| Joined::over(cable).watch(phase));
    report(&mut figures, "cable", over_cable.as_ref());
    report_cut(&mut figures, cable.as_ref());
    figures.write();
}

/// Returns a cable between two namespaces; `None` if this machine does not allow it.
#[allow(clippy::print_stdout, reason = "a bench prints")]
fn lay_cable() -> Option<Cable> {
    let cable = Cable::lay();
    if cable.is_none() {
        println!(
            "cannot create network namespaces, which require root and iproute2: the figures over a cable are null"
        );
    }
    cable
}

/// Sets the figures of one connection. They are null if it was not measured.
fn report(figures: &mut Figures, way: &str, journey: Option<&Journey>) {
    let number = |of: fn(&Journey) -> u64| journey.map_or(Value::Null, |journey| of(journey).into());
    figures.set(&format!("{way}_frames"), number(|journey| journey.frames));
    figures.set(&format!("{way}_lost"), number(|journey| journey.lost));
    let mut latency_us: Vec<f64> =
        journey.iter().flat_map(|journey| &journey.latency_ns).map(|&nanos| nanos as f64 / 1e3).collect();
    latency_us.sort_by(f64::total_cmp);
    for (name, share) in [("p50", 0.5), ("p99", 0.99), ("p999", 0.999), ("max", 1.0)] {
        let value = journey.map_or(Value::Null, |_| quantile(&latency_us, share).into());
        figures.set(&format!("{way}_due_to_read_{name}_us"), value);
    }
}

/// Cuts the cable, restores it, and sets the figures of the cut.
fn report_cut(figures: &mut Figures, cable: Option<&Cable>) {
    let keys = ["cut_first_frame_ms", "cut_first_new_frame_ms", "cut_frames_lost", "cut_frames_missed_here"];
    let Some(cable) = cable else {
        return keys.iter().for_each(|key| figures.set(key, Value::Null));
    };
    let mut joined = Joined::over(cable);
    joined.watch_on(Duration::from_secs(2));
    cable.set("down");
    joined.watch_on(CUT);
    let joined_ns = monotonic_ns();
    cable.set("up");
    let journey = joined.watch(AFTERMATH);
    assert_eq!(journey.runs, 1, "the same run continues after the cut");
    let since = |is_wanted: &dyn Fn(u64) -> bool| {
        let first = journey.reads.iter().find(|read| read.read_ns > joined_ns && is_wanted(read.due_ns));
        first.map_or(Value::Null, |read| ((read.read_ns - joined_ns) as f64 / 1e6).into())
    };
    figures.set(keys[0], since(&|_| true));
    figures.set(keys[1], since(&|due_ns| due_ns >= joined_ns));
    figures.set(keys[2], journey.lost);
    figures.set(keys[3], journey.missed);
    // Leaves time for the network's own threads to end before the next bench.
    thread::sleep(Duration::from_millis(100));
}
