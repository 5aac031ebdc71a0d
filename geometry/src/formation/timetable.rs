//! The head's timetable: its travel at each time, on a run without commands.

use std::sync::Arc;

use super::even_run::EvenRun;
use super::planned_walk::PlannedWalk;

/// Travel of the head over time, in seconds. It is continuous and never falls.
#[derive(Clone, Debug, PartialEq)]
pub struct Timetable(Walk);

#[derive(Clone, Debug, PartialEq)]
enum Walk {
    /// One planned speed.
    Even(EvenRun),
    /// A planned speed that changes.
    Pieces(Arc<PlannedWalk>),
}

/// Growth of the time at which the head reaches a travel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TimeRates {
    /// Speed of the head there, in m/s: the time grows by 1 ÷ the speed per metre.
    pub(crate) speed_mps: f64,
    /// Seconds per m/s of planned speed, at fixed travel.
    pub(crate) per_speed: f64,
    /// Seconds per m/s² of the ramps, at fixed travel; 0 without ramps.
    pub(crate) per_accel: f64,
}

/// A planned change of a walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// The head walks at another speed from a time on, after a ramp. It stands at speed 0.
    Speed {
        /// The time in seconds.
        at_s: f64,
        /// The speed in metres per second.
        speed_mps: f64,
    },
    /// The head stands at a time. It brakes before, and leaves at once. Without a largest acceleration, it passes.
    Rest {
        /// The time in seconds.
        at_s: f64,
    },
}

impl Change {
    /// Its time in seconds.
    pub fn at_s(&self) -> f64 {
        match *self {
            Self::Speed { at_s, .. } | Self::Rest { at_s } => at_s,
        }
    }

    /// The speed from here on; `None` for a rest.
    pub(super) fn speed_mps(&self) -> Option<f64> {
        match *self {
            Self::Speed { speed_mps, .. } => Some(speed_mps),
            Self::Rest { .. } => None,
        }
    }

    pub(super) fn delayed(self, delay_s: f64) -> Self {
        match self {
            Self::Speed { at_s, speed_mps } => Self::Speed { at_s: at_s + delay_s, speed_mps },
            Self::Rest { at_s } => Self::Rest { at_s: at_s + delay_s },
        }
    }
}

impl Timetable {
    /// A run that begins at a time and ends at a travel. It begins at the travel that the planned speed gives: `speed_mps`
    /// × `start_s`. The speed, and the acceleration if there is one, must be above 0.
    ///
    /// ```
    /// use bench_dragon_geometry::formation::Timetable;
    ///
    /// // 2 s and 1 m to reach 1 m/s, 8 s at it, and 2 s to rest.
    /// let timetable = Timetable::new(1.0, Some(0.5), 0.0, 10.0);
    /// assert_eq!((timetable.time_s(1.0), timetable.time_s(9.0), timetable.time_s(10.0)), (2.0, 10.0, 12.0));
    /// assert_eq!((timetable.travel_m(1.0), timetable.speed_mps(1.0)), (0.25, 0.5));
    /// ```
    pub fn new(speed_mps: f64, accel_mps2: Option<f64>, start_s: f64, end_travel_m: f64) -> Self {
        Self(Walk::Even(EvenRun::with_offset(0.0, speed_mps, accel_mps2, start_s, end_travel_m)))
    }

    /// A run from `start_m`, which the head leaves at `start_s`. Before, it stands there.
    pub fn leaving(start_s: f64, start_m: f64, speed_mps: f64, accel_mps2: Option<f64>, end_travel_m: f64) -> Self {
        let offset_m = start_m - speed_mps * start_s;
        Self(Walk::Even(EvenRun::with_offset(offset_m, speed_mps, accel_mps2, start_s, end_travel_m)))
    }

