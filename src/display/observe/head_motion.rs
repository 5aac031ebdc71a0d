//! The times at which the head reaches a travel, and the travel at which it comes to rest.

use bench_dragon_ipc::{FrameHeader, ShowState, Status};
use serde::Serialize;

use crate::source::server::motion::FASTEST;

/// Least lag behind the clock at which the show is taken to catch up, in seconds: more than it makes up from one status to the next.
const LEAST_BEHIND_S: f64 = 0.02;

/// The arrival of the head at a travel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Arrival {
    /// The travel in metres.
    pub travel_m: f64,
    /// Show time there, in seconds.
    pub time_s: f64,
    /// Wall time until then, in seconds: from now, or for a standing head, from the instant at which it walks on.
    pub wall_s: f64,
}

/// The motion of the head from a frame on.
///
/// The server changes speed with the configured acceleration a: from v to w in |w − v|/a and |w² − v²|/(2a). Without one, the
/// head changes its speed at once. A standing head is taken to walk on now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HeadMotion {
    pub(super) clock: TravelClock,
    /// Speed of the head in the frame, in metres per show second.
    speed_mps: f64,
    accel_mps2: Option<f64>,
    time_scale: f64,
    /// Whether the plan has the ramps at its end: then the show passes along its course up to there.
    is_plan: bool,
    /// Wall time by which a walking show is behind the clock, which it makes up; 0 for one that is on time.
    behind_s: f64,
}

impl HeadMotion {
    /// Returns the motion from this frame on, up or down to the speed of the clock. `status` has whether the show catches up.
    pub(super) fn new(
        header: &FrameHeader,
        clock: TravelClock,
        accel_mps2: Option<f64>,
        status: Option<&Status>,
    ) -> Self {
        let behind_s = status.map_or(0.0, |status| status.behind_ns as f64 * 1e-9);
        let catches_up = behind_s >= LEAST_BEHIND_S && header.show_state().is_some_and(ShowState::walks);
        let behind_s = if catches_up { behind_s } else { 0.0 };
        let (speed_mps, is_plan) = (header.course_mps, header.is_plan != 0);
        Self { clock, speed_mps, accel_mps2, time_scale: header.time_scale, is_plan, behind_s }
    }

    /// Returns the arrival at a travel that the head passes.
    pub(super) fn passing(&self, travel_m: f64) -> Arrival {
        let ahead_m = travel_m - self.clock.travel_m;
        let (from_mps, to_mps) = (self.speed_mps, self.clock.speed_mps);
        let show_s = match self.accel_mps2.filter(|_| ahead_m > 0.0) {
            None => ahead_m / to_mps,
            Some(accel_mps2) => {
                let ramp = Ramp::between(from_mps, to_mps, accel_mps2);
                if ahead_m >= ramp.distance_m {
                    ramp.time_s + (ahead_m - ramp.distance_m) / to_mps
                } else {
                    let change = 2.0 * accel_mps2.copysign(to_mps - from_mps) * ahead_m;
                    let there_mps = (from_mps * from_mps + change).max(0.0).sqrt();
                    (there_mps - from_mps).abs() / accel_mps2
                }
            }
        };
        self.after(travel_m, show_s)
    }

    /// The travel that the head passes at a show time, at most `most_m`, to a micrometre.
    pub(super) fn travel_at_m(&self, time_s: f64, most_m: f64) -> f64 {
        let [mut low_m, mut high_m] = [self.clock.travel_m, most_m];
        // A course has at most 10⁷ m, or some 2⁴⁴ µm.
        for _ in 0..44 {
            let middle_m = 0.5 * (low_m + high_m);
            if self.passing(middle_m).time_s < time_s { low_m = middle_m } else { high_m = middle_m }
        }
        high_m
    }

    /// Returns the arrival at a travel at which the head comes to rest.
    pub(super) fn resting_at(&self, travel_m: f64) -> Arrival {
        let ahead_m = (travel_m - self.clock.travel_m).max(0.0);
        let (from_mps, to_mps) = (self.speed_mps, self.clock.speed_mps);
        let Some(accel_mps2) = self.accel_mps2 else { return self.after(travel_m, ahead_m / to_mps) };
        let (ramp, braking) = (Ramp::between(from_mps, to_mps, accel_mps2), Ramp::between(to_mps, 0.0, accel_mps2));
        let steady_m = ahead_m - ramp.distance_m - braking.distance_m;
        let show_s = if steady_m >= 0.0 {
            ramp.time_s + steady_m / to_mps + braking.time_s
        } else if Ramp::between(from_mps, 0.0, accel_mps2).distance_m >= ahead_m {
            // The head already brakes.
            if from_mps > 0.0 { 2.0 * ahead_m / from_mps } else { 0.0 }
        } else {
            // The head brakes before it has reached its speed: at the square v²/2 + a·s of the highest one.
            let top_mps = (0.5 * from_mps * from_mps + accel_mps2 * ahead_m).sqrt();
            (2.0 * top_mps - from_mps) / accel_mps2
        };
        self.after(travel_m, show_s)
    }

