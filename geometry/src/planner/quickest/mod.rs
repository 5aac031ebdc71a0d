//! The quickest run of a dragon from rest to rest, and a walk of few planned speeds that is nearly as quick.
//!
//! The route fixes the motion of the dragon but for the head's speed. So the quickest run is a time-optimal parametrisation of
//! a path: the head's squared speed over its travel has a largest value, the *cap*, and a largest slope, twice the acceleration
//! (Bobrow, Dubowsky and Gibson 1985, The International Journal of Robotics Research 4; Pham and Pham 2018, IEEE Transactions on
//! Robotics 34). Here both limits are on the head alone, so one pass forward and one backward find the optimum.
//!
//! 1. `speed_cap` bounds the cap from below and from above, everywhere (see `link_growth`).
//! 2. `curve` finds the quickest walks under both bounds. The optimum takes a time between theirs.
//! 3. `cue_search` approximates the walk under the lower bound by even speeds with ramps between them (`plateaus`).
//! 4. `cue_walk` walks the rounded cues as a head does, and the result is compared with the lower bound of the cap.
//!
//! Where the head also has to rest within the run, steps 2 to 4 are done for each piece between two rests. The pieces share only
//! places at which the head rests, so the quickest run is that of each piece after the other.
//!
//! *Guarantee.* With the cues no handle exceeds the limit anywhere, up to the rounding of a chain. No run within the limits takes
//! less than the stated least time.

mod cue_search;
mod cue_walk;
mod curve;
mod link_growth;
mod plateaus;
mod speed_cap;

use self::cue_search::CueSearch;
use self::cue_walk::CueWalk;
use self::curve::Curve;
use self::speed_cap::SpeedCap;
use super::infeasible::Infeasible;
use crate::dragon::{Dragon, Meter};

/// Rounding of a walk's squared speed, as a share of it.
const ROUNDING: f64 = 1e-10;

/// Limits of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunLimits {
    /// Speed that no handle may exceed, in m/s.
    pub handle_mps: f64,
    /// Speed that the head may not exceed, in m/s.
    pub head_mps: f64,
    /// Largest acceleration of the head, in m/s².
    pub accel_mps2: f64,
}

/// A planned speed of the head. It ramps to this speed with the largest acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedCue {
    /// Time in seconds. At time 0, a head that always walks at the first planned speed is at the travel 0.
    pub at_s: f64,
    /// Metres per second.
    pub speed_mps: f64,
    /// Whether the head rests there at this time, and leaves the rest with this speed.
    pub leaves_rest: bool,
}

/// The quickest run of a dragon, and a run with few planned speeds.
#[derive(Clone, Debug)]
pub struct QuickestRun {
    /// A time that the quickest run does not exceed, in seconds.
    pub optimum_s: f64,
    /// A time that no run within the limits falls below, in seconds.
    pub least_s: f64,
    /// The planned speeds, the first at the start. The head brakes by itself for rests and for the run's end.
    pub cues: Vec<SpeedCue>,
    /// Seconds of the run with these speeds.
    pub duration_s: f64,
    /// A speed that no handle exceeds with these speeds, in m/s.
    pub largest_mps: f64,
    cap: Curve,
    optimum: Curve,
    walk: Curve,
}

