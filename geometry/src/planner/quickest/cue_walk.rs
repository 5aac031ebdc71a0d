//! The walk of a head to planned speeds at planned times.
//!
//! Times and speeds are rounded, so that people can read them. A slower speed is ordered a little earlier, and a faster one a little
//! later; every speed is rounded down. So the head is never faster, at any travel, than with the exact ones.

use super::SpeedCue;
use super::curve::Curve;
use super::plateaus::Plateaus;

/// Times are whole numbers of microseconds.
const STEPS_PER_S: f64 = 1e6;

/// Significant digits of speeds.
const DIGITS: i32 = 6;

/// Rounding of a speed or a time before it is rounded to its digits, relative to it.
const ROUNDING: f64 = 1e-13;

/// The walk to rounded cues.
pub(super) struct CueWalk {
    pub(super) cues: Vec<SpeedCue>,
    /// Squared speed over travel.
    pub(super) walk: Curve,
    pub(super) duration_s: f64,
    /// Time at which the head rests at the end.
    pub(super) end_s: f64,
}

/// The head while it walks.
struct Head {
    time_s: f64,
    travel_m: f64,
    speed_mps: f64,
    target_mps: f64,
    accel_mps2: f64,
    knots: Vec<[f64; 2]>,
}

impl CueWalk {
    /// The walk of a head with a largest slope of its squared speed. It begins at `begin_s`; without, its run begins, and the travel at
    /// time 0 is 0 for a head that always walks at its first planned speed.
    pub(super) fn of(plateaus: &Plateaus, slope: f64, begin_s: Option<f64>) -> Self {
        let [start_m, end_m] = plateaus.ends_m();
        let (turns, accel_mps2, knots) = (plateaus.turns(), 0.5 * slope, vec![[start_m, 0.0]]);
        let start_s = begin_s.unwrap_or_else(|| start_m / rounded_down(turns[0].square.sqrt()));
        let mut head = Head { time_s: start_s, travel_m: start_m, speed_mps: 0.0, target_mps: 0.0, accel_mps2, knots };
        let mut cues: Vec<SpeedCue> = Vec::with_capacity(turns.len());
        for turn in turns {
            let speed_mps = rounded_down(turn.square.sqrt());
            let exact = head.time_at(turn.travel_m) * STEPS_PER_S;
            let is_faster = speed_mps > head.target_mps;
            let rounded = if is_faster {
                (exact - ROUNDING * exact.abs()).ceil()
            } else {
                (exact + ROUNDING * exact.abs()).floor()
            };
            let at_s = if cues.is_empty() { start_s } else { (rounded / STEPS_PER_S).max(head.time_s) };
            head.walk_until(at_s);
            head.target_mps = speed_mps;
            cues.push(SpeedCue { at_s, speed_mps, leaves_rest: false });
        }
        head.walk_to_rest(end_m);
        Self { cues, duration_s: head.time_s - start_s, walk: Curve::new(head.knots), end_s: head.time_s }
    }
}

/// The largest number of few digits that is not above a speed.
fn rounded_down(speed_mps: f64) -> f64 {
    let digits = DIGITS - 1 - speed_mps.log10().floor() as i32;
    // A power of ten is exact, and the quotient by it is the number nearest to those digits.
    let scale = 10_f64.powi(digits.abs());
    if digits >= 0 {
        (speed_mps * scale * (1.0 + ROUNDING)).floor() / scale
    } else {
        (speed_mps / scale).floor() * scale
    }
}

impl Head {
    /// Time at which the head gets to a travel, with its present target.
    fn time_at(&self, travel_m: f64) -> f64 {
        let left_m = travel_m - self.travel_m;
        let ramp_m = self.ramp_m();
        if left_m <= 0.0 {
            return self.time_s;
        }
        if left_m >= ramp_m {
            let ramp_s = (self.target_mps - self.speed_mps).abs() / self.accel_mps2;
            return self.time_s + ramp_s + (left_m - ramp_m) / self.target_mps;
        }
        let change = 2.0 * self.accel_mps2 * left_m * (self.target_mps - self.speed_mps).signum();
        self.time_s + 2.0 * left_m / (self.speed_mps + (self.speed_mps * self.speed_mps + change).max(0.0).sqrt())
    }

    fn ramp_m(&self) -> f64 {
        (self.target_mps * self.target_mps - self.speed_mps * self.speed_mps).abs() / (2.0 * self.accel_mps2)
    }

    fn walk_until(&mut self, time_s: f64) {
        let ramp_s = ((self.target_mps - self.speed_mps).abs() / self.accel_mps2).min(time_s - self.time_s);
        if ramp_s > 0.0 {
            let reaches = ramp_s < time_s - self.time_s;
            let change_mps = self.accel_mps2 * ramp_s * (self.target_mps - self.speed_mps).signum();
            let speed_mps = if reaches { self.target_mps } else { self.speed_mps + change_mps };
            self.travel_m += 0.5 * (self.speed_mps + speed_mps) * ramp_s;
            self.stand_at(speed_mps);
        }
        let even_s = time_s - self.time_s - ramp_s.max(0.0);
        if even_s > 0.0 {
            self.travel_m += self.speed_mps * even_s;
            self.stand_at(self.speed_mps);
        }
        self.time_s = time_s;
    }

    /// Walks at the target, and brakes to rest at a travel.
    fn walk_to_rest(&mut self, end_m: f64) {
        let slope = 2.0 * self.accel_mps2;
        let most = 0.5 * (self.speed_mps * self.speed_mps + slope * (end_m - self.travel_m));
        self.target_mps = self.target_mps.min(most.sqrt().max(self.speed_mps));
        self.walk_until(self.time_s + (self.target_mps - self.speed_mps).abs() / self.accel_mps2);
        self.speed_mps = self.target_mps;
        let even_m = end_m - self.travel_m - self.speed_mps * self.speed_mps / slope;
        if even_m > 0.0 && self.speed_mps > 0.0 {
            self.walk_until(self.time_s + even_m / self.speed_mps);
        }
        self.time_s += self.speed_mps / self.accel_mps2;
        self.travel_m = end_m;
        self.stand_at(0.0);
    }

    fn stand_at(&mut self, speed_mps: f64) {
        self.speed_mps = speed_mps;
        self.knots.push([self.travel_m, speed_mps * speed_mps]);
    }
}
