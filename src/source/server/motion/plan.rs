//! The settings of a motion, and its results.

use std::sync::Arc;

use bench_dragon_ipc::{Request, RunStart, ShowState};

use crate::config::Config;

#[cfg(doc)]
use super::Motion;

/// Settings of a motion, not yet checked.
#[expect(clippy::struct_excessive_bools, reason = "independent settings")]
#[derive(Clone, Debug, PartialEq)]
pub struct MotionSettings {
    /// Planned speed of the head, above 0, in metres per show second.
    pub speed_mps: f64,
    /// Greatest acceleration of the head, above 0, in m/s²; without one it starts and stops at once.
    pub accel_mps2: Option<f64>,
    /// Whether the timetables of a plan have the ramps at its ends. Then the walk starts and stops there at once.
    pub has_planned_ends: bool,
    /// Places at which the show waits until [`Request::Go`], in their order. The plan itself rests there.
    pub waits_m: Arc<[f64]>,
    /// Show seconds that one running tick advances, until [`Motion::set_tick`].
    pub tick_s: f64,
    /// Show time at tick 0.
    pub start_s: f64,
    /// Travel at tick 0, in metres.
    pub start_travel_m: f64,
    /// Speed to walk at from tick 0 on, from 0 to [`Request::MAX_SPEED_MPS`], in metres per show second.
    pub start_speed_mps: f64,
    /// Show time of the run's start, the earliest for a seek.
    pub first_s: f64,
    /// Show time of the run's end at the planned speed, the latest for a seek.
    pub last_s: f64,
    /// Travel at which the run ends, in metres.
    pub end_travel_m: f64,
    /// Show time at which the show ends, if it has not ended before.
    pub until_s: Option<f64>,
    /// Whether the show stands finished at that time, instead of ending.
    pub stays: bool,
    /// Whether tick 0 is held.
    pub is_held: bool,
    /// Whether the show waits at its start for its first release.
    pub is_ready: bool,
    /// Whether the server was restarted, which is then the cause of the hold.
    pub is_restarted: bool,
    /// Whether tick 0 is paused, or will be once the hold is lifted.
    pub is_paused: bool,
    /// Number of the run whose guard must grant travel to the head; without one the head walks freely.
    pub guarded_run: Option<u64>,
    /// Missed periods up to which the show jumps at once; after a longer standstill it catches up slowly.
    pub most_jumped: u64,
}

impl MotionSettings {
    /// Settings of a run at 1 m/s between two travels, with no other options. It jumps all missed periods.
    pub fn plain(tick_s: f64, start_travel_m: f64, end_travel_m: f64) -> Self {
        Self {
            speed_mps: 1.0,
            accel_mps2: None,
            has_planned_ends: false,
            waits_m: Arc::default(),
            tick_s,
            start_s: start_travel_m,
            start_travel_m,
            start_speed_mps: 1.0,
            first_s: start_travel_m,
            last_s: end_travel_m,
            end_travel_m,
            until_s: None,
            stays: false,
            is_held: false,
            is_ready: false,
            is_restarted: false,
            is_paused: false,
            guarded_run: None,
            most_jumped: u64::MAX,
        }
    }
}

/// Checked settings: finite values in the ranges that [`MotionSettings`] states.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionPlan(MotionSettings);

/// Error of a setting that is out of range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{name} of a motion is {value}, must be {allowed}")]
pub struct MotionPlanError {
    name: &'static str,
    value: f64,
    allowed: &'static str,
}

impl MotionPlan {
    /// Checks the settings.
    ///
    /// # Errors
    /// The first value that is out of range.
    pub fn new(settings: MotionSettings) -> Result<Self, MotionPlanError> {
        let MotionSettings { speed_mps, accel_mps2, tick_s, start_s, start_travel_m, start_speed_mps, .. } = settings;
        let MotionSettings { first_s, last_s, end_travel_m, until_s, .. } = settings;
        let is_finite: fn(f64) -> bool = f64::is_finite;
        let is_above_0: fn(f64) -> bool = |value| value.is_finite() && value > 0.0;
        let is_speed: fn(f64) -> bool = |value| (0.0..=Request::MAX_SPEED_MPS).contains(&value);
        for (name, value, is_allowed, allowed) in [
            ("speed_mps", speed_mps, is_above_0, "finite and above 0"),
            ("accel_mps2", accel_mps2.unwrap_or(1.0), is_above_0, "finite and above 0"),
            ("tick_s", tick_s, is_above_0, "finite and above 0"),
            ("start_s", start_s, is_finite, "finite"),
            ("first_s", first_s, is_finite, "finite"),
            ("until_s", until_s.unwrap_or(0.0), is_finite, "finite"),
            ("travel_m", start_travel_m, is_finite, "finite"),
            ("end_travel_m", end_travel_m, is_finite, "finite"),
            ("start_speed_mps", start_speed_mps, is_speed, "from 0 to the greatest speed of a command"),
        ] {
            if !is_allowed(value) {
                return Err(MotionPlanError { name, value, allowed });
            }
        }
        if !last_s.is_finite() || last_s < first_s {
            return Err(MotionPlanError { name: "last_s", value: last_s, allowed: "finite and at least first_s" });
        }
        Ok(Self(settings))
    }

    /// Returns the plan of a server's run.
    ///
    /// # Errors
    /// As [`MotionPlan::new`].
    pub fn of_run(config: &Config, start: &RunStart, run_id: u64) -> Result<Self, MotionPlanError> {
        Self::new(MotionSettings {
            speed_mps: config.tables().head.speed_mps,
            accel_mps2: config.accel_mps2(),
            has_planned_ends: config.formation().has_plan_course(),
            waits_m: config.waits_m(),
            tick_s: config.tick_s(),
            start_s: start.start_s,
            start_travel_m: start.travel_m,
            start_speed_mps: start.speed_mps,
            first_s: config.start_s(),
            last_s: config.last_seek_s(),
            end_travel_m: config.formation().end_m(),
            until_s: start.until_s,
            stays: start.stays,
            is_held: start.is_held,
            is_ready: start.is_ready,
            is_restarted: start.is_restarted,
            is_paused: start.is_paused,
            guarded_run: start.is_guarded.then_some(run_id),
            most_jumped: config.most_jumped(),
        })
    }

    pub(super) fn settings(self) -> MotionSettings {
        self.0
    }
}

/// The head at one tick. Of several dragons, this is the place and the speed of the show on its course.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadState {
    /// Show time in nanoseconds.
    pub show_time_ns: i64,
    /// Signed arc length walked since t = 0, in metres.
    pub travel_m: f64,
    /// Speed in metres per show second; 0 where the head stands.
    pub speed_mps: f64,
    /// State of the show.
    pub state: ShowState,
}

/// Limits of a guarded head, for its guard. Without a guard all are `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// Travel up to which the head may walk, in metres.
    pub granted_to_m: Option<f64>,
    /// Travel that a refused seek requested and that no guard has proved yet, in metres.
    pub asked_m: Option<f64>,
    /// Travel at which the proven travel ends permanently, in metres; `None` where the guard has not reached it.
    pub end_m: Option<f64>,
}
