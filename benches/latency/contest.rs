//! The contest: every setting, every contestant, in turns.

use std::time::Instant;

use crate::outcome::Outcome;
use crate::process::{Publisher, Reader};
use crate::scores::{Scores, report};
use crate::setting::{Mode, Setting, Transport};
use crate::transport;

/// Mode, readers, and turns of a contestant: fewer where many readers measure at a time, most where ratios are of few
/// microseconds.
const CONTESTS: [(Mode, usize, usize); 4] =
    [(Mode::Polling, 1, 11), (Mode::Woken, 1, 7), (Mode::Polling, 8, 3), (Mode::Woken, 8, 3)];

/// Lets all compete, prints the figures and writes them.
pub(crate) fn hold() {
    let begun = Instant::now();
    let mut all = Vec::new();
    for (mode, readers, turns) in CONTESTS {
        let settings = Transport::ALL.map(|transport| Setting { transport, mode, readers });
        let mut scores = settings.map(Scores::new);
        for turn in 0..turns {
            // Whoever comes first in one turn comes later in the next.
            for index in 0..settings.len() {
                let scores = &mut scores[(turn + index) % settings.len()];
                scores.add_turn(play(scores.setting()));
            }
        }
        println!("{} with {readers} reading: {turns} turns done", mode.name());
        all.push(scores);
    }
    transport::clear_up();
    report(&all, begun.elapsed());
}

/// One turn: what each reader measured.
fn play(setting: Setting) -> Vec<Outcome> {
    let publisher = Publisher::start(setting);
    let mut readers: Vec<Reader> = (0..setting.readers).map(|_| Reader::start(setting, publisher.place())).collect();
    readers.iter().for_each(Reader::wait_for_frames);
    readers.iter_mut().for_each(Reader::go);
    let outcomes = readers.into_iter().map(Reader::outcome).collect();
    publisher.stop();
    outcomes
}
