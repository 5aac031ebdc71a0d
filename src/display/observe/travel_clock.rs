//! From the head's travel to show time.

/// When the head comes to a travel: it is somewhere now, and walks on at one speed.
///
/// ```
/// use bench_dragon::display::observe::TravelClock;
///
/// let clock = TravelClock { travel_m: 100.0, time_s: 200.0, speed_mps: 0.5 };
/// assert_eq!(clock.time_s(101.0), 202.0);
/// assert_eq!(clock.time_s(99.0), 198.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TravelClock {
    /// Where the head is, in metres.
    pub travel_m: f64,
    /// Show time then, in seconds.
    pub time_s: f64,
    /// The speed at which it walks, or will walk on where it stands, in metres per show second; over 0.
    pub speed_mps: f64,
}

impl TravelClock {
    /// Show time at which the head is at a travel, in seconds; of travel behind it, when it would have been there at this speed.
    pub fn time_s(&self, travel_m: f64) -> f64 {
        self.time_s + (travel_m - self.travel_m) / self.speed_mps
    }
}
