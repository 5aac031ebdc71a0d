//! The next event of the show: a contact, a stop by the guard, or a rest.

use bench_dragon_geometry::clearance::{Contact, PlayEnd};
use bench_dragon_ipc::{GuardState, ShowState, Status};
use serde::Serialize;

use super::head_motion::{Arrival, HeadMotion};
use crate::safety::forecast::Forecast;

/// The next event of the show. For a standing head, the event after it walks on.
///
/// The JSON form has a `kind`, and the [`Arrival`]'s fields beside the others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ShowForecast {
    /// No forecast exists, or the head is at the end of the run.
    #[default]
    Unknown,
    /// No contact and no stop by the guard occurs up to this arrival. The search may continue.
    Free {
        /// The arrival up to which this is proved.
        #[serde(flatten)]
        to: Arrival,
        /// Whether this is the end of the run.
        is_end: bool,
    },
    /// Two benches touch.
    Contact {
        /// The head's arrival at the contact.
        #[serde(flatten)]
        at: Arrival,
        /// The two benches, the lower index first.
        benches: [usize; 2],
    },
    /// The guard stops the head before two benches are nearer than the margin.
    GuardStop {
        /// The head's arrival at the place of rest.
        #[serde(flatten)]
        at: Arrival,
        /// The two benches, the lower index first; `None` if no guard runs, so that the head stops at the end of its grants.
        benches: Option<[usize; 2]>,
    },
    /// The head brakes and comes to rest, because of a pause, a hold, a stop or the timecode.
    Rest {
        /// The head's arrival at the place of rest.
        #[serde(flatten)]
        at: Arrival,
    },
}

impl ShowForecast {
    /// Derives the next event from a forecast and the head's motion, for a run that ends at the travel `end_m`. `guarded` is
    /// the status of a guarded server. With it, the forecast searches for the guard's margin; without it, for contacts. `border_m` is
    /// where a board comes too near to a border that the guard keeps clear.
    pub(super) fn of(
        forecast: &Forecast,
        motion: &HeadMotion,
        state: Option<ShowState>,
        end_m: f64,
        guarded: Option<&Status>,
        border_m: Option<f64>,
    ) -> Self {
        match state {
            Some(ShowState::Stopping) => return Self::of_stopping(forecast, motion, end_m, guarded),
            Some(ShowState::Finished | ShowState::Ended) => return Self::Unknown,
            // A head that is held at the end of the run has nothing ahead.
            _ if motion.clock.travel_m >= end_m => return Self::Unknown,
            _ => {}
        }
        let abandoned = guarded.filter(|status| status.guard_state() == Some(GuardState::Missing));
        if let Some(status) = abandoned.filter(|status| status.granted_to_m < end_m) {
            return Self::GuardStop { at: motion.resting_at(status.granted_to_m), benches: None };
        }
        if !forecast.covers(motion.clock.travel_m) {
            return Self::Unknown;
        }
        if let Some(status) = guarded
            && let Some(PlayEnd { travel_m, benches }) = violation(forecast, border_m, motion.clock.travel_m)
        {
            let rest_m = status.guard_end().filter(|end_m| *end_m < travel_m).unwrap_or(travel_m);
            let at = motion.resting_at(rest_m);
            // Without benches, a pole might stop there, or a board is near a border.
            return if benches.is_some() { Self::GuardStop { at, benches } } else { Self::Rest { at } };
        }
        if let Some(contact) = forecast.contact.filter(|_| guarded.is_none()) {
            return Self::Contact { at: motion.passing(contact.travel_m), benches: contact.benches };
        }
        let play_m = forecast.play.filter(|_| guarded.is_some()).map_or(f64::INFINITY, |play| play.free_to_m);
        let free_to_m = forecast.free_to_m.min(play_m);
        let (to_m, is_end) = (free_to_m.max(motion.clock.travel_m), free_to_m >= end_m);
        Self::Free { to: if is_end { motion.ending_at(to_m) } else { motion.passing(to_m) }, is_end }
    }

    /// The same of a run that ends at a show time, however far the head has walked.
    pub(super) fn until(self, until_s: f64, motion: &HeadMotion) -> Self {
        match self.arrival().filter(|at| at.time_s > until_s) {
            Some(later) => Self::Free { to: motion.passing(motion.travel_at_m(until_s, later.travel_m)), is_end: true },
            None => self,
        }
    }

    /// The head's arrival where a pose that the play of the hinges allows may touch first, if that is ahead.
    pub(super) fn possible_contact(
        forecast: &Forecast,
        motion: &HeadMotion,
        state: Option<ShowState>,
    ) -> Option<Arrival> {
        let is_over = state == Some(ShowState::Ended) || !forecast.covers(motion.clock.travel_m);
        let possible = forecast.possible_touch().filter(|end| !is_over && end.travel_m >= motion.clock.travel_m);
        possible.map(|end| motion.passing(end.travel_m))
    }

