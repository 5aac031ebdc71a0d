//! The two clocks of a recording: the bus counts `CLOCK_MONOTONIC`, a recording counts Unix time.

/// The one offset by which a recording turns monotonic instants into Unix time.
///
/// It is fixed when the recording starts, so a step of the system clock leaves the distances between frames as they
/// were.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timeline {
    unix_minus_monotonic_ns: i64,
}

impl Timeline {
    /// A timeline on which the monotonic instant 0 was `unix_minus_monotonic_ns` after 1970.
    pub fn new(unix_minus_monotonic_ns: i64) -> Self {
        Self { unix_minus_monotonic_ns }
    }

    /// Unix time of a monotonic instant, both in nanoseconds; 0 for an instant before 1970.
    pub fn unix_ns(self, monotonic_ns: u64) -> u64 {
        monotonic_ns.saturating_add_signed(self.unix_minus_monotonic_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::Timeline;

    #[test]
    fn distances_between_instants_are_kept() {
        let timeline = Timeline::new(1_700_000_000_000_000_007);
        assert_eq!(timeline.unix_ns(5_000) - timeline.unix_ns(2_000), 3_000);
        assert_eq!(timeline.unix_ns(3), 1_700_000_000_000_000_010);
    }

    #[test]
    fn an_instant_before_1970_is_1970() {
        assert_eq!(Timeline::new(-10).unix_ns(3), 0);
    }
}
