//! A scenario: a dragon, its route, the settings of its show, and the faults, all from one seed.

use std::fmt::Write as _;

use bench_dragon::config::{Config, ConfigDocument};
use bench_dragon::recording::walking_bytes_per_s;
use bench_dragon_geometry::dragon::Meter;
use bench_dragon_geometry::formation::Formation;

use crate::dice::Dice;
use crate::fault::{Fault, draw};

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
    /// The dragon of the guard, with its limit of work.
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
        let mut dice = Dice::new(seed, 1);
        let has_timecode = dice.chance(0.2);
        let (toml, config) = loop {
            let toml = document(&mut dice, has_timecode);
            // Some random dragons do not fit on their random routes.
            let built = ConfigDocument::from_toml(&toml).map(|document| document.with_placing_steps(20_000_000));
            if let Ok(config) = built.and_then(ConfigDocument::build)
                && config.lead().end_travel_m() > config.tables().head.speed_mps * config.start_s() + 1.0
            {
                break (toml, config);
            }
        };
        let seek_s = [config.start_s(), config.last_seek_s()];
        let flags = ShowFlags {
            held: dice.chance(0.5),
            stay: dice.chance(0.7),
            auto_resume: dice.chance(0.4),
            timecode: has_timecode,
            until_s: dice.chance(0.3).then(|| seek_s[0] + (seek_s[1] - seek_s[0]) * dice.within(0.3, 1.0)),
        };
        let length_ns = (hours * 3600e9) as u64;
        let faults = draw(seed, length_ns, seek_s, has_timecode);
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

    pub(crate) fn is_guarded(&self) -> bool {
        self.config.tables().monitor.guard
    }

    /// A random duration for one purpose, the same at every play.
    pub(crate) fn latency_ns(&self, now_ns: u64, purpose: u64, longest_ns: u64) -> u64 {
        let mut dice = Dice::new(self.seed ^ now_ns, purpose);
        (dice.scaled(1e3, longest_ns as f64)) as u64
    }
}

/// A random configuration as text: a small dragon on a spiral, a turnaround or a path.
fn document(dice: &mut Dice, has_timecode: bool) -> String {
    let mut text = String::new();
    let width_m = dice.within(0.05, 0.5);
    let offset_m = dice.within(0.02, 0.3);
    let body_m = 2.0 * offset_m + dice.within(0.4, 1.8);
    let head_m = body_m + dice.within(0.0, 1.2);
    let benches = 1 + dice.below(14);
    let mut line = |line: String| writeln!(text, "{line}").expect("a string takes every line");
    line(format!("[dragon]\nbenches = {benches}\nhead_length_m = {head_m}\nbody_length_m = {body_m}"));
    line(format!("width_m = {width_m}\nhole_offset_m = {offset_m}"));
    let speed_mps = dice.scaled(0.05, 2.0);
    line(format!("[head]\nspeed_mps = {speed_mps}"));
    if dice.chance(0.5) {
        line(format!("accel_mps2 = {}", dice.scaled(0.05, 3.0)));
    }
    let rate_hz = dice.one_of(&[1, 2, 3, 5, 7, 10, 10, 20, 25, 50, 60, 100]);
    let time_scale = if has_timecode { 1.0 } else { dice.one_of(&[1.0, 1.0, 1.0, 0.5, 3.0, 10.0]) };
    let catch_up_s = dice.one_of(&[0.25, 0.25, 0.0, 1.0, 2.0]);
    line(format!("[serve]\nrate_hz = {rate_hz}\ntime_scale = {time_scale:?}\ncatch_up_s = {catch_up_s:?}"));
    let guard = dice.chance(0.75);
    line(format!(
        "[monitor]\nguard = {guard}\nmargin_m = {}\nnear_m = {}",
        dice.scaled(0.0005, 0.1),
        dice.within(0.01, 0.2)
    ));
    route(dice, &mut line);
    text
}

fn route(dice: &mut Dice, line: &mut impl FnMut(String)) {
    match dice.below(6) {
        0 | 1 => {
            let (pitch_m, turns) = (dice.within(0.3, 1.5), dice.within(2.0, 6.0));
            line(format!("[route]\nkind = \"spiral\"\npitch_m = {pitch_m}\nstart_turns = {turns}"));
        }
        2 => {
            let (pitch_m, diameter_m) = (dice.within(0.8, 2.0), dice.within(3.0, 9.0));
            line(format!("[route]\nkind = \"turnaround\"\npitch_m = {pitch_m}\nturn_diameter_m = {diameter_m}"));
        }
        3 => {
            let (side_m, radius_m, laps) = (dice.within(1.0, 8.0), dice.within(0.8, 4.0), 1 + dice.below(4));
            line(format!("[route]\nkind = \"path\"\nclosed = true\nlaps = {laps}"));
            for _ in 0..2 {
                line(format!("[[route.segments]]\nkind = \"line\"\nlength_m = {side_m}"));
                line(format!("[[route.segments]]\nkind = \"arc\"\nradius_m = {radius_m}\nturn_deg = 180"));
            }
        }
        _ => {
            line("[route]\nkind = \"path\"".to_owned());
            for _ in 0..2 + dice.below(8) {
                segment(dice, line);
            }
        }
    }
}

fn segment(dice: &mut Dice, line: &mut impl FnMut(String)) {
    let sign = dice.one_of(&[1.0, -1.0]);
    match dice.below(3) {
        0 => line(format!("[[route.segments]]\nkind = \"line\"\nlength_m = {}", dice.within(0.5, 12.0))),
        1 => {
            let (radius_m, turn_deg) = (dice.within(0.8, 5.0), sign * dice.within(20.0, 400.0));
            line(format!("[[route.segments]]\nkind = \"arc\"\nradius_m = {radius_m}\nturn_deg = {turn_deg}"));
        }
        _ => {
            let (from_m, to_m, turn_deg) =
                (dice.within(1.0, 4.0), dice.within(1.0, 4.0), sign * dice.within(60.0, 700.0));
            line(format!(
                "[[route.segments]]\nkind = \"spiral\"\nstart_radius_m = {from_m}\nend_radius_m = {to_m}\nturn_deg = {turn_deg}"
            ));
        }
    }
}