    /// The same with planned changes, in the order of their times, from one travel to another.
    ///
    /// ```
    /// use bench_dragon_geometry::formation::{Change, Timetable};
    ///
    /// // From 5 s on it slows down from 2 m/s to 1 m/s. It rests at 10 s, after 2·5 + 1.5·1 + 3 + 0.5 m, and ends 20 m from its start.
    /// let changes = [Change::Speed { at_s: 5.0, speed_mps: 1.0 }, Change::Rest { at_s: 10.0 }];
    /// let timetable = Timetable::leaving(0.0, 0.0, 2.0, Some(1.0), 20.0).with_changes(&changes, [0.0, 20.0]);
    /// assert_eq!((timetable.travel_m(5.0), timetable.travel_m(10.0), timetable.speed_mps(10.0)), (8.0, 13.0, 0.0));
    /// assert_eq!((timetable.speed_mps(11.0), timetable.end_s(), timetable.travel_m(99.0)), (1.0, 18.0, 20.0));
    /// ```
    #[must_use]
    pub fn with_changes(&self, changes: &[Change], [start_m, end_m]: [f64; 2]) -> Self {
        if let Walk::Even(run) = &self.0
            && changes.is_empty()
        {
            return Self(Walk::Even(run.ending_at(end_m)));
        }
        let begin = [self.start_s(), start_m];
        let walk = PlannedWalk::new(begin, self.planned_mps(), self.accel_mps2(), changes, end_m);
        Self(Walk::Pieces(Arc::new(walk)))
    }

    /// The same run, which begins later by `delay_s`, or earlier if it is below 0. Its changes move with it.
    #[must_use]
    pub fn delayed(&self, delay_s: f64) -> Self {
        Self(match &self.0 {
            Walk::Even(run) => Walk::Even(run.delayed(delay_s)),
            Walk::Pieces(walk) => Walk::Pieces(Arc::new(walk.delayed(delay_s))),
        })
    }

    /// Time at which the head reaches a travel; where it stands, the time at which it arrives. With ramps or changes, a travel beyond
    /// an end of the run counts as that end.
    pub fn time_s(&self, travel_m: f64) -> f64 {
        match &self.0 {
            Walk::Even(run) => run.time_s(travel_m),
            Walk::Pieces(walk) => walk.time_s(travel_m),
        }
    }

    /// Travel of the head at a time. With ramps or changes, the head rests at the ends of the run before and after it.
    pub fn travel_m(&self, time_s: f64) -> f64 {
        match &self.0 {
            Walk::Even(run) => run.travel_m(time_s),
            Walk::Pieces(walk) => walk.travel_m(time_s),
        }
    }

    /// Speed of the head at a time, in metres per second. It is 0 at both ends of a run with ramps.
    pub fn speed_mps(&self, time_s: f64) -> f64 {
        match &self.0 {
            Walk::Even(run) => run.speed_mps(time_s),
            Walk::Pieces(walk) => walk.speed_mps(time_s),
        }
    }

    /// The whole walk in pieces of constant acceleration: of each, its beginning in seconds and metres, its speed there and its
    /// acceleration. It lasts until the next one begins; the last is the rest at the end.
    ///
    /// ```
    /// use bench_dragon_geometry::formation::Timetable;
    ///
    /// let pieces = Timetable::new(1.0, Some(0.5), 0.0, 10.0).pieces();
    /// assert_eq!(pieces, [[0.0, 0.0, 0.0, 0.5], [2.0, 1.0, 1.0, 0.0], [10.0, 9.0, 1.0, -0.5], [12.0, 10.0, 0.0, 0.0]]);
    /// ```
    pub fn pieces(&self) -> Vec<[f64; 4]> {
        match &self.0 {
            Walk::Even(run) => run.pieces(),
            Walk::Pieces(walk) => walk.pieces(),
        }
    }

    /// Time at which the head leaves.
    pub fn start_s(&self) -> f64 {
        match &self.0 {
            Walk::Even(run) => run.start_s(),
            Walk::Pieces(walk) => walk.start_s(),
        }
    }

    /// Time at which the head rests at the run's end. Without ramps: at which it arrives there.
    pub fn end_s(&self) -> f64 {
        match &self.0 {
            Walk::Even(run) => run.end_s(),
            Walk::Pieces(walk) => walk.end_s(),
        }
    }

    /// The planned speed at the start of the run, after the ramp.
    pub fn planned_mps(&self) -> f64 {
        match &self.0 {
            Walk::Even(run) => run.planned_mps(),
            Walk::Pieces(walk) => walk.planned_mps(),
        }
    }

