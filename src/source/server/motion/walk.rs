//! Walk of the head: at the target speed, never past a limit, and with bounded acceleration where there is a bound.
//!
//! A walk is a sequence of phases of constant acceleration. A phase ends in one of three cases: the head reaches the
//! target speed, it must begin to brake so that it rests exactly at the limit, or it rests. The instants of these ends
//! lie between ticks and are computed in closed form. So the head's resting point does not depend on the ticks.

use std::cmp::Ordering;

/// The head's walk. Instants are counted in ticks, as fractions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walk {
    tick_s: f64,
    /// Greatest acceleration, up and down, in m/s²; without one the head starts and stops at once.
    accel_mps2: Option<f64>,
    target_mps: f64,
    limit_m: f64,
    /// Whether the plan itself rests at the limit, so that the walk ends there without a ramp.
    rests_at_limit: bool,
    /// Travel at which the plan rests, so that the walk leaves it without a ramp.
    rests_at_m: Option<f64>,
    phase: Phase,
}

/// An interval of constant acceleration.
#[derive(Clone, Copy, Debug)]
struct Phase {
    start: Instant,
    accel_mps2: f64,
    end: Option<End>,
}

/// The head at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Instant {
    ticks: f64,
    travel_m: f64,
    speed_mps: f64,
}

#[derive(Clone, Copy, Debug)]
struct End {
    at: Instant,
    /// Whether the next phase brakes to the limit. A flag, because rounding could make a comparison of braking
    /// distances fail.
    brakes: bool,
}

impl Walk {
    /// Creates the walk of a head that rests and has no travel ahead.
    pub(super) fn at_rest(tick_s: f64, accel_mps2: Option<f64>, travel_m: f64) -> Self {
        let start = Instant { ticks: 0.0, travel_m, speed_mps: 0.0 };
        let phase = Phase { start, accel_mps2: 0.0, end: None };
        Self { tick_s, accel_mps2, target_mps: 0.0, limit_m: travel_m, rests_at_limit: false, rests_at_m: None, phase }
    }

    /// Sets the travel at which the plan rests. The walk leaves it without a ramp.
    pub(super) fn leave_at_once(&mut self, rests_at_m: Option<f64>) {
        self.rests_at_m = rests_at_m;
    }

    /// Sets the target speed and the travel to stop at, from an instant of the present phase on. `rests_at_limit`: the plan itself
    /// rests there.
    ///
    /// A near limit may make the head brake harder than the greatest acceleration. The head never passes the limit.
    pub(super) fn steer(&mut self, ticks: f64, target_mps: f64, limit_m: f64, rests_at_limit: bool) {
        if (target_mps, limit_m, rests_at_limit) != (self.target_mps, self.limit_m, self.rests_at_limit) {
            let mut now = self.at(ticks);
            // A head that leaves a rest of the plan stands there until time goes on.
            if ticks == self.phase.start.ticks && self.rests_at_m == Some(now.travel_m) {
                now.speed_mps = 0.0;
            }
            (self.target_mps, self.limit_m, self.rests_at_limit) = (target_mps, limit_m, rests_at_limit);
            self.phase = self.plan(now, false);
        }
    }

    pub(super) fn advance_to(&mut self, ticks: f64) {
        while let Some(End { at, brakes }) = self.phase.end
            && at.ticks <= ticks
        {
            self.phase = self.plan(at, brakes);
        }
    }

    /// Counts instants from a later one on. The walk stays the same.
    pub(super) fn count_from(&mut self, ticks: f64) {
        self.phase.start.ticks -= ticks;
        if let Some(end) = &mut self.phase.end {
            end.at.ticks -= ticks;
        }
    }

    /// Counts instants in ticks of another length, from the same zero. The walk stays the same.
    pub(super) fn count_in(&mut self, tick_s: f64) {
        let shorter = self.tick_s / tick_s;
        self.tick_s = tick_s;
        self.phase.start.ticks *= shorter;
        if let Some(end) = &mut self.phase.end {
            end.at.ticks *= shorter;
        }
    }

