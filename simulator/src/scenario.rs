//! A scenario: dragons with their plan, the settings of their show, and the faults, all from one seed.

use bench_dragon::config::Config;
use bench_dragon::recording::walking_bytes_per_s;
use bench_dragon_geometry::dragon::Meter;
use bench_dragon_geometry::formation::Formation;

use crate::dice::Dice;
use crate::fault::{Fault, draw, draw_plan_commands};
use crate::plan::{draw_more, draw_plain};

/// A second, in nanoseconds.
pub(crate) const SECOND_NS: u64 = 1_000_000_000;
/// Greatest work of one call of the guard, as in the guard's process.
const STEPS_AT_A_TIME: u64 = bench_dragon::safety::guard::STEPS_AT_A_TIME;

/// Greatest size of the recordings of a scenario, which are kept in memory.
const MOST_RECORDED_BYTES: f64 = 1e8;

/// A show with its faults.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// The seed from which all else follows.
    pub seed: u64,
    /// The configuration as text.
    pub toml: String,
    /// Faults and commands, in the order of their instants.
    pub faults: Vec<Fault>,
    /// Length up to which faults happen, in nanoseconds of the simulated clock.
    pub length_ns: u64,
    /// The show's flags, beside the configuration.
    pub(crate) flags: ShowFlags,
    pub(crate) config: Config,
    /// Whether the show is recorded.
    pub(crate) has_recorder: bool,
    /// The dragons of the guard, with its limit of work.
    pub(crate) metered: Formation,
}

/// Flags of the command `show`.
#[derive(Clone, Copy, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag")]
pub(crate) struct ShowFlags {
    pub(crate) held: bool,
    pub(crate) stay: bool,
    pub(crate) auto_resume: bool,
    pub(crate) timecode: bool,
    pub(crate) until_s: Option<f64>,
}

impl Scenario {
    /// The scenario of a seed, with faults for a number of hours.
    pub fn of(seed: u64, hours: f64) -> Self {
        Self::drawn(seed, hours, true)
    }

    /// The same with one dragon, and without cues.
    pub fn plain(seed: u64, hours: f64) -> Self {
        Self::drawn(seed, hours, false)
    }

    fn drawn(seed: u64, hours: f64, may_have_more: bool) -> Self {
        let mut dice = Dice::new(seed, 1);
        let has_timecode = dice.chance(0.2);
        let plain = draw_plain(&mut dice, has_timecode);
        let mut more_dice = Dice::new(seed, 15);
        let more = if may_have_more { draw_more(&mut more_dice, &plain, !has_timecode) } else { None };
        let has_more = more.is_some();
        let (toml, config) = more.unwrap_or(plain);
        let seek_s = [config.start_s(), config.last_seek_s()];
        let flags = ShowFlags {
            held: dice.chance(0.5),
            stay: dice.chance(0.7),
            auto_resume: dice.chance(0.4),
            timecode: has_timecode,
            until_s: dice.chance(0.3).then(|| seek_s[0] + (seek_s[1] - seek_s[0]) * dice.within(0.3, 1.0)),
        };
        let length_ns = (hours * 3600e9) as u64;
        let mut faults = draw(seed, length_ns, seek_s, has_timecode);
        if has_more {
            let cues_s: Vec<f64> = config.cues().iter().map(|cue| cue.at_s).collect();
            faults.extend(draw_plan_commands(seed, length_ns, &cues_s));
            faults.sort_by_key(|fault| fault.at_ns);
        }
        let metered = config.formation().metered(&Meter::of(STEPS_AT_A_TIME));
        let bytes_per_s = walking_bytes_per_s(config.formation().layout(), config.tables().serve.rate_hz);
        let has_recorder = Dice::new(seed, 3).chance(0.4) && bytes_per_s * hours * 3600.0 <= MOST_RECORDED_BYTES;
        Self { seed, toml, faults, length_ns, flags, config, has_recorder, metered }
    }

    /// The same scenario with only the faults of these numbers.
    #[must_use]
    pub fn only(&self, numbers: &[usize]) -> Self {
        let faults = numbers.iter().filter_map(|&number| self.faults.get(number).copied()).collect();
        Self { faults, ..self.clone() }
    }

    /// The show time to which the captain seeks.
    pub(crate) fn seek_s(&self) -> f64 {
        let (first_s, last_s) = (self.config.start_s(), self.config.last_seek_s());
        first_s + 0.1 * (last_s - first_s)
    }

    /// First and last show time to which an operator may seek.
    pub(crate) fn times_s(&self) -> [f64; 2] {
        [self.config.start_s(), self.config.last_seek_s()]
    }

    /// The configuration of the show.
    pub fn config(&self) -> &Config {
        &self.config
    }

    pub(crate) fn is_guarded(&self) -> bool {
        self.config.tables().monitor.guard
    }

    /// A random duration for one purpose, the same at every play.
    pub(crate) fn latency_ns(&self, now_ns: u64, purpose: u64, longest_ns: u64) -> u64 {
        let mut dice = Dice::new(self.seed ^ now_ns, purpose);
        (dice.scaled(1e3, longest_ns as f64)) as u64
    }
}