    /// The planned speed at a time, apart from ramps and rests.
    pub fn ordered_mps(&self, time_s: f64) -> f64 {
        match &self.0 {
            Walk::Even(run) => run.planned_mps(),
            Walk::Pieces(walk) => walk.ordered_mps(time_s),
        }
    }

    /// Whether a ramp or a change reaches a speed between two times.
    pub fn reaches_speed(&self, speed_mps: f64, [from_s, to_s]: [f64; 2]) -> bool {
        match &self.0 {
            Walk::Even(run) => run.planned_mps() == speed_mps,
            Walk::Pieces(walk) => walk.reaches_speed(speed_mps, [from_s, to_s]),
        }
    }

    /// Greatest acceleration of the ramps; `None` if the head starts and stops at once.
    pub(crate) fn accel_mps2(&self) -> Option<f64> {
        match &self.0 {
            Walk::Even(run) => run.accel_mps2(),
            Walk::Pieces(walk) => walk.accel_mps2(),
        }
    }

    /// The greatest speed of the head.
    pub(crate) fn most_speed_mps(&self) -> f64 {
        match &self.0 {
            Walk::Even(run) => run.planned_mps(),
            Walk::Pieces(walk) => walk.most_speed_mps(),
        }
    }

    /// The greatest acceleration of the head, apart from its jumps.
    pub(crate) fn most_accel_mps2(&self) -> f64 {
        self.accel_mps2().unwrap_or(0.0)
    }

    /// The next instant after `time_s` at which the speed changes at once.
    pub(crate) fn next_jump_s(&self, time_s: f64) -> Option<f64> {
        match &self.0 {
            Walk::Even(run) => run.next_jump_s(time_s),
            Walk::Pieces(walk) => walk.next_jump_s(time_s),
        }
    }

    /// The growth of [`time_s`](Self::time_s) at a travel. `None` for a walk with changes, and where the head brakes for the run's
    /// end, because `time_s` there also depends on the travel of that end.
    pub(crate) fn time_rates(&self, travel_m: f64) -> Option<TimeRates> {
        match &self.0 {
            Walk::Even(run) => run.time_rates(travel_m),
            Walk::Pieces(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use test_support::property::random_cases;

    use super::*;

    proptest! {
        #![proptest_config(random_cases(256))]

        #[test]
        fn rates_equal_those_of_differences(
            speed_mps in 0.5..5.0_f64,
            accel_mps2 in prop::option::of(0.1..5.0_f64),
            start_s in -50.0..0.0_f64,
            part in 0.05..0.95_f64,
        ) {
            let with = |speed_mps| Timetable::new(speed_mps, accel_mps2, start_s, 200.0);
            let travel_m = speed_mps * start_s + part * (200.0 - speed_mps * start_s);
            let Some(rates) = with(speed_mps).time_rates(travel_m) else { return Ok(()) };
            let TimeRates { speed_mps: there_mps, per_speed, per_accel } = rates;
            let step = 1e-6;
            let ends = [travel_m - step, travel_m + step].map(|travel_m| with(speed_mps).time_rates(travel_m));
            let near = |rates: Option<TimeRates>| rates.is_some_and(|rates| (rates.speed_mps - there_mps).abs() < 1e-3);
            // Not across the end of a ramp, where the speed is not smooth.
            prop_assume!(ends.into_iter().all(near));
            let by_travel = with(speed_mps).time_s(travel_m + step) - with(speed_mps).time_s(travel_m - step);
            let by_speed = with(speed_mps + step).time_s(travel_m) - with(speed_mps - step).time_s(travel_m);
            prop_assert!((by_travel / (2.0 * step) * there_mps - 1.0).abs() < 1e-4);
            prop_assert!((by_speed / (2.0 * step) - per_speed).abs() < 1e-3 * (1.0 + per_speed.abs()));
            let ramped = |by: f64| Timetable::new(speed_mps, accel_mps2.map(|accel_mps2| accel_mps2 + by), start_s, 200.0);
            let by_accel = ramped(step).time_s(travel_m) - ramped(-step).time_s(travel_m);
            prop_assert!((by_accel / (2.0 * step) - per_accel).abs() < 1e-3 * (1.0 + per_accel.abs()));
        }
    }
}
