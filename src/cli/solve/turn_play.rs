//! The play of the hinges on a passage through a turn.

use bench_dragon_geometry::clearance::{PlayEnd, first_possible_touch};
use bench_dragon_geometry::dragon::{Dimensions, Meter};
use bench_dragon_geometry::number::Fixed;
use bench_dragon_geometry::planner::{Infeasible, PlannedTurn, passage_through};
use serde::Serialize;

/// The poses that the play of the hinges allows, on the whole passage.
#[derive(Serialize)]
pub(super) struct TurnPlay {
    /// Show time up to which no pose comes within the clearance; null if none does on the whole passage.
    earliest_s: Option<f64>,
    earliest_benches: Option<[usize; 2]>,
    /// The reason for which the answer is unknown.
    play_undecided: Option<String>,
}

impl TurnPlay {
    pub(super) fn of(end: Result<Option<PlayEnd>, Infeasible>, time_s: impl Fn(f64) -> f64) -> Self {
        let (end, play_undecided) = match end {
            Ok(end) => (end, None),
            Err(error) => (None, Some(error.to_string())),
        };
        let earliest_s = end.map(|end| time_s(end.travel_m));
        Self { earliest_s, earliest_benches: end.and_then(|end| end.benches), play_undecided }
    }

    pub(super) fn text(&self) -> String {
        match (self.earliest_s, self.earliest_benches, &self.play_undecided) {
            (.., Some(reason)) => format!("unknown: {reason}"),
            (Some(time_s), Some([first, second]), _) => {
                format!(
                    "a pose of benches {first} and {second} may come too near at {} s, none before",
                    Fixed::<6>(time_s)
                )
            }
            (Some(time_s), None, _) => {
                format!("no pose comes too near before {} s; then a pole may stop or jump", Fixed::<6>(time_s))
            }
            (None, ..) => "no pose that it allows comes too near".to_owned(),
        }
    }
}

/// Where a pose that the play of the hinges allows may first come within a clearance on the whole passage; `None` if none does.
pub(super) fn earliest_on_passage(
    turn: PlannedTurn,
    dimensions: Dimensions,
    clearance_m: f64,
    meter: &Meter,
) -> Result<Option<PlayEnd>, Infeasible> {
    let dragon = passage_through(turn, dimensions, meter)?;
    let (from_m, to_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    Ok(first_possible_touch(&dragon, clearance_m, from_m, to_m)?)
}