    /// Instant since which the head rests; `None` while it walks.
    pub(super) fn rests_since(&self) -> Option<f64> {
        (self.phase.start.speed_mps == 0.0 && self.phase.accel_mps2 == 0.0).then_some(self.phase.start.ticks)
    }

    /// Travel at an instant of the present phase, in metres.
    pub(super) fn travel_m(&self, ticks: f64) -> f64 {
        self.at(ticks).travel_m
    }

    /// Speed at an instant of the present phase, in metres per show second.
    pub(super) fn speed_mps(&self, ticks: f64) -> f64 {
        self.at(ticks).speed_mps
    }

    fn at(&self, ticks: f64) -> Instant {
        let Phase { start, accel_mps2, end } = self.phase;
        let elapsed_s = (ticks - start.ticks) * self.tick_s;
        let travel_m = start.travel_m + start.speed_mps * elapsed_s;
        // Rounding must move the head neither past the limit nor backwards, also not from here to the end of the phase.
        let most_m = end.map_or(self.limit_m, |end| end.at.travel_m.min(self.limit_m));
        let travel_m = (travel_m + 0.5 * accel_mps2 * elapsed_s * elapsed_s).min(most_m.max(start.travel_m));
        Instant { ticks, travel_m, speed_mps: (start.speed_mps + accel_mps2 * elapsed_s).max(0.0) }
    }

    /// Plans the phase that begins at an instant.
    fn plan(&self, start: Instant, brakes: bool) -> Phase {
        let ahead_m = self.limit_m - start.travel_m;
        let leaves_at_once = start.speed_mps == 0.0 && self.rests_at_m == Some(start.travel_m);
        match self.accel_mps2 {
            None => self.walk_at_once(start, ahead_m),
            Some(_) if ahead_m <= 0.0 => rest(start),
            Some(_) if leaves_at_once && self.target_mps > 0.0 => {
                self.plan(Instant { speed_mps: self.target_mps, ..start }, false)
            }
            Some(accel_mps2) if self.rests_at_limit => self.walk_on(start, accel_mps2, ahead_m),
            Some(accel_mps2) if brakes || braking_distance_m(start.speed_mps, accel_mps2) > ahead_m => {
                self.brake_to_limit(start, ahead_m)
            }
            Some(accel_mps2) if start.speed_mps > self.target_mps => self.change_speed(start, -accel_mps2),
            Some(_) if self.target_mps == 0.0 => rest(start),
            Some(accel_mps2) if start.speed_mps < self.target_mps => self.speed_up(start, accel_mps2, ahead_m),
            Some(accel_mps2) => {
                let cruise_m = ahead_m - braking_distance_m(start.speed_mps, accel_mps2);
                let at = self.after(start, cruise_m / start.speed_mps, start.travel_m + cruise_m, start.speed_mps);
                Phase { start, accel_mps2: 0.0, end: Some(End { at, brakes: true }) }
            }
        }
    }

    /// Walks towards the target speed, and at it, up to a limit at which the plan itself rests.
    fn walk_on(&self, start: Instant, accel_mps2: f64, ahead_m: f64) -> Phase {
        let accel_mps2 = match start.speed_mps.total_cmp(&self.target_mps) {
            Ordering::Less => accel_mps2,
            Ordering::Equal if start.speed_mps == 0.0 => return rest(start),
            Ordering::Equal => 0.0,
            Ordering::Greater => -accel_mps2,
        };
        if accel_mps2 != 0.0 {
            let phase = self.change_speed(start, accel_mps2);
            if phase.end.is_some_and(|end| end.at.travel_m < self.limit_m) {
                return phase;
            }
        }
        // v·t + a·t²/2 = the travel ahead, where the speed does not fall to 0 before.
        let root_mps = (start.speed_mps * start.speed_mps + 2.0 * accel_mps2 * ahead_m).max(0.0).sqrt();
        let at = self.after(start, 2.0 * ahead_m / (start.speed_mps + root_mps), self.limit_m, root_mps);
        Phase { start, accel_mps2, end: Some(End { at, brakes: false }) }
    }

