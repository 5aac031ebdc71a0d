//! What a turn must keep so that people can dance it.

/// Limits that a dragon keeps on its whole passage through a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Staging {
    /// Every pair of boards stays further apart than this, in metres; with 0 they may be as near as they like but do not
    /// touch.
    pub clearance_m: f64,
    /// No handle is faster than the head by more than this factor, 1 or more.
    pub speed_ratio: f64,
}

impl Staging {
    /// Boards that do not touch, and handles of any speed: what can be walked at all.
    pub const LIMITLESS: Self = Self { clearance_m: 0.0, speed_ratio: f64::INFINITY };

    /// Whether speeds are limited.
    pub(super) fn limits_speed(&self) -> bool {
        self.speed_ratio < f64::INFINITY
    }
}