    /// The next event of a braking head. A contact counts only if it occurs before the rest. Granted travel has no contact.
    fn of_stopping(forecast: &Forecast, motion: &HeadMotion, end_m: f64, guarded: Option<&Status>) -> Self {
        let at = motion.braking(end_m.min(guarded.map_or(f64::INFINITY, |status| status.granted_to_m)));
        let contact = forecast.contact.filter(|_| guarded.is_none() && forecast.covers(motion.clock.travel_m));
        match contact.filter(|contact| contact.travel_m <= at.travel_m) {
            Some(contact) => Self::Contact { at: motion.passing_braking(contact.travel_m), benches: contact.benches },
            None => Self::Rest { at },
        }
    }

    /// Show time of the contact ahead, in seconds; `None` if the next event is no contact.
    pub fn contact_s(&self) -> Option<f64> {
        if let Self::Contact { at, .. } = self { Some(at.time_s) } else { None }
    }

    /// The two benches that touch, or before which the guard stops the head.
    pub fn benches(&self) -> Option<[usize; 2]> {
        match *self {
            Self::Contact { benches, .. } => Some(benches),
            Self::GuardStop { benches, .. } => benches,
            Self::Unknown | Self::Free { .. } | Self::Rest { .. } => None,
        }
    }

    /// The arrival at the event, or for `Free`, the arrival up to which the search is complete.
    pub fn arrival(&self) -> Option<Arrival> {
        match *self {
            Self::Unknown => None,
            Self::Free { to, .. } => Some(to),
            Self::Contact { at, .. } | Self::GuardStop { at, .. } | Self::Rest { at } => Some(at),
        }
    }
}