    fn walk_at_once(&self, start: Instant, ahead_m: f64) -> Phase {
        if self.target_mps == 0.0 || ahead_m <= 0.0 {
            return rest(start);
        }
        let start = Instant { speed_mps: self.target_mps, ..start };
        let at = self.after(start, ahead_m / self.target_mps, self.limit_m, self.target_mps);
        Phase { start, accel_mps2: 0.0, end: Some(End { at, brakes: false }) }
    }

    /// Brakes with constant deceleration, to rest exactly at the limit.
    fn brake_to_limit(&self, start: Instant, ahead_m: f64) -> Phase {
        let accel_mps2 = -start.speed_mps * start.speed_mps / (2.0 * ahead_m);
        let at = self.after(start, 2.0 * ahead_m / start.speed_mps, self.limit_m, 0.0);
        Phase { start, accel_mps2, end: Some(End { at, brakes: false }) }
    }

    fn change_speed(&self, start: Instant, accel_mps2: f64) -> Phase {
        let elapsed_s = (self.target_mps - start.speed_mps) / accel_mps2;
        let travel_m = start.travel_m + 0.5 * (start.speed_mps + self.target_mps) * elapsed_s;
        let at = self.after(start, elapsed_s, travel_m, self.target_mps);
        Phase { start, accel_mps2, end: Some(End { at, brakes: false }) }
    }

    /// Speeds up to the target speed, or to the point where braking must begin.
    fn speed_up(&self, start: Instant, accel_mps2: f64, ahead_m: f64) -> Phase {
        // At that point the square of the speed, v² + 2·a·x, equals the square that braking can remove: 2·a·(ahead −
        // x).
        let top_mps = (0.5 * start.speed_mps * start.speed_mps + accel_mps2 * ahead_m).sqrt();
        if top_mps >= self.target_mps {
            return self.change_speed(start, accel_mps2);
        }
        let elapsed_s = (top_mps - start.speed_mps).max(0.0) / accel_mps2;
        let travel_m = start.travel_m + 0.5 * (start.speed_mps + top_mps) * elapsed_s;
        let at = self.after(start, elapsed_s, travel_m, top_mps);
        Phase { start, accel_mps2, end: Some(End { at, brakes: true }) }
    }

    /// The instant at which a phase ends. Rounding must not put it past the limit.
    fn after(&self, start: Instant, elapsed_s: f64, travel_m: f64, speed_mps: f64) -> Instant {
        let travel_m = travel_m.min(self.limit_m.max(start.travel_m));
        Instant { ticks: start.ticks + elapsed_s / self.tick_s, travel_m, speed_mps }
    }
}

fn rest(start: Instant) -> Phase {
    Phase { start: Instant { speed_mps: 0.0, ..start }, accel_mps2: 0.0, end: None }
}

