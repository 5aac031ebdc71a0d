//! When the frames of a recording are due again. Pure: the present is an argument.

/// Keeps frames as far apart as they were due when they were recorded.
///
/// What comes too late is not made up for: the frame is sent at once, and all behind it are put off by as much, so that
/// no burst follows on a stall. Each such time is counted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    /// A recorded instant, and the one that it is now.
    anchor: Option<(u64, u64)>,
    overruns: u64,
}

impl Pace {
    /// When a frame is due that was due at `recorded_ns`, as an instant of the clock that `now_ns` is of; the first one
    /// is due now. An instant before the frame before, which no recorder writes, is now as well.
    pub fn due_ns(&mut self, recorded_ns: u64, now_ns: u64) -> u64 {
        let (from_ns, to_ns) = *self.anchor.get_or_insert((recorded_ns, now_ns));
        let due_ns = to_ns.saturating_add(recorded_ns.saturating_sub(from_ns));
        if due_ns >= now_ns {
            return due_ns;
        }
        self.anchor = Some((recorded_ns, now_ns));
        self.overruns += 1;
        now_ns
    }

    /// How often frames were put off.
    pub fn overruns(&self) -> u64 {
        self.overruns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_as_far_apart_as_they_were() {
        let mut pace = Pace::default();
        let due: Vec<u64> = [700, 800, 1_800, 1_801].map(|recorded_ns| pace.due_ns(recorded_ns, 50)).into();
        assert_eq!(due, [50, 150, 1_150, 1_151]);
        assert_eq!(pace.overruns(), 0);
    }

    #[test]
    fn a_stall_puts_off_what_follows_and_is_counted_once() {
        let mut pace = Pace::default();
        assert_eq!(pace.due_ns(0, 0), 0);
        assert_eq!(pace.due_ns(100, 5_000), 5_000, "4900 too late");
        assert_eq!([pace.due_ns(200, 5_001), pace.due_ns(300, 5_100)], [5_100, 5_200]);
        assert_eq!(pace.overruns(), 1);
    }

    #[test]
    fn a_frame_that_is_due_now_is_not_late() {
        let mut pace = Pace::default();
        pace.due_ns(0, 10);
        assert_eq!((pace.due_ns(5, 15), pace.overruns()), (15, 0));
    }

    #[test]
    fn instants_that_no_recorder_writes_overflow_nothing() {
        let mut pace = Pace::default();
        assert_eq!(pace.due_ns(1_000, 100), 100);
        assert_eq!(pace.due_ns(3, 200), 200, "before the frame before");
        assert_eq!(pace.due_ns(u64::MAX, 300), u64::MAX);
    }
}