impl QuickestRun {
    /// Finds the quickest run of a dragon, and a run of planned speeds that takes at most `1 + within` times as long, with as few
    /// cues as the search finds. If it finds none that quick, the quickest that it finds. `rests_m` are rising travels within the run at which
    /// the head also has to rest. Durations are without the times that it stands there.
    ///
    /// # Errors
    /// A fault ends the run before the route's end, or the dragon's meter is spent.
    ///
    /// # Panics
    /// Panics for a dragon on ground that is not flat, and for a rest that is not between the one before and the run's end.
    pub fn of(dragon: &Dragon, limits: &RunLimits, rests_m: &[f64], within: f64) -> Result<Self, Infeasible> {
        assert!(!dragon.route().is_on_ground(), "links on ground turn in space");
        Infeasible::check(dragon)?;
        let SpeedCap { safe, loose } = SpeedCap::of(dragon, limits)?;
        let [start_m, end_m] = safe.ends_m();
        let places_m = [&[start_m], rests_m, &[end_m]].concat();
        assert!(places_m.is_sorted_by(|one, next| one < next), "the rests lie within the run, in order: {places_m:?}");
        let mut pieces: Vec<Piece> = Vec::with_capacity(places_m.len() - 1);
        for ends_m in places_m.windows(2) {
            let caps = [&safe, &loose].map(|cap| cap.between([ends_m[0], ends_m[1]]));
            let begin_s = pieces.last().map(|piece| piece.walk.end_s);
            pieces.push(Piece::of(caps, limits, within, begin_s, dragon.meter())?);
        }
        let sum = |part: &dyn Fn(&Piece) -> f64| pieces.iter().map(part).sum::<f64>();
        let (optimum_s, least_s) = (sum(&|piece| piece.optimum_s), sum(&|piece| piece.least_s));
        let duration_s = sum(&|piece| piece.walk.duration_s);
        let joined = |part: &dyn Fn(&Piece) -> Curve| Curve::joined(pieces.iter().map(part));
        let (optimum, walk) = (joined(&|piece| piece.optimum.clone()), joined(&|piece| piece.walk.walk.clone()));
        let mut cues = Vec::new();
        for (number, piece) in pieces.iter().enumerate() {
            let first = cues.len();
            cues.extend_from_slice(&piece.walk.cues);
            cues[first].leaves_rest = number > 0;
        }
        let largest_mps = limits.handle_mps * walk.largest_share_of(&safe).sqrt();
        Ok(Self { optimum_s, least_s, cues, duration_s, largest_mps, cap: safe, optimum, walk })
    }

    /// Time at which the head gets to a travel with the planned speeds, if it never waits at a rest.
    pub fn time_s(&self, travel_m: f64) -> f64 {
        let [start_m, end_m] = self.walk.ends_m();
        self.cues[0].at_s + self.walk.between([start_m, travel_m.clamp(start_m, end_m)]).duration_s()
    }

    /// A speed of the head at a travel at which no handle exceeds the limit; nearly the largest such speed.
    pub fn cap_mps(&self, travel_m: f64) -> f64 {
        self.cap.at(travel_m).sqrt()
    }

    /// The head's speed at a travel of the quickest run.
    pub fn optimum_mps(&self, travel_m: f64) -> f64 {
        self.optimum.at(travel_m).sqrt()
    }

    /// The head's speed at a travel with the planned speeds.
    pub fn walk_mps(&self, travel_m: f64) -> f64 {
        self.walk.at(travel_m).sqrt()
    }
}

/// The quickest run from one rest to the next, and its walk to planned speeds.
struct Piece {
    optimum: Curve,
    optimum_s: f64,
    least_s: f64,
    walk: CueWalk,
}

impl Piece {
    /// Steps 2 to 4 under the lower and the upper bound of the cap. `begin_s` is the end of the piece before.
    fn of(
        [safe, loose]: [Curve; 2],
        limits: &RunLimits,
        within: f64,
        begin_s: Option<f64>,
        meter: &Meter,
    ) -> Result<Self, Infeasible> {
        let (slope, most) = (2.0 * limits.accel_mps2, limits.head_mps * limits.head_mps);
        let safe = safe.limited(most);
        let optimum = safe.ramped(slope);
        let optimum_s = optimum.duration_s();
        let least_s = loose.limited(most).ramped(slope).duration_s();
        let search = CueSearch { optimum: &optimum, slope, most_s: (1.0 + within) * optimum_s, meter };
        let even = safe.least(safe.ends_m());
        let plateaus = search.plateaus(even);
        meter.check(safe.ends_m()[0])?;
        let walks = [plateaus, search.even(even)].map(|plateaus| CueWalk::of(&plateaus, slope, begin_s));
        let is_proved = |walk: &CueWalk| walk.walk.largest_share_of(&safe) <= 1.0 + ROUNDING;
        let walk = walks.into_iter().find(is_proved).expect("a walk at the least cap");
        // Where the walks are equal, their durations differ by rounding.
        let optimum_s = optimum_s.min(walk.duration_s);
        Ok(Self { optimum, optimum_s, least_s: least_s.min(optimum_s), walk })
    }
}
