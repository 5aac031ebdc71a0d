//! The loop of a reading process: it waits for the start of its turn, stores frames, and checks them after the turn.

use std::hint;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use bench_dragon_geometry::dragon::ChainSolver;
use test_support::dragons::paper_dragon_of;

use crate::arrival::Arrival;
use crate::frame_source::BENCHES;
use crate::outcome::Outcome;
use crate::setting::{Mode, Setting};

/// Frames per turn.
const FRAMES: u64 = 500;
/// Longest sleep of a woken reader, for transports that have a timeout.
pub(crate) const WAIT: Duration = Duration::from_secs(1);

/// A reader's end of a transport.
pub(crate) trait Receiver {
    /// Reads the next frame. In woken mode it sleeps until a frame arrives; in polling mode it never waits.
    fn receive(&mut self) -> Option<Arrival>;
}

/// Reads frames. Prints a line after the first frame, waits for a line from the parent, then reads one turn and prints its
/// result.
pub(crate) fn read(setting: Setting, mut receiver: impl Receiver) {
    let between_looks = match setting.mode {
        Mode::Polling if setting.is_crowded() => thread::yield_now,
        Mode::Polling => hint::spin_loop,
        Mode::Woken | Mode::Clock => || {},
    };
    let mut next = || {
        loop {
            if let Some(arrival) = receiver.receive() {
                return arrival;
            }
            between_looks();
        }
    };
    next();
    println!("reading");
    let go = flag_on_line();
    while !go.load(Ordering::Relaxed) {
        next();
    }
    let first = next();
    let mut arrivals = Vec::with_capacity(FRAMES as usize);
    let mut arrival = first;
    while arrival.header.tick < first.header.tick + FRAMES {
        arrivals.push(arrival);
        arrival = next();
    }
    assert_right(&arrivals);
    println!("{}", Outcome::of(&arrivals, FRAMES).to_json());
}

/// Returns a flag that is set when the parent writes a line.
fn flag_on_line() -> Arc<AtomicBool> {
    let go = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&go);
    thread::spawn(move || {
        io::stdin().read_line(&mut String::new()).expect("the parent writes a line");
        flag.store(true, Ordering::Relaxed);
    });
    go
}

fn assert_right(arrivals: &[Arrival]) {
    let dragon = paper_dragon_of(BENCHES);
    let mut solver = ChainSolver::new(&dragon);
    for arrival in arrivals {
        arrival.assert_right(&dragon, &mut solver);
    }
    let in_order = arrivals.is_sorted_by(|before, after| before.header.tick < after.header.tick);
    assert!(in_order, "frames arrive in order, without duplicates");
}