/// Braking distance from this speed to rest, in metres.
fn braking_distance_m(speed_mps: f64, accel_mps2: f64) -> f64 {
    speed_mps * speed_mps / (2.0 * accel_mps2)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use test_support::property::random_cases;

    use super::*;

    const TICK_S: f64 = 0.01;

    fn walk(accel_mps2: Option<f64>, target_mps: f64, limit_m: f64) -> Walk {
        let mut walk = Walk::at_rest(TICK_S, accel_mps2, 0.0);
        walk.steer(0.0, target_mps, limit_m, false);
        walk
    }

    /// Travel and speed after a number of seconds.
    fn after(mut walk: Walk, seconds: f64) -> (f64, f64) {
        walk.advance_to(seconds / TICK_S);
        (walk.travel_m(seconds / TICK_S), walk.speed_mps(seconds / TICK_S))
    }

    fn assert_near((travel_m, speed_mps): (f64, f64), expected: (f64, f64)) {
        assert!(
            (travel_m - expected.0).abs() < 1e-12 && (speed_mps - expected.1).abs() < 1e-12,
            "{travel_m} {speed_mps}"
        );
    }

    #[test]
    fn without_an_acceleration_the_head_starts_and_stops_at_once() {
        let walk = walk(None, 2.0, 3.0);
        assert_eq!(after(walk, 1.0), (2.0, 2.0));
        assert_eq!(after(walk, 1.5), (3.0, 0.0));
        assert_eq!(after(walk, 9.0), (3.0, 0.0));
    }

    #[test]
    fn a_ramp_leads_up_to_speed_and_down_to_rest_at_the_limit() {
        // 2 s and 2 m to reach 2 m/s, 3 s and 6 m at 2 m/s, 2 s and 2 m to rest.
        let walk = walk(Some(1.0), 2.0, 10.0);
        assert_near(after(walk, 1.0), (0.5, 1.0));
        assert_near(after(walk, 2.0), (2.0, 2.0));
        assert_near(after(walk, 5.0), (8.0, 2.0));
        assert_near(after(walk, 6.0), (9.5, 1.0));
        assert_eq!(after(walk, 7.5), (10.0, 0.0));
    }

    #[test]
    fn on_a_short_travel_the_head_brakes_before_it_reaches_the_target_speed() {
        let walk = walk(Some(1.0), 5.0, 4.0);
        assert_near(after(walk, 2.0), (2.0, 2.0));
        assert_eq!(after(walk, 4.1), (4.0, 0.0));
    }

    #[test]
    fn another_tick_length_changes_only_the_number_of_ticks() {
        for accel_mps2 in [None, Some(1.0)] {
            let mut walk = walk(accel_mps2, 2.0, 10.0);
            walk.advance_to(1.0 / TICK_S);
            let whole = after(walk, 3.5);
            walk.count_from(1.0 / TICK_S);
            walk.count_in(TICK_S * 0.8);
            let ticks = 2.5 / (TICK_S * 0.8);
            walk.advance_to(ticks);
            assert_near((walk.travel_m(ticks), walk.speed_mps(ticks)), whole);
        }
    }

    #[test]
    fn a_head_at_constant_speed_does_not_pass_its_limit_by_rounding() {
        for number in 1..1000 {
            let limit_m = 10.0 + f64::from(number) / 7.0;
            let walk = walk(None, 0.1 + 0.0037 * f64::from(number), limit_m);
            let end = walk.phase.end.expect("the head walks to its limit").at;
            let just_before_m = walk.travel_m(end.ticks * (1.0 - f64::EPSILON));
            assert!(just_before_m <= limit_m, "{just_before_m} m, and the limit is {limit_m} m");
        }
    }

    #[test]
    fn a_head_that_comes_to_rest_does_not_go_back_by_rounding() {
        for number in 1..1000 {
            let number = f64::from(number);
            let mut walk = walk(Some(0.05 + 0.0013 * number), 0.1 + 0.0037 * number, 1e6);
            let stop = 4000.0 + number / 7.0;
            walk.advance_to(stop);
            walk.steer(stop, 0.0, 1e6, false);
            let rest = walk.phase.end.expect("the head brakes to rest").at;
            let just_before_m = walk.travel_m(rest.ticks * (1.0 - f64::EPSILON));
            assert!(just_before_m <= rest.travel_m, "{just_before_m} m, then {} m", rest.travel_m);
        }
    }

    #[test]
    fn a_head_that_is_stopped_while_it_brakes_to_its_limit_does_not_pass_it_by_rounding() {
        for number in 1..1000 {
            let number = f64::from(number);
            // The run begins far before 0, so the travel ahead is rounded.
            let limit_m = number / 700.0;
            let mut walk = Walk::at_rest(TICK_S, Some(0.05 + 0.0013 * number), -100.0);
            walk.steer(0.0, 0.1 + 0.0037 * number, limit_m, false);
            while !walk.phase.end.is_some_and(|end| end.at.speed_mps == 0.0) {
                walk.advance_to(walk.phase.end.expect("the head walks to its limit").at.ticks);
            }
            let [begin, end] = [walk.phase.start, walk.phase.end.expect("the head brakes").at].map(|at| at.ticks);
            for part in 0..8 {
                let mut stopped = walk;
                let stop = begin + (end - begin) * f64::from(part) / 8.0;
                stopped.steer(stop, 0.0, limit_m, false);
                stopped.advance_to(2.0 * end);
                let travel_m = stopped.travel_m(2.0 * end);
                assert!(travel_m <= limit_m, "{travel_m} m, and the limit is {limit_m} m");
            }
        }
    }

    #[test]
    fn a_head_that_leaves_a_rest_of_the_plan_and_is_stopped_at_the_same_instant_stays_there() {
        let mut walk = Walk::at_rest(TICK_S, Some(1.0), 0.0);
        walk.leave_at_once(Some(0.0));
        walk.steer(0.0, 2.0, 10.0, true);
        walk.steer(0.0, 0.0, 10.0, true);
        assert_eq!(after(walk, 1.0), (0.0, 0.0));
    }

    #[test]
    fn where_the_plan_itself_rests_the_walk_ends_without_a_ramp() {
        let walk_to = |limit_m| {
            let mut walk = Walk::at_rest(TICK_S, Some(1.0), 0.0);
            walk.steer(0.0, 2.0, limit_m, true);
            walk
        };
        // 2 s and 2 m to reach 2 m/s, then 4 s and 8 m.
        for (seconds, expected) in [(1.0, (0.5, 1.0)), (2.0, (2.0, 2.0)), (5.9, (9.8, 2.0)), (6.1, (10.0, 0.0))] {
            assert_near(after(walk_to(10.0), seconds), expected);
        }
        // The head is there before it has reached that speed.
        for (seconds, expected) in [(1.4, (0.98, 1.4)), (1.42, (1.0, 0.0))] {
            assert_near(after(walk_to(1.0), seconds), expected);
        }
        // At half the acceleration, the head is at 0.5625 m after 1.5 s, at 0.75 m/s.
        let mut slow = Walk::at_rest(TICK_S, Some(0.5), 0.0);
        slow.steer(0.0, 2.0, 0.5625, true);
        for (seconds, expected) in [(1.0, (0.25, 0.5)), (1.4, (0.49, 0.7)), (1.51, (0.5625, 0.0))] {
            assert_near(after(slow, seconds), expected);
        }
        // From 8 m, at 5 s, to another speed: 1 m/s before the limit, less than 2 m/s at the limit, rest before the limit.
        for (target_mps, limit_m, moments) in [
            (1.0, 10.0, [(5.5, (8.875, 1.5)), (6.25, (9.75, 1.0)), (6.6, (10.0, 0.0))]),
            (1.0, 8.875, [(5.4, (8.72, 1.6)), (5.49, (8.859_95, 1.51)), (5.6, (8.875, 0.0))]),
            (0.0, 12.0, [(6.0, (9.5, 1.0)), (7.0, (10.0, 0.0)), (9.0, (10.0, 0.0))]),
        ] {
            let mut walk = walk_to(20.0);
            walk.advance_to(5.0 / TICK_S);
            walk.steer(5.0 / TICK_S, target_mps, limit_m, true);
            for (seconds, expected) in moments {
                assert_near(after(walk, seconds), expected);
            }
        }
    }

    #[test]
    fn a_head_leaves_a_rest_of_the_plan_and_no_other_place_at_its_full_speed() {
        for (rests_at_m, expected) in [(Some(0.0), (2.0, 2.0)), (Some(3.0), (0.5, 1.0)), (None, (0.5, 1.0))] {
            let mut walk = Walk::at_rest(TICK_S, Some(1.0), 0.0);
            walk.leave_at_once(rests_at_m);
            walk.steer(0.0, 2.0, 10.0, true);
            assert_near(after(walk, 1.0), expected);
        }
    }

    #[test]
    fn the_last_of_two_orders_at_one_instant_counts() {
        let mut walk = walk(Some(1.0), 2.0, 10.0);
        walk.advance_to(5.0 / TICK_S);
        walk.steer(5.0 / TICK_S, 1.0, 50.0, false);
        walk.steer(5.0 / TICK_S, 2.0, 60.0, false);
        assert_near(after(walk, 6.0), (10.0, 2.0));
    }

    #[test]
    fn a_head_brakes_harder_for_a_limit_that_is_too_near() {
        let mut walk = walk(Some(1.0), 2.0, 10.0);
        walk.advance_to(5.0 / TICK_S);
        walk.steer(5.0 / TICK_S, 2.0, 9.0, false);
        assert_near(after(walk, 5.5), (8.75, 1.0));
        assert_near(after(walk, 6.1), (9.0, 0.0));
    }

    #[test]
    fn a_farther_limit_ends_the_braking() {
        let mut walk = walk(Some(1.0), 2.0, 10.0);
        walk.advance_to(6.0 / TICK_S);
        walk.steer(6.0 / TICK_S, 2.0, 100.0, false);
        assert_near(after(walk, 7.0), (11.0, 2.0));
    }

    /// Target speeds, also that of a stop.
    fn target_mps() -> impl Strategy<Value = f64> {
        prop_oneof![1 => Just(0.0), 3 => 0.0..10.0_f64]
    }

    /// How much further the limit is than the one before; also the same limit.
    fn further_m() -> impl Strategy<Value = f64> {
        prop_oneof![1 => Just(0.0), 3 => 0.0..5.0_f64]
    }

    proptest! {
        #![proptest_config(random_cases(256))]

        /// At any instants, with any orders in between, a walk passes no limit and never goes back. Its speed changes
        /// no faster than the greatest acceleration.
        #[test]
        fn a_walk_keeps_its_limits(
            orders in prop::collection::vec((target_mps(), further_m(), 0.0..300.0_f64), 1..40),
            accel_mps2 in prop::option::of(0.01..20.0_f64),
        ) {
            let mut walk = Walk::at_rest(TICK_S, accel_mps2, 0.0);
            let (mut ticks, mut limit_m, mut last) = (0.0, 0.0, (0.0, 0.0));
            for (target_mps, further_m, ticks_on) in orders {
                limit_m += further_m;
                walk.steer(ticks, target_mps, limit_m, false);
                ticks += ticks_on;
                walk.advance_to(ticks);
                let (travel_m, speed_mps) = (walk.travel_m(ticks), walk.speed_mps(ticks));
                prop_assert!((last.0..=limit_m).contains(&travel_m), "{travel_m} after {last:?}, limit {limit_m}");
                if let Some(accel_mps2) = accel_mps2 {
                    let change_mps: f64 = speed_mps - last.1;
                    prop_assert!(change_mps.abs() <= accel_mps2 * ticks_on * TICK_S * (1.0 + 1e-9) + 1e-9);
                    prop_assert!(braking_distance_m(speed_mps, accel_mps2) <= (limit_m - travel_m) * (1.0 + 1e-9) + 1e-9);
                }
                last = (travel_m, speed_mps);
            }
        }

        /// For any steps, the head rests exactly at the limit, at the same instant.
        #[test]
        fn the_rest_does_not_depend_on_the_ticks(
            target_mps in 0.1..10.0_f64,
            limit_m in 0.001..400.0_f64,
            accel_mps2 in prop::option::of(0.01..20.0_f64),
            step in 0.001..1000.0_f64,
        ) {
            let at_once = {
                let mut walk = walk(accel_mps2, target_mps, limit_m);
                walk.advance_to(1e9);
                walk.rests_since().expect("the walk ends at the limit")
            };
            let mut stepped = walk(accel_mps2, target_mps, limit_m);
            let mut ticks = 0.0;
            while stepped.rests_since().is_none() {
                ticks += step;
                stepped.advance_to(ticks);
            }
            prop_assert_eq!(stepped.travel_m(ticks), limit_m);
            prop_assert_eq!(stepped.rests_since(), Some(at_once));
        }
    }
}
