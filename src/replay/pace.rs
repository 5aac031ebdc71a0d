//! When the frames of a recording are due again. Pure: the present is an argument.

/// Keeps frames as far apart as they were due when they were recorded, or nearer together or further apart by a factor.
///
/// What comes too late is not made up for: the frame is sent at once, and all behind it are put off by as much, so that
/// no burst follows on a stall. Each such time is counted.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    rate: f64,
    /// A recorded instant, and the one that it is now.
    anchor: Option<(u64, u64)>,
    /// When the last frame was due, and how long after the one before.
    last: Option<(u64, u64)>,
    overruns: u64,
}

impl Pace {
    /// Recorded seconds per second, above 0.
    pub fn new(rate: f64) -> Self {
        Self { rate, anchor: None, last: None, overruns: 0 }
    }

    /// When a frame is due that was due at `recorded_ns`, as an instant of the clock that `now_ns` is of; the first one
    /// is due now. An instant before the frame before, which no recorder writes, is now as well.
    pub fn due_ns(&mut self, recorded_ns: u64, now_ns: u64) -> u64 {
        let due_ns = self.planned_ns(recorded_ns, now_ns).max(now_ns);
        self.last = Some((due_ns, self.last.map_or(0, |(last_ns, _)| due_ns.saturating_sub(last_ns))));
        due_ns
    }

    /// Begins afresh: the next frame is the first of another lap. It follows on the last one as that did on the one before,
    /// or is due now where that is past.
    pub fn begin_lap(&mut self) {
        self.anchor = None;
    }

    /// How often frames were put off.
    pub fn overruns(&self) -> u64 {
        self.overruns
    }

    fn planned_ns(&mut self, recorded_ns: u64, now_ns: u64) -> u64 {
        let Some((from_ns, to_ns)) = self.anchor else {
            let follows_ns = self.last.map_or(now_ns, |(last_ns, step_ns)| last_ns.saturating_add(step_ns));
            let due_ns = follows_ns.max(now_ns);
            self.anchor = Some((recorded_ns, due_ns));
            return due_ns;
        };
        // Exact at rate 1 for a hundred days: from the anchor, so that rounding does not add up.
        let elapsed_ns = recorded_ns.saturating_sub(from_ns) as f64 / self.rate;
        let due_ns = to_ns.saturating_add(elapsed_ns.round() as u64);
        if due_ns < now_ns {
            self.anchor = Some((recorded_ns, now_ns));
            self.overruns += 1;
        }
        due_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_as_far_apart_as_they_were() {
        let mut pace = Pace::new(1.0);
        let due: Vec<u64> = [700, 800, 1_800, 1_801].map(|recorded_ns| pace.due_ns(recorded_ns, 50)).into();
        assert_eq!(due, [50, 150, 1_150, 1_151]);
        assert_eq!(pace.overruns(), 0);
    }

    #[test]
    fn a_stall_puts_off_what_follows_and_is_counted_once() {
        let mut pace = Pace::new(1.0);
        assert_eq!(pace.due_ns(0, 0), 0);
        assert_eq!(pace.due_ns(100, 5_000), 5_000, "4900 too late");
        assert_eq!([pace.due_ns(200, 5_001), pace.due_ns(300, 5_100)], [5_100, 5_200]);
        assert_eq!(pace.overruns(), 1);
    }

    #[test]
    fn a_frame_that_is_due_now_is_not_late() {
        let mut pace = Pace::new(1.0);
        pace.due_ns(0, 10);
        assert_eq!((pace.due_ns(5, 15), pace.overruns()), (15, 0));
    }

    #[test]
    fn at_another_rate_frames_are_nearer_together_or_further_apart_without_drift() {
        for (rate, last_ns) in [(10.0, 1_000_000_000), (3.0, 3_333_333_333), (0.01, 1_000_000_000_000)] {
            let mut pace = Pace::new(rate);
            let due: Vec<u64> = (0..=10_000).map(|tick| pace.due_ns(5 + tick * 1_000_000, 0)).collect();
            assert_eq!((due[0], due[10_000], pace.overruns()), (0, last_ns, 0), "at rate {rate}");
        }
    }

    #[test]
    fn another_lap_follows_as_the_next_frame_would_have() {
        let mut pace = Pace::new(1.0);
        let mut lap = |now_ns| [700, 800, 900].map(|recorded_ns| pace.due_ns(recorded_ns, now_ns));
        assert_eq!(lap(50), [50, 150, 250]);
        pace.begin_lap();
        let mut lap = |now_ns| [700, 800, 900].map(|recorded_ns| pace.due_ns(recorded_ns, now_ns));
        assert_eq!(lap(260), [350, 450, 550]);
        pace.begin_lap();
        assert_eq!(
            (pace.due_ns(700, 9_000), pace.overruns()),
            (9_000, 0),
            "it took long to begin, which is no overrun"
        );
    }

    #[test]
    fn instants_that_no_recorder_writes_overflow_nothing() {
        let mut pace = Pace::new(1.0);
        assert_eq!(pace.due_ns(1_000, 100), 100);
        assert_eq!(pace.due_ns(3, 200), 200, "before the frame before");
        assert_eq!(pace.due_ns(u64::MAX, 300), u64::MAX);
    }
}
