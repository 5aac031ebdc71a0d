//! The contest: in every setting, all contestants take turns.

use std::env;
use std::time::Instant;

use crate::outcome::Outcome;
use crate::process::{self, Publisher, Reader};
use crate::scores::{Scores, report};
use crate::setting::{Mode, Setting};
use crate::shared;
use crate::transport::Transport;

/// Mode, number of readers, and turns per contestant. Settings with many readers need fewer turns, because more readers
/// measure. Ratios of a few microseconds need the most turns.
const CONTESTS: [(Mode, usize, usize); 6] = [
    (Mode::Polling, 1, 11),
    (Mode::Woken, 1, 7),
    (Mode::Clock, 1, 7),
    (Mode::Polling, 8, 3),
    (Mode::Woken, 8, 3),
    (Mode::Clock, 8, 3),
];

/// Runs the role that the arguments name: the bench itself, or one of its publishers or readers.
pub(crate) fn play_part(bench: &'static str) {
    let args: Vec<String> = env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    match args[..] {
        [process::PUBLISH, ref setting @ ..] => {
            let setting = Setting::from_args(setting);
            setting.transport.publish.expect("`bench-dragon serve` publishes our frames")(setting);
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

/// Runs all contests, prints the figures and writes them to the bench's file.
fn hold(bench: &'static str) {
    let begun = Instant::now();
    let mut all = Vec::new();
    for (mode, readers, turns) in CONTESTS {
        let can_play = |transport: &&Transport| mode == Mode::Polling || !transport.only_polling;
        let settings = crate::CONTESTANTS.iter().filter(can_play).map(|transport| Setting { transport, mode, readers });
        let mut scores: Vec<Scores> = settings.map(Scores::new).collect();
        for turn in 0..turns {
            // The order rotates from turn to turn.
            for index in 0..scores.len() {
                let contestant = (turn + index) % scores.len();
                let scores = &mut scores[contestant];
                scores.add_turn(play(scores.setting()));
            }
        }
        println!("{}, {readers} readers: {turns} turns finished", mode.name());
        all.push(scores);
    }
    report(bench, &all, begun.elapsed());
}

/// Runs one turn. Returns the results of all readers.
fn play(setting: Setting) -> Vec<Outcome> {
    let publisher = Publisher::start(setting);
    let mut readers: Vec<Reader> = (0..setting.readers).map(|_| Reader::start(setting, publisher.place())).collect();
    readers.iter().for_each(Reader::wait_for_frames);
    readers.iter_mut().for_each(Reader::go);
    let outcomes = readers.into_iter().map(Reader::outcome).collect();
    publisher.stop();
    outcomes
}
