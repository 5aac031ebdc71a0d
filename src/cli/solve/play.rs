//! The part of an answer about the play of the hinges.

use bench_dragon_geometry::clearance::{
    Contact, PlayEnd, TouchingPose, first_possible_touch, first_touching_pose, first_within,
};
use bench_dragon_geometry::dragon::{Dragon, Meter};
use bench_dragon_geometry::number::Fixed;
use serde::Serialize;

use super::WorkArgs;
use super::interrupt;
use crate::config::Config;

/// Share of the work for the search of a pose that touches: one part in so many.
const WITNESS_SHARE: u64 = 5;

/// Which benches touch with loose hinges, and when.
#[derive(Clone, Debug, Serialize)]
pub(super) struct PlayAnswer {
    /// Show time up to which no pose that the play allows touches; null if none touches before the run ends.
    earliest_s: Option<f64>,
    /// The benches that may touch then; null if no more is proved because a pole of some pose might stop or jump.
    earliest_benches: Option<[usize; 2]>,
    /// Show time of a pose that the play allows and that touches; null if none was found. The first such pose is between
    /// `earliest_s` and this time.
    witness_s: Option<f64>,
    witness_benches: Option<[usize; 2]>,
    /// The first contact with all links as long as the play allows; null if there is none.
    taut: Option<TautContact>,
    /// The reason for which an answer is unknown: it took too much work.
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
    /// The answer for benches within a clearance, with the contact without play; `None` for hinges without play.
    pub(super) fn of(config: &Config, nominal: Option<&Contact>, clearance_m: f64, work: WorkArgs) -> Option<Self> {
        let meter = work.meter();
        let dragon = config.lead().metered(&meter);
        let (taut, compact) = (dragon.taut()?, dragon.compact()?);
        let time_s = |travel_m| config.timetable().time_s(travel_m);
        let mut answer = Self {
            earliest_s: None,
            earliest_benches: None,
            witness_s: None,
            witness_benches: None,
            taut: None,
            play_undecided: None,
            play_m: dragon.dimensions().play_m(),
        };
        // All parts share one limit, so that the whole answer takes no longer than any other.
        let [pulled, pushed] = [taut, compact].map(|dragon| contact_of(dragon, clearance_m));
        answer.play_undecided = pulled.as_ref().err().or(pushed.as_ref().err()).cloned();
        let [pulled, pushed] = [pulled, pushed].map(|found| found.ok().flatten());
        answer.taut = pulled.map(|Contact { travel_m, benches, point }| TautContact {
            time_s: time_s(travel_m),
            benches,
            point_m: point.to_array(),
        });
        let own = [nominal.copied(), pulled, pushed].into_iter().flatten();
        let pose = |contact: Contact| TouchingPose { travel_m: contact.travel_m, benches: contact.benches };
        let known = own.min_by(|one, other| one.travel_m.total_cmp(&other.travel_m)).map(pose);
        let searching = Meter::of(meter.left() / WITNESS_SHARE);
        let searched = first_possible_touch(&dragon, clearance_m, dragon.start_travel_m(), dragon.end_travel_m());
        let from_m = match searched {
            Ok(None) => return Some(answer),
            Ok(Some(PlayEnd { travel_m, benches })) => {
                answer.earliest_benches = benches;
                travel_m
            }
            Err(spent) => {
                answer.play_undecided = Some(spent.to_string());
                spent.reached_m
            }
        };
        answer.earliest_s = Some(time_s(from_m));
        let to_m = known.map_or(dragon.end_travel_m(), |known| known.travel_m);
        let found = first_touching_pose(&dragon.metered(&searching), clearance_m, from_m, to_m).ok().flatten();
        let witness = found.or(known);
        answer.witness_s = witness.map(|pose| time_s(pose.travel_m));
        answer.witness_benches = witness.map(|pose| pose.benches);
        Some(answer)
    }

    pub(super) fn text(&self, what: &str) -> String {
        let play_mm = 1000.0 * self.play_m;
        let guaranteed = match (self.earliest_s, self.earliest_benches, &self.play_undecided) {
            (Some(time_s), Some([first, second]), _) => {
                format!(
                    "no pose has a {what} before {} s; then benches {first} and {second} may have one",
                    Fixed::<6>(time_s)
                )
            }
            (Some(time_s), None, Some(reason)) => {
                format!(
                    "no pose has a {what} before {} s; later times are unknown: {reason}{}",
                    Fixed::<6>(time_s),
                    interrupt::allows_more()
                )
            }
            (Some(time_s), None, None) => {
                format!("no pose has a {what} before {} s; then a pole may stop or jump", Fixed::<6>(time_s))
            }
            (None, ..) => format!("no pose has a {what} before the run ends"),
        };
        let witness = match (self.witness_s, self.witness_benches) {
            (Some(time_s), Some([first, second])) => {
                format!("\na pose with a {what} was found at {} s, benches {first} and {second}", Fixed::<6>(time_s))
            }
            _ => String::new(),
        };
        let taut = match &self.taut {
            Some(TautContact { time_s, benches: [first, second], .. }) => {
                format!("{} s, benches {first} and {second}", Fixed::<6>(*time_s))
            }
            None => format!("no {what}"),
        };
        format!("play of {play_mm:.3} mm: {guaranteed}{witness}\npulled taut: {taut}")
    }
}

/// The first contact of a dragon without play within a clearance; otherwise the reason why it is unknown.
fn contact_of(dragon: &Dragon, clearance_m: f64) -> Result<Option<Contact>, String> {
    let (from_m, to_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    first_within(dragon, clearance_m, from_m, to_m).map_err(|spent| spent.to_string())
}