/// Where the guard's proof ends: at the first pair of boards within its margin, in any pose that the hinges allow, or at a border that is
/// ahead of a place.
fn violation(forecast: &Forecast, border_m: Option<f64>, here_m: f64) -> Option<PlayEnd> {
    let nominal =
        forecast.contact.map(|Contact { travel_m, benches, .. }| PlayEnd { travel_m, benches: Some(benches) });
    let border = border_m.filter(|&at_m| at_m >= here_m).map(|travel_m| PlayEnd { travel_m, benches: None });
    let ends = forecast.play_end().into_iter().chain(nominal).chain(border);
    ends.min_by(|one, other| one.travel_m.total_cmp(&other.travel_m))
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::FrameHeader;
    use glam::DVec2;
    use serde_json::json;

    use super::*;
    use crate::display::observe::TravelClock;
    use crate::safety::forecast::PlayForecast;

    /// A head at 10 m and 10 s of show time, at 1 m per show second, a time scale of 5, with 0.25 m/s².
    fn motion() -> HeadMotion {
        let header = FrameHeader { course_mps: 1.0, time_scale: 5.0, ..FrameHeader::default() };
        HeadMotion::new(&header, TravelClock { travel_m: 10.0, time_s: 10.0, speed_mps: 1.0 }, Some(0.25), None)
    }

    fn forecast(contact_m: Option<f64>) -> Forecast {
        let contact = contact_m.map(|travel_m| Contact { travel_m, benches: [0, 8], point: DVec2::ZERO });
        Forecast { from_m: 0.0, free_to_m: contact_m.unwrap_or(50.0), contact, play: None }
    }

    fn ahead(contact_m: Option<f64>, state: ShowState, guarded: Option<&Status>) -> ShowForecast {
        ShowForecast::of(&forecast(contact_m), &motion(), Some(state), 50.0, guarded, None)
    }

    fn guarded(guard: GuardState, granted_to_m: f64, guard_end_m: f64) -> Status {
        Status { guard: guard.to_wire(), granted_to_m, guard_end_m, ..Status::default() }
    }

    #[test]
    fn the_time_until_a_contact_is_wall_time() {
        let ahead = ahead(Some(13.7), ShowState::Running, None);
        let ShowForecast::Contact { at, benches: [0, 8] } = ahead else { panic!("{ahead:?}") };
        assert!((at.time_s - 13.7).abs() < 1e-12 && (at.wall_s - 0.74).abs() < 1e-12, "{at:?}");
    }

    #[test]
    fn a_guard_stops_before_a_possible_contact_and_otherwise_both_are_shown() {
        let end = Some(PlayEnd { travel_m: 12.5, benches: Some([0, 9]) });
        let loose = Forecast { play: Some(PlayForecast { free_to_m: 12.5, end }), ..forecast(Some(13.7)) };
        let of = |guarded| ShowForecast::of(&loose, &motion(), Some(ShowState::Running), 50.0, guarded, None);
        assert!(matches!(of(None), ShowForecast::Contact { benches: [0, 8], .. }));
        let possible = ShowForecast::possible_contact(&loose, &motion(), Some(ShowState::Running)).expect("one");
        assert_eq!((possible.travel_m, possible.time_s), (12.5, 12.5));
        let status = guarded(GuardState::Running, 12.0, f64::NAN);
        let ShowForecast::GuardStop { at, benches } = of(Some(&status)) else { panic!("{:?}", of(Some(&status))) };
        assert_eq!((at.travel_m, benches), (12.5, Some([0, 9])));
    }

    #[test]
    fn a_stopping_head_has_a_contact_only_before_its_rest() {
        let rest = ahead(Some(13.0), ShowState::Stopping, None);
        assert_eq!(rest, ShowForecast::Rest { at: Arrival { travel_m: 12.0, time_s: 14.0, wall_s: 0.8 } });
        let contact = ahead(Some(11.5), ShowState::Stopping, None);
        assert_eq!(contact.contact_s(), Some(12.0));
        let at_grants_end = ahead(None, ShowState::Stopping, Some(&guarded(GuardState::Running, 11.0, Status::NONE)));
        assert_eq!(at_grants_end.arrival().map(|at| at.travel_m), Some(11.0));
    }

    #[test]
    fn a_run_that_is_over_has_no_forecast() {
        assert_eq!(ahead(None, ShowState::Finished, None), ShowForecast::Unknown);
        let held_at_end = ShowForecast::of(&forecast(None), &motion(), Some(ShowState::Held), 10.0, None, None);
        assert_eq!(held_at_end, ShowForecast::Unknown);
        assert_eq!(ahead(Some(13.0), ShowState::Ended, None), ShowForecast::Unknown);
    }

    #[test]
    fn a_guarded_head_has_a_stop_ahead_instead_of_a_contact() {
        let stop = ahead(Some(20.0), ShowState::Running, Some(&guarded(GuardState::Running, 11.5, Status::NONE)));
        // Eight metres at walking speed, and two metres of braking in four seconds.
        let at = Arrival { travel_m: 20.0, time_s: 22.0, wall_s: 2.4 };
        assert_eq!(stop, ShowForecast::GuardStop { at, benches: Some([0, 8]) });
        let known = ahead(Some(20.0), ShowState::Running, Some(&guarded(GuardState::Running, 19.0, 19.0)));
        assert_eq!(known.arrival().map(|at| at.travel_m), Some(19.0));
        let free = ahead(None, ShowState::Running, Some(&guarded(GuardState::Running, 11.5, Status::NONE)));
        assert!(matches!(free, ShowForecast::Free { is_end: true, .. }), "{free:?}");
    }

    #[test]
    fn a_guarded_head_rests_before_a_border_that_is_ahead() {
        let status = guarded(GuardState::Running, 11.5, Status::NONE);
        let of = |contact_m, border_m, guarded| {
            ShowForecast::of(&forecast(contact_m), &motion(), Some(ShowState::Running), 50.0, guarded, border_m)
        };
        let rest_m = |ahead: ShowForecast| match ahead {
            ShowForecast::Rest { at } => Some(at.travel_m),
            _ => None,
        };
        assert_eq!(rest_m(of(None, Some(20.0), Some(&status))), Some(20.0));
        assert_eq!(rest_m(of(Some(30.0), Some(20.0), Some(&status))), Some(20.0));
        assert_eq!(rest_m(of(Some(15.0), Some(20.0), Some(&status))), None, "a pair is nearer");
        assert_eq!(rest_m(of(None, Some(5.0), Some(&status))), None, "it is behind");
        assert_eq!(rest_m(of(None, Some(20.0), None)), None, "nothing stops there");
    }

    #[test]
    fn without_its_guard_a_head_stops_at_the_end_of_its_grants() {
        let stop = ahead(Some(40.0), ShowState::Running, Some(&guarded(GuardState::Missing, 15.0, Status::NONE)));
        let ShowForecast::GuardStop { at, benches: None } = stop else { panic!("{stop:?}") };
        assert_eq!((at.travel_m, at.wall_s), (15.0, 1.4));
        let whole = ahead(None, ShowState::Running, Some(&guarded(GuardState::Missing, 50.0, 50.0)));
        assert!(matches!(whole, ShowForecast::Free { is_end: true, .. }), "{whole:?}");
    }

    #[test]
    fn the_json_form_has_the_arrival_beside_the_kind() {
        let json = serde_json::to_value(ahead(Some(15.0), ShowState::Running, None)).expect("JSON");
        let expected = json!({ "kind": "contact", "travel_m": 15.0, "time_s": 15.0, "wall_s": 1.0, "benches": [0, 8] });
        assert_eq!(json, expected);
        assert_eq!(serde_json::to_value(ShowForecast::Unknown).expect("JSON")["kind"], "unknown");
    }
}
