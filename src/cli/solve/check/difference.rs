//! How far the numbers of a table are from the exact ones.

use std::fmt::Write as _;

use bench_dragon_geometry::dragon::ChainSolver;
use bench_dragon_geometry::number::Fixed;
use serde::Serialize;

use super::given::GivenPose;
use crate::cli::solve::contest::{self, DECIMALS, Quantity};
use crate::config::Config;
use crate::output::poses::travel_m;

/// The differences of one kind of number.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct Differences {
    /// Numbers of the table.
    pub(super) values: usize,
    /// Those of them that are right to six decimals.
    pub(super) right: usize,
    /// Those that are right to three decimals.
    right_to_3: usize,
    /// The largest difference; null for a table without such numbers.
    largest: Option<Largest>,
}

/// The largest difference, and its place.
#[derive(Clone, Debug, Serialize)]
struct Largest {
    difference: f64,
    time_s: f64,
    handle: usize,
    /// The handle's name in the contest.
    name: String,
    quantity: &'static str,
    given: f64,
    exact: f64,
}

/// The differences of positions and of speeds.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct AllDifferences {
    pub(super) positions: Differences,
    pub(super) speeds: Differences,
}

impl AllDifferences {
    /// Compares the poses of a table with the exact ones at their times.
    pub(super) fn of(poses: &[(f64, &GivenPose)], config: &Config) -> Self {
        let mut solver = ChainSolver::new(config.lead());
        let mut all = Self::default();
        for &(time_s, pose) in poses {
            let head_mps = config.timetable().speed_mps(time_s);
            let handles =
                solver.solve(config.lead(), travel_m(time_s, config)).expect("the travel is in the run").iter();
            for ((index, handle), given) in handles.enumerate().zip(&pose.handles) {
                let exact = [handle.position.x, handle.position.y, handle.speed_ratio * head_mps];
                for ((quantity, given), exact) in Quantity::ALL.into_iter().zip(given).zip(exact) {
                    let Some(given) = *given else { continue };
                    let differences = if quantity == Quantity::Speed { &mut all.speeds } else { &mut all.positions };
                    differences.add(given, exact, || (time_s, index, pose.handles.len(), quantity));
                }
            }
        }
        all
    }

    pub(super) fn are_right(&self) -> bool {
        [&self.positions, &self.speeds].iter().all(|differences| differences.right == differences.values)
    }

    pub(super) fn text(&self) -> String {
        let lines = [("positions", "m", &self.positions), ("speeds", "m/s", &self.speeds)];
        let lines = lines.into_iter().filter(|(_, _, differences)| differences.values > 0);
        lines.map(|(name, unit, differences)| differences.text(name, unit)).collect::<Vec<_>>().join("\n")
    }
}

impl Differences {
    fn add(&mut self, given: f64, exact: f64, place: impl FnOnce() -> (f64, usize, usize, Quantity)) {
        self.values += 1;
        let difference = (given - exact).abs();
        self.right += usize::from(is_right(difference, DECIMALS));
        self.right_to_3 += usize::from(is_right(difference, 3));
        if self.largest.as_ref().is_none_or(|largest| difference > largest.difference) {
            let (time_s, handle, handles, quantity) = place();
            let quantity = match quantity {
                Quantity::X => "x_m",
                Quantity::Y => "y_m",
                Quantity::Speed => "speed_mps",
            };
            let name = contest::name(handle, handles);
            self.largest = Some(Largest { difference, time_s, handle, name, quantity, given, exact });
        }
    }

    fn text(&self, name: &str, unit: &str) -> String {
        let Self { values, right, right_to_3, largest } = self;
        // Writing into a String cannot fail.
        let mut text = format!("{name:<11} {right} of {values} are right to {DECIMALS} decimals");
        if right < values {
            let _ = write!(text, ", {right_to_3} to 3");
        }
        if let Some(Largest { difference, time_s, handle, name, quantity, given, exact }) = largest {
            let _ = write!(
                text,
                "; largest difference {} {unit} at {} s, handle {handle} ({name}), {quantity}: {}, exact {}",
                Fixed::<9>(*difference),
                (time_s * 1e6).round() / 1e6,
                Fixed::<6>(*given),
                Fixed::<6>(*exact)
            );
        }
        text
    }
}

/// Whether a number with this difference is right to the given decimals: it is the exact one, rounded in either direction at a tie.
fn is_right(difference: f64, decimals: usize) -> bool {
    /// Rounding of the exact number and of the comparison.
    const ROUNDING: f64 = 1e-11;
    difference <= 0.5 * 0.1_f64.powi(decimals as i32) + ROUNDING
}
