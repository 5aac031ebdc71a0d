//! The situation of the guard: waiting, working, at its end, or missing.

use bench_dragon_geometry::clearance::{PairClearance, PlayEnd};
use bench_dragon_ipc::{FrameHeader, GuardState, ShowState, Status, Stop, TimecodeState};
use serde::Serialize;

/// The situation of the guard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum GuardSituation {
    /// The source is not guarded.
    #[default]
    None,
    /// A guard runs, and the head stands until the next grant, for example before the first one.
    Waiting,
    /// A guard runs, and granted travel lies ahead of the head.
    Working,
    /// The head stands at the end of the proven travel: further on, two benches come nearer than the margin, or a board
    /// too near to a border.
    AtEnd {
        /// Whether only a seek can move the dragon. Timecode can move it too, so under timecode this is false.
        for_good: bool,
    },
    /// No guard runs: it has died, or was never started. The head stops at the end of its last grant.
    Missing,
}

impl GuardSituation {
    /// Derives the situation from a source's status, the newest frame of its run, that frame's nearest pair, the guard's margin,
    /// the end of the proof about loose hinges, and whether a board is too near to a border of the stage.
    pub(super) fn of(
        status: &Status,
        header: &FrameHeader,
        nearest: Option<PairClearance>,
        margin_m: f64,
        play_end: Option<PlayEnd>,
        is_near_border: impl FnOnce() -> bool,
    ) -> Self {
        match status.guard_state() {
            None | Some(GuardState::None) => return Self::None,
            Some(GuardState::Missing) => return Self::Missing,
            Some(GuardState::Running) => {}
        }
        let stops = status.stops();
        if !stops.has(Stop::GuardLimit) || stops.has(Stop::RunEnd) || header.show_state().is_some_and(ShowState::walks)
        {
            return Self::Working;
        }
        let is_final = status.guard_end().is_some_and(|end_m| header.course_m >= end_m);
        // The guard grants no travel to a head that was repositioned where the clearance is below the margin, or may be in some pose
        // of loose hinges.
        let is_refused = nearest.is_some_and(|pair| pair.clearance_m < margin_m);
        let is_unproved = play_end.is_some_and(|end| end.travel_m <= header.course_m);
        if is_final || is_refused || is_unproved || is_near_border() {
            let for_good = status.timecode_state() == Some(TimecodeState::None);
            return Self::AtEnd { for_good };
        }
        Self::Waiting
    }

    /// Lower-case name, as in its JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Waiting => "waiting",
            Self::Working => "working",
            Self::AtEnd { .. } => "at_end",
            Self::Missing => "missing",
        }
    }
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::Stops;

    use super::*;

    fn status(guard: GuardState, stops: Stops, guard_end_m: f64, timecode: TimecodeState) -> Status {
        Status {
            guard: guard.to_wire(),
            stops: stops.to_wire(),
            guard_end_m,
            timecode: timecode.to_wire(),
            ..Status::default()
        }
    }

    #[test]
    fn a_waiting_working_ended_or_dead_guard_is_a_situation_each() {
        let held = FrameHeader { course_m: 30.0, state: ShowState::Held.to_wire(), ..FrameHeader::default() };
        let at_limit = Stops::from([Stop::GuardLimit]);
        let at_run_end = Stops::from([Stop::GuardLimit, Stop::RunEnd]);
        let (none, running) = (TimecodeState::None, GuardState::Running);
        for (status, expected) in vec![
            (status(GuardState::None, at_limit, f64::NAN, none), GuardSituation::None),
            (status(GuardState::Missing, at_limit, 30.0, none), GuardSituation::Missing),
            (status(running, at_limit, f64::NAN, none), GuardSituation::Waiting),
            (status(running, at_limit, 40.0, none), GuardSituation::Waiting),
            (status(running, Stops::default(), f64::NAN, none), GuardSituation::Working),
            (status(running, at_limit, 30.0, none), GuardSituation::AtEnd { for_good: true }),
            (status(running, at_limit, 30.0, TimecodeState::Locked), GuardSituation::AtEnd { for_good: false }),
            (status(running, at_limit, 30.0, TimecodeState::Lost), GuardSituation::AtEnd { for_good: false }),
            (status(running, at_run_end, 30.0, none), GuardSituation::Working),
        ] {
            assert_eq!(
                GuardSituation::of(&status, &held, None, 0.0005, None, || false),
                expected,
                "{:?}",
                status.stops()
            );
        }
    }

    #[test]
    fn a_head_repositioned_below_the_margin_gets_no_grant() {
        let held = FrameHeader { state: ShowState::Held.to_wire(), ..FrameHeader::default() };
        let stops = Stops::from([Stop::GuardLimit]);
        let status = status(GuardState::Running, stops, f64::NAN, TimecodeState::None);
        let pair = PairClearance { benches: [0, 8], clearance_m: 0.0004, point: glam::DVec2::ZERO };
        let situation = GuardSituation::of(&status, &held, Some(pair), 0.0005, None, || false);
        assert_eq!(situation, GuardSituation::AtEnd { for_good: true });
    }

    #[test]
    fn a_head_repositioned_too_near_to_a_border_gets_no_grant() {
        let held = FrameHeader { state: ShowState::Held.to_wire(), ..FrameHeader::default() };
        let status = status(GuardState::Running, Stops::from([Stop::GuardLimit]), f64::NAN, TimecodeState::None);
        let situation = |is_near| GuardSituation::of(&status, &held, None, 0.0005, None, || is_near);
        assert_eq!(situation(true), GuardSituation::AtEnd { for_good: true });
        assert_eq!(situation(false), GuardSituation::Waiting);
    }

    #[test]
    fn a_head_repositioned_where_a_pose_may_touch_gets_no_grant() {
        let held = FrameHeader { course_m: 30.0, state: ShowState::Held.to_wire(), ..FrameHeader::default() };
        let stops = Stops::from([Stop::GuardLimit]);
        let status = status(GuardState::Running, stops, f64::NAN, TimecodeState::None);
        let far = PairClearance { benches: [0, 8], clearance_m: 0.02, point: glam::DVec2::ZERO };
        let situation = |travel_m| {
            let end = PlayEnd { travel_m, benches: Some([0, 9]) };
            GuardSituation::of(&status, &held, Some(far), 0.0005, Some(end), || false)
        };
        assert_eq!(situation(30.0), GuardSituation::AtEnd { for_good: true });
        assert_eq!(situation(31.0), GuardSituation::Waiting);
    }
}
