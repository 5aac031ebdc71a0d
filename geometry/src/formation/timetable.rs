//! The head's timetable: its travel at each show time, on a run without commands.
//!
//! The head starts from rest, accelerates evenly to the planned speed, walks at that speed, and brakes evenly. It rests exactly
//! at the run's end. If the run is too short for the planned speed, the head brakes as soon as it stops accelerating. Without a
//! largest acceleration it walks at the planned speed throughout. The server walks the same way. Its `motion` plans phase by
//! phase, because commands may change the plan; a test there compares the two.

/// Travel of the head over show time, in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timetable {
    /// Travel at time 0 of a head that always walks at the planned speed.
    offset_m: f64,
    start_s: f64,
    start_m: f64,
    end_m: f64,
    speed_mps: f64,
    ramps: Option<Ramps>,
}

/// The two ramps of a run, which are alike.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ramps {
    accel_mps2: f64,
    /// Speed between the ramps.
    top_mps: f64,
    /// Travel of one ramp.
    length_m: f64,
}

impl Timetable {
    /// A run that begins at a show time and ends at a travel. It begins at the travel that the planned speed gives: `speed_mps`
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
        Self::with_offset(0.0, speed_mps, accel_mps2, start_s, end_travel_m)
    }

    /// A run from `start_m`, which the head leaves at `start_s`. Before, it stands there.
    pub fn leaving(start_s: f64, start_m: f64, speed_mps: f64, accel_mps2: Option<f64>, end_travel_m: f64) -> Self {
        Self::with_offset(start_m - speed_mps * start_s, speed_mps, accel_mps2, start_s, end_travel_m)
    }

    /// The same run, which begins later by `delay_s`, or earlier if it is below 0.
    #[must_use]
    pub fn delayed(self, delay_s: f64) -> Self {
        Self { offset_m: self.offset_m - self.speed_mps * delay_s, start_s: self.start_s + delay_s, ..self }
    }

    fn with_offset(offset_m: f64, speed_mps: f64, accel_mps2: Option<f64>, start_s: f64, end_travel_m: f64) -> Self {
        let start_m = speed_mps * start_s + offset_m;
        let run_m = (end_travel_m - start_m).max(0.0);
        let ramps = accel_mps2.map(|accel_mps2| {
            let full_m = speed_mps * speed_mps / (2.0 * accel_mps2);
            if 2.0 * full_m <= run_m {
                Ramps { accel_mps2, top_mps: speed_mps, length_m: full_m }
            } else {
                Ramps { accel_mps2, top_mps: (accel_mps2 * run_m).sqrt(), length_m: 0.5 * run_m }
            }
        });
        Self { offset_m, start_s, start_m, end_m: start_m + run_m, speed_mps, ramps }
    }

    /// Show time at which the head reaches a travel. With ramps, a travel beyond an end of the run counts as that end.
    pub fn time_s(&self, travel_m: f64) -> f64 {
        let Some(Ramps { accel_mps2, length_m, top_mps }) = self.ramps else {
            return (travel_m - self.offset_m) / self.speed_mps;
        };
        let walked_m = (travel_m - self.start_m).max(0.0);
        let left_m = (self.end_m - travel_m).max(0.0);
        if walked_m <= length_m {
            self.start_s + (2.0 * walked_m / accel_mps2).sqrt()
        } else if left_m >= length_m {
            self.start_s + (walked_m + length_m) / top_mps
        } else {
            self.end_s() - (2.0 * left_m / accel_mps2).sqrt()
        }
    }

    /// Travel of the head at a show time. With ramps, the head rests at the ends of the run before and after it.
    pub fn travel_m(&self, time_s: f64) -> f64 {
        let Some(Ramps { accel_mps2, length_m, top_mps }) = self.ramps else {
            return self.speed_mps * time_s + self.offset_m;
        };
        let (elapsed_s, left_s) = ((time_s - self.start_s).max(0.0), (self.end_s() - time_s).max(0.0));
        let ramp_s = top_mps / accel_mps2;
        if elapsed_s <= ramp_s {
            self.start_m + 0.5 * accel_mps2 * elapsed_s * elapsed_s
        } else if left_s >= ramp_s {
            self.start_m + top_mps * elapsed_s - length_m
        } else {
            self.end_m - 0.5 * accel_mps2 * left_s * left_s
        }
    }

    /// Speed of the head at a show time, in metres per show second. It is 0 at both ends of a run with ramps.
    pub fn speed_mps(&self, time_s: f64) -> f64 {
        let Some(Ramps { accel_mps2, top_mps, .. }) = self.ramps else { return self.speed_mps };
        let ramped_s = (time_s - self.start_s).min(self.end_s() - time_s).max(0.0);
        (accel_mps2 * ramped_s).min(top_mps)
    }

    /// Time at which the head leaves.
    pub fn start_s(&self) -> f64 {
        self.start_s
    }

    /// Show time at which the head rests at the run's end. Without ramps: at which it arrives there.
    pub fn end_s(&self) -> f64 {
        match self.ramps {
            None => self.time_s(self.end_m),
            Some(Ramps { top_mps: 0.0, .. }) => self.start_s,
            Some(Ramps { top_mps, length_m, .. }) => {
                self.start_s + (self.end_m - self.start_m + 2.0 * length_m) / top_mps
            }
        }
    }

    /// The greatest speed of the head.
    pub(crate) fn most_speed_mps(&self) -> f64 {
        self.speed_mps
    }

    /// The greatest acceleration of the head, apart from its jumps.
    pub(crate) fn most_accel_mps2(&self) -> f64 {
        self.ramps.map_or(0.0, |ramps| ramps.accel_mps2)
    }

    /// The next instant after `time_s` at which the speed changes at once.
    pub(crate) fn next_jump_s(&self, time_s: f64) -> Option<f64> {
        if self.ramps.is_some() {
            return None;
        }
        [self.start_s, self.end_s()].into_iter().find(|&jump_s| jump_s > time_s)
    }

    /// The head's speed at a travel, and the growth of [`time_s`](Self::time_s) per m/s of planned speed at fixed travel. The
    /// growth of `time_s` per metre is 1 ÷ the speed. `None` where the head brakes for the run's end, because `time_s` there
    /// also depends on the travel of that end.
    pub(crate) fn speed_and_time_rate(&self, travel_m: f64) -> Option<(f64, f64)> {
        let Some(Ramps { accel_mps2, length_m, top_mps }) = self.ramps else {
            return Some((self.speed_mps, -travel_m / (self.speed_mps * self.speed_mps)));
        };
        let walked_m = travel_m - self.start_m;
        if walked_m < length_m {
            let speed_mps = (2.0 * accel_mps2 * walked_m).sqrt();
            return Some((speed_mps, -self.start_s / speed_mps));
        }
        let cruises = self.end_m - travel_m > length_m;
        cruises.then(|| (top_mps, 0.5 / accel_mps2 - travel_m / (top_mps * top_mps)))
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
            let Some((there_mps, per_speed)) = with(speed_mps).speed_and_time_rate(travel_m) else { return Ok(()) };
            let step = 1e-6;
            let ends = [travel_m - step, travel_m + step].map(|travel_m| with(speed_mps).speed_and_time_rate(travel_m));
            let near = |rates: Option<(f64, f64)>| rates.is_some_and(|rates| (rates.0 - there_mps).abs() < 1e-3);
            // Not across the end of a ramp, where the speed is not smooth.
            prop_assume!(ends.into_iter().all(near));
            let by_travel = with(speed_mps).time_s(travel_m + step) - with(speed_mps).time_s(travel_m - step);
            let by_speed = with(speed_mps + step).time_s(travel_m) - with(speed_mps - step).time_s(travel_m);
            prop_assert!((by_travel / (2.0 * step) * there_mps - 1.0).abs() < 1e-4);
            prop_assert!((by_speed / (2.0 * step) - per_speed).abs() < 1e-3 * (1.0 + per_speed.abs()));
        }
    }
}
