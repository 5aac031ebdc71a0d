//! A run at one planned speed, in closed form.
//!
//! The head starts from rest, accelerates evenly to the planned speed, walks at that speed, and brakes evenly. It rests exactly
//! at the run's end. If the run is too short for the planned speed, the head brakes as soon as it stops accelerating. Without a
//! largest acceleration it walks at the planned speed throughout. The server walks the same way. Its `motion` plans phase by
//! phase, because commands may change the plan; a test there compares the two.

use super::timetable::TimeRates;

/// Travel of the head over time, at one planned speed between two ramps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EvenRun {
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

impl EvenRun {
    /// The same run, which begins later by `delay_s`, or earlier if it is below 0.
    pub(super) fn delayed(self, delay_s: f64) -> Self {
        Self { offset_m: self.offset_m - self.speed_mps * delay_s, start_s: self.start_s + delay_s, ..self }
    }

    /// A run to a travel from the travel `offset_m` + `speed_mps` × `start_s`.
    pub(super) fn with_offset(
        offset_m: f64,
        speed_mps: f64,
        accel_mps2: Option<f64>,
        start_s: f64,
        end_travel_m: f64,
    ) -> Self {
        Self::from_start([offset_m, speed_mps * start_s + offset_m], speed_mps, accel_mps2, start_s, end_travel_m)
    }

    /// The same run, which ends at another travel.
    pub(super) fn ending_at(self, end_travel_m: f64) -> Self {
        Self::from_start([self.offset_m, self.start_m], self.speed_mps, self.accel_mps2(), self.start_s, end_travel_m)
    }

    fn from_start(
        [offset_m, start_m]: [f64; 2],
        speed_mps: f64,
        accel_mps2: Option<f64>,
        start_s: f64,
        end_travel_m: f64,
    ) -> Self {
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
    pub(super) fn time_s(&self, travel_m: f64) -> f64 {
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
    pub(super) fn travel_m(&self, time_s: f64) -> f64 {
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
    pub(super) fn speed_mps(&self, time_s: f64) -> f64 {
        let Some(Ramps { accel_mps2, top_mps, .. }) = self.ramps else { return self.speed_mps };
        let ramped_s = (time_s - self.start_s).min(self.end_s() - time_s).max(0.0);
        (accel_mps2 * ramped_s).min(top_mps)
    }

    /// The ramps, the walk between them, and the rest at the end.
    pub(super) fn pieces(&self) -> Vec<[f64; 4]> {
        let (start_s, end_s) = (self.start_s, self.end_s());
        let rest = [end_s, self.end_m, 0.0, 0.0];
        let Some(Ramps { accel_mps2, top_mps, length_m }) = self.ramps else {
            return vec![[start_s, self.start_m, self.speed_mps, 0.0], rest];
        };
        let ramp_s = top_mps / accel_mps2;
        vec![
            [start_s, self.start_m, 0.0, accel_mps2],
            [start_s + ramp_s, self.start_m + length_m, top_mps, 0.0],
            [end_s - ramp_s, self.end_m - length_m, top_mps, -accel_mps2],
            rest,
        ]
    }

    /// Time at which the head leaves.
    pub(super) fn start_s(&self) -> f64 {
        self.start_s
    }

    /// Show time at which the head rests at the run's end. Without ramps: at which it arrives there.
    pub(super) fn end_s(&self) -> f64 {
        match self.ramps {
            None => self.time_s(self.end_m),
            Some(Ramps { top_mps: 0.0, .. }) => self.start_s,
            Some(Ramps { top_mps, length_m, .. }) => {
                self.start_s + (self.end_m - self.start_m + 2.0 * length_m) / top_mps
            }
        }
    }

    /// The speed between the ramps, if the run is long enough for it.
    pub(super) fn planned_mps(&self) -> f64 {
        self.speed_mps
    }

    /// The acceleration of the ramps.
    pub(super) fn accel_mps2(&self) -> Option<f64> {
        self.ramps.map(|ramps| ramps.accel_mps2)
    }

    /// The next instant after `time_s` at which the speed changes at once.
    pub(super) fn next_jump_s(&self, time_s: f64) -> Option<f64> {
        if self.ramps.is_some() {
            return None;
        }
        [self.start_s, self.end_s()].into_iter().find(|&jump_s| jump_s > time_s)
    }

    /// The growth of [`time_s`](Self::time_s) at a travel. `None` where the head brakes for the run's end, because `time_s` there
    /// also depends on the travel of that end.
    pub(super) fn time_rates(&self, travel_m: f64) -> Option<TimeRates> {
        let Some(Ramps { accel_mps2, length_m, top_mps }) = self.ramps else {
            let per_speed = -travel_m / (self.speed_mps * self.speed_mps);
            return Some(TimeRates { speed_mps: self.speed_mps, per_speed, per_accel: 0.0 });
        };
        let walked_m = travel_m - self.start_m;
        if walked_m < length_m {
            let speed_mps = (2.0 * accel_mps2 * walked_m).sqrt();
            let (per_speed, per_accel) = (-self.start_s / speed_mps, -0.5 * speed_mps / (accel_mps2 * accel_mps2));
            return Some(TimeRates { speed_mps, per_speed, per_accel });
        }
        let cruises = self.end_m - travel_m > length_m;
        cruises.then(|| TimeRates {
            speed_mps: top_mps,
            per_speed: 0.5 / accel_mps2 - travel_m / (top_mps * top_mps),
            per_accel: -0.5 * top_mps / (accel_mps2 * accel_mps2),
        })
    }
}
