//! What a reading process does: wait for its go, keep what arrives, and prove that it was right when the turn is over.

use std::hint;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use bench_dragon_geometry::dragon::ChainSolver;

use crate::arrival::Arrival;
use crate::frame_source::BENCHES;
use crate::outcome::Outcome;
use crate::setting::{Mode, Setting};
use crate::shared;

/// Frames that are sent in a turn.
const FRAMES: u64 = 500;
/// How long a woken reader sleeps at most where its transport lets it choose.
pub(crate) const WAIT: Duration = Duration::from_secs(1);

/// A reader's end of a transport.
pub(crate) trait Receiver {
    /// Reads the next frame. Woken, it sleeps until there is one; polling, it never waits.
    fn receive(&mut self) -> Option<Arrival>;
}

/// Reads frames: says when the first one has come, waits for a word, and tells what came in a turn from then on.
pub(crate) fn read(setting: Setting, mut receiver: impl Receiver) {
    let between_looks = match setting.mode {
        Mode::Polling if setting.is_crowded() => thread::yield_now,
        Mode::Polling => hint::spin_loop,
        Mode::Woken => || {},
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
    let go = at_a_word();
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

/// Whether the parent has written a line.
fn at_a_word() -> Arc<AtomicBool> {
    let go = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&go);
    thread::spawn(move || {
        io::stdin().read_line(&mut String::new()).expect("our parent says go");
        flag.store(true, Ordering::Relaxed);
    });
    go
}

fn assert_right(arrivals: &[Arrival]) {
    let dragon = shared::dragon(BENCHES);
    let mut solver = ChainSolver::new(&dragon);
    for arrival in arrivals {
        arrival.assert_right(&dragon, &mut solver);
    }
    let in_order = arrivals.is_sorted_by(|before, after| before.header.tick < after.header.tick);
    assert!(in_order, "a frame comes once, and none before an earlier one");
}