    /// Returns the arrival at the end of the run.
    pub(super) fn ending_at(&self, travel_m: f64) -> Arrival {
        if self.is_plan { self.passing(travel_m) } else { self.resting_at(travel_m) }
    }

    /// Returns the arrival at the place of rest, if the head brakes from now on. The head does not pass `limit_m`.
    pub(super) fn braking(&self, limit_m: f64) -> Arrival {
        let (distance_m, show_s) = match self.accel_mps2 {
            Some(accel_mps2) => (self.speed_mps * self.speed_mps / (2.0 * accel_mps2), self.speed_mps / accel_mps2),
            None => (0.0, 0.0),
        };
        self.after((self.clock.travel_m + distance_m).min(limit_m).max(self.clock.travel_m), show_s)
    }

    /// Returns the arrival at a travel that the head passes while it brakes from now on.
    pub(super) fn passing_braking(&self, travel_m: f64) -> Arrival {
        let (distance_m, speed_mps) = ((travel_m - self.clock.travel_m).max(0.0), self.speed_mps);
        let show_s = match self.accel_mps2 {
            Some(accel_mps2) => {
                (speed_mps - (speed_mps * speed_mps - 2.0 * accel_mps2 * distance_m).max(0.0).sqrt()) / accel_mps2
            }
            None => 0.0,
        };
        self.after(travel_m, show_s)
    }

    fn after(&self, travel_m: f64, show_s: f64) -> Arrival {
        Arrival { travel_m, time_s: self.clock.time_s + show_s, wall_s: self.wall_s(show_s) }
    }

    /// Wall time of a show time ahead. A show that catches up does so at [`FASTEST`], and then goes on at its own pace.
    fn wall_s(&self, show_s: f64) -> f64 {
        let wall_s = show_s / self.time_scale;
        let is_caught_up = self.behind_s > 0.0 && wall_s > self.behind_s / (FASTEST - 1.0);
        if is_caught_up { FASTEST * wall_s - self.behind_s } else { wall_s }
    }
}

/// A change of speed with constant acceleration.
struct Ramp {
    time_s: f64,
    distance_m: f64,
}

impl Ramp {
    fn between(from_mps: f64, to_mps: f64, accel_mps2: f64) -> Self {
        let time_s = (to_mps - from_mps).abs() / accel_mps2;
        Self { time_s, distance_m: 0.5 * (from_mps + to_mps) * time_s }
    }
}

