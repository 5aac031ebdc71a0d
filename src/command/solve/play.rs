//! The part of an answer about the play of the hinges.

use bench_dragon_geometry::clearance::{Contact, PlayEnd, first_possible_touch, first_within};
use serde::Serialize;

use super::WorkArgs;
use crate::config::Config;

/// Which benches touch with loose hinges, and when.
#[derive(Clone, Debug, Serialize)]
pub(super) struct PlayAnswer {
    /// Show time up to which no pose that the play allows touches; null if none touches before the run ends.
    earliest_s: Option<f64>,
    /// The benches that may touch then; null if no more is proved because a pole of some pose might stop or jump.
    earliest_benches: Option<[usize; 2]>,
    /// The first contact with all links as long as the play allows; null if there is none.
    taut: Option<TautContact>,
    /// The reason for which an answer is unknown: it took too much work.
    #[serde(skip_serializing_if = "Option::is_none")]
    play_undecided: Option<String>,
    /// How far a hole may be from its pole.
    play_m: f64,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct TautContact {
    time_s: f64,
    benches: [usize; 2],
    point_m: [f64; 2],
}

impl PlayAnswer {
    /// The answer for benches within a clearance; `None` for hinges without play.
    pub(super) fn of(config: &Config, clearance_m: f64, work: WorkArgs) -> Option<Self> {
        let dragon = config.dragon().metered(&work.meter());
        let taut = dragon.taut()?;
        let time_s = |travel_m| config.timetable().time_s(travel_m);
        let mut answer = Self {
            earliest_s: None,
            earliest_benches: None,
            taut: None,
            play_undecided: None,
            play_m: dragon.dimensions().play_m(),
        };
        match first_possible_touch(&dragon, clearance_m, dragon.start_travel_m(), dragon.end_travel_m()) {
            Ok(Some(PlayEnd { travel_m, benches })) => {
                (answer.earliest_s, answer.earliest_benches) = (Some(time_s(travel_m)), benches);
            }
            Ok(None) => {}
            Err(spent) => {
                answer.earliest_s = Some(time_s(spent.reached_m));
                answer.play_undecided = Some(spent.to_string());
            }
        }
        match first_within(&taut.metered(&work.meter()), clearance_m, taut.start_travel_m(), taut.end_travel_m()) {
            Ok(contact) => {
                answer.taut = contact.map(|Contact { travel_m, benches, point }| TautContact {
                    time_s: time_s(travel_m),
                    benches,
                    point_m: point.to_array(),
                });
            }
            Err(spent) => answer.play_undecided = Some(spent.to_string()),
        }
        Some(answer)
    }

    pub(super) fn text(&self, what: &str) -> String {
        let play_mm = 1000.0 * self.play_m;
        let guaranteed = match (self.earliest_s, self.earliest_benches, &self.play_undecided) {
            (Some(time_s), Some([first, second]), _) => {
                format!("no pose has a {what} before {time_s:.6} s; then benches {first} and {second} may have one")
            }
            (Some(time_s), None, Some(reason)) => {
                format!(
                    "no pose has a {what} before {time_s:.6} s; later times are unknown: {reason}; --work allows more"
                )
            }
            (Some(time_s), None, None) => {
                format!("no pose has a {what} before {time_s:.6} s; then a pole may stop or jump")
            }
            (None, ..) => format!("no pose has a {what} before the run ends"),
        };
        let taut = match &self.taut {
            Some(TautContact { time_s, benches: [first, second], .. }) => {
                format!("{time_s:.6} s, benches {first} and {second}")
            }
            None => format!("no {what}"),
        };
        format!("play of {play_mm:.3} mm: {guaranteed}\npulled taut: {taut}")
    }
}
