//! The contest: every setting, every contestant, in turns.

use std::env;
use std::time::Instant;

use crate::outcome::Outcome;
use crate::process::{self, Publisher, Reader};
use crate::scores::{Scores, report};
use crate::setting::{Mode, Setting};
use crate::shared;

/// Mode, readers, and turns of a contestant: fewer where many readers measure at a time, most where ratios are of few
/// microseconds.
const CONTESTS: [(Mode, usize, usize); 4] =
    [(Mode::Polling, 1, 11), (Mode::Woken, 1, 7), (Mode::Polling, 8, 3), (Mode::Woken, 8, 3)];

/// Plays the part that the arguments name: the bench itself, or one of its publishers or readers.
pub(crate) fn play_part(bench: &'static str) {
    let args: Vec<String> = env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    match args[..] {
        [process::PUBLISH, ref setting @ ..] => {
            let setting = Setting::from_args(setting);
            setting.transport.publish.expect("the real server publishes ours")(setting);
        }
        [process::READ, place, ref setting @ ..] => {
            let setting = Setting::from_args(setting);
            (setting.transport.read)(setting, place);
        }
        _ => {
            shared::require_no_arguments();
            hold(bench);
        }
    }
}

/// Lets all compete, prints the figures and writes them under a name.
fn hold(bench: &'static str) {
    let begun = Instant::now();
    let mut all = Vec::new();
    for (mode, readers, turns) in CONTESTS {
        let settings = crate::CONTESTANTS.iter().map(|transport| Setting { transport, mode, readers });
        let mut scores: Vec<Scores> = settings.map(Scores::new).collect();
        for turn in 0..turns {
            // Whoever comes first in one turn comes later in the next.
            for index in 0..scores.len() {
                let contestant = (turn + index) % scores.len();
                let scores = &mut scores[contestant];
                scores.add_turn(play(scores.setting()));
            }
        }
        println!("{} with {readers} reading: {turns} turns done", mode.name());
        all.push(scores);
    }
    report(bench, &all, begun.elapsed());
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