/// Converts travel to show time, for a head that walks on at a constant speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TravelClock {
    /// Travel of the head, in metres.
    pub travel_m: f64,
    /// Show time at this travel, in seconds.
    pub time_s: f64,
    /// Speed at which the head walks, or will walk on after a standstill, in metres per show second; over 0.
    pub speed_mps: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A head at 10 m and 20 s of show time, which walks at this speed. Show time runs twice as fast as wall time.
    fn motion(speed_mps: f64, accel_mps2: Option<f64>) -> HeadMotion {
        let header = FrameHeader { course_mps: speed_mps, time_scale: 2.0, ..FrameHeader::default() };
        HeadMotion::new(&header, TravelClock { travel_m: 10.0, time_s: 20.0, speed_mps: 1.0 }, accel_mps2, None)
    }

    #[test]
    fn wall_time_is_show_time_divided_by_the_time_scale() {
        assert_eq!(motion(1.0, None).passing(13.0), Arrival { travel_m: 13.0, time_s: 23.0, wall_s: 1.5 });
        assert_eq!(motion(1.0, None).resting_at(13.0).wall_s, 1.5);
    }

    /// A show of time scale 2 that is 3 s behind makes them up in 30 s, in which it advances by 66 s.
    #[test]
    fn a_show_that_catches_up_goes_on_at_its_own_pace() {
        let wall_s = |state: ShowState, time_scale: f64, behind_s: f64, travel_m: f64| {
            let header = FrameHeader { course_mps: 1.0, time_scale, state: state.to_wire(), ..FrameHeader::default() };
            let status = Status { behind_ns: (behind_s * 1e9) as u64, ..Status::default() };
            let clock = TravelClock { travel_m: 10.0, time_s: 20.0, speed_mps: 1.0 };
            HeadMotion::new(&header, clock, None, Some(&status)).passing(travel_m).wall_s
        };
        for (travel_m, expected_s) in [(32.0, 10.0), (76.0, 30.0), (210.0, 97.0)] {
            let found_s = wall_s(ShowState::Running, 2.0 * FASTEST, 3.0, travel_m);
            assert!((found_s - expected_s).abs() < 1e-9, "{travel_m}: {found_s}");
        }
        // One that stands, and one that was on time at the last status, go on at their pace.
        assert_eq!(wall_s(ShowState::Paused, 2.0, 3.0, 210.0), 100.0);
        assert_eq!(wall_s(ShowState::Running, 2.0, 0.01, 210.0), 100.0);
    }

    #[test]
    fn the_travel_at_a_show_time_is_that_whose_arrival_is_then() {
        let motion = motion(0.2, Some(0.25));
        for time_s in [21.0, 25.0, 30.0] {
            let travel_m = motion.travel_at_m(time_s, 100.0);
            assert!((motion.passing(travel_m).time_s - time_s).abs() < 1e-5, "{travel_m} m");
        }
        assert_eq!(motion.travel_at_m(1000.0, 12.0), 12.0);
    }

    #[test]
    fn a_plan_has_the_ramps_at_its_end_itself() {
        let header = FrameHeader { course_mps: 1.0, time_scale: 1.0, is_plan: 1, ..FrameHeader::default() };
        let clock = TravelClock { travel_m: 10.0, time_s: 20.0, speed_mps: 1.0 };
        let motion = HeadMotion::new(&header, clock, Some(0.25), None);
        assert_eq!((motion.ending_at(15.0).time_s, motion.resting_at(15.0).time_s), (25.0, 27.0));
    }

    #[test]
    fn the_arrival_at_a_rest_includes_the_braking_time() {
        let motion = motion(1.0, Some(0.25));
        // The head brakes for two metres and four seconds.
        assert_eq!(motion.braking(f64::INFINITY), Arrival { travel_m: 12.0, time_s: 24.0, wall_s: 2.0 });
        assert_eq!(motion.resting_at(12.0).time_s, 24.0);
        assert_eq!(motion.resting_at(15.0).time_s, 27.0);
        assert_eq!(motion.resting_at(10.0).time_s, 20.0);
    }

    #[test]
    fn the_arrival_at_the_end_is_the_same_before_during_and_after_a_ramp() {
        let (accel_mps2, to_mps) = (0.25, 1.0);
        let motion = |travel_m, time_s, speed_mps| {
            let header = FrameHeader { course_mps: speed_mps, time_scale: 1.0, ..FrameHeader::default() };
            HeadMotion::new(&header, TravelClock { travel_m, time_s, speed_mps: to_mps }, Some(accel_mps2), None)
        };
        // Two metres and four seconds up to speed, 96 m, and as long to rest.
        for (travel_m, time_s, speed_mps) in [(0.0, 0.0, 0.0), (0.125, 1.0, 0.25), (2.0, 4.0, 1.0), (50.0, 52.0, 1.0)] {
            let motion = motion(travel_m, time_s, speed_mps);
            assert_eq!(motion.resting_at(100.0).time_s, 104.0, "from {travel_m} m");
            assert_eq!(motion.passing(98.0).time_s, 100.0, "from {travel_m} m");
        }
        // From 2 m/s down to 1 m/s in four seconds and six metres.
        assert_eq!(motion(0.0, 0.0, 2.0).resting_at(100.0).time_s, 4.0 + 92.0 + 4.0);
        assert_eq!(motion(0.0, 0.0, 2.0).passing(3.5).time_s, 2.0);
        // One metre is too short to reach the speed: half of it up, half of it down.
        assert_eq!(motion(0.0, 0.0, 0.0).resting_at(1.0).time_s, 4.0);
        assert_eq!(motion(0.0, 0.0, 0.0).resting_at(0.0).time_s, 0.0);
    }

    #[test]
    fn a_braking_head_stops_at_its_limit_and_without_an_acceleration_at_once() {
        assert_eq!(motion(1.0, Some(0.25)).braking(11.0).travel_m, 11.0);
        assert_eq!(motion(1.0, None).braking(f64::INFINITY), Arrival { travel_m: 10.0, time_s: 20.0, wall_s: 0.0 });
    }

    #[test]
    fn a_braking_head_passes_a_travel_before_it_comes_to_rest() {
        let motion = motion(1.0, Some(0.25));
        assert_eq!(motion.passing_braking(11.5).time_s, 22.0);
        assert_eq!(motion.passing_braking(12.0).time_s, 24.0);
    }
}
