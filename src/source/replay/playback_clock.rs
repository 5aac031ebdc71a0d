//! When the frames of a recording are due again. Pure: the present is an argument.

use crate::source::server::motion::FASTEST;

/// Keeps frames as far apart as they were due when they were recorded, or nearer together or further apart by a factor.
///
/// A frame that comes too late is sent at once; each such time is counted. The frames behind it follow a tenth faster than
/// planned until the replay is on time again: every frame is published, without a burst.
#[derive(Clone, Copy, Debug)]
pub struct PlaybackClock {
    rate: f64,
    /// A recorded instant, and the one at which it is planned.
    anchor: Option<(u64, u64)>,
    /// The frame that came too late last, while the replay makes up for it: when it was due, recorded and now.
    put_off: Option<(u64, u64)>,
    /// When the last frame was due, and how long after the one before.
    last: Option<(u64, u64)>,
    overruns: u64,
    behind_ns: u64,
}

impl PlaybackClock {
    /// Recorded seconds per second, above 0.
    pub fn new(rate: f64) -> Self {
        Self { rate, anchor: None, put_off: None, last: None, overruns: 0, behind_ns: 0 }
    }

    /// When a frame is due that was due at `recorded_ns`, as an instant of the clock that `now_ns` is of; the first one
    /// is due now. An instant before the frame before, which no recorder writes, is now as well.
    pub fn due_ns(&mut self, recorded_ns: u64, now_ns: u64) -> u64 {
        let planned_ns = self.planned_ns(recorded_ns, now_ns);
        let next_ns = self.made_up_ns(recorded_ns, planned_ns);
        let due_ns = next_ns.max(now_ns);
        if next_ns < now_ns {
            self.put_off = Some((recorded_ns, due_ns));
            self.overruns += 1;
        }
        self.behind_ns = due_ns - planned_ns;
        self.last = Some((due_ns, self.last.map_or(0, |(last_ns, _)| due_ns.saturating_sub(last_ns))));
        due_ns
    }

    /// Begins afresh: the next frame is the first of another lap. It follows on the last one as that did on the one before,
    /// or is due now where that is past.
    pub fn begin_lap(&mut self) {
        (self.anchor, self.put_off) = (None, None);
    }

    /// How often a frame came too late.
    pub fn overruns(&self) -> u64 {
        self.overruns
    }

    /// How far the replay is behind its plan, in nanoseconds.
    pub fn behind_ns(&self) -> u64 {
        self.behind_ns
    }

    /// Recorded seconds per second at which the frame that is due follows on the one before.
    pub fn rate(&self) -> f64 {
        if self.put_off.is_some() { FASTEST * self.rate } else { self.rate }
    }

    /// When the frame is due if nothing ever came too late.
    fn planned_ns(&mut self, recorded_ns: u64, now_ns: u64) -> u64 {
        let Some((from_ns, to_ns)) = self.anchor else {
            let follows_ns = self.last.map_or(now_ns, |(last_ns, step_ns)| last_ns.saturating_add(step_ns));
            let due_ns = follows_ns.max(now_ns);
            self.anchor = Some((recorded_ns, due_ns));
            return due_ns;
        };
        // Exact at rate 1 for a hundred days: from the anchor, so that rounding does not add up.
        after_ns(to_ns, recorded_ns.saturating_sub(from_ns), self.rate)
    }

    /// When it is due while the replay makes up for what came too late.
    fn made_up_ns(&mut self, recorded_ns: u64, planned_ns: u64) -> u64 {
        let Some((from_ns, to_ns)) = self.put_off else { return planned_ns };
        let made_up_ns = after_ns(to_ns, recorded_ns.saturating_sub(from_ns), FASTEST * self.rate);
        if made_up_ns <= planned_ns {
            self.put_off = None;
        }
        made_up_ns.max(planned_ns)
    }
}

/// The instant that lies a recorded time after another, at a rate.
fn after_ns(from_ns: u64, recorded_ns: u64, rate: f64) -> u64 {
    from_ns.saturating_add((recorded_ns as f64 / rate).round() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_as_far_apart_as_they_were() {
        let mut clock = PlaybackClock::new(1.0);
        let due: Vec<u64> = [700, 800, 1_800, 1_801].map(|recorded_ns| clock.due_ns(recorded_ns, 50)).into();
        assert_eq!(due, [50, 150, 1_150, 1_151]);
        assert_eq!(clock.overruns(), 0);
    }

    #[test]
    fn a_stall_is_counted_once_and_made_up_a_tenth_faster() {
        let mut clock = PlaybackClock::new(1.0);
        assert_eq!(clock.due_ns(0, 0), 0);
        assert_eq!((clock.due_ns(1_100, 1_350), clock.behind_ns()), (1_350, 250), "250 too late");
        let rest: Vec<_> =
            (2..6).map(|frame| (clock.due_ns(1_100 * frame, 1_351), clock.behind_ns(), clock.rate())).collect();
        assert_eq!(rest, [(2_350, 150, FASTEST), (3_350, 50, FASTEST), (4_400, 0, 1.0), (5_500, 0, 1.0)]);
        assert_eq!(clock.overruns(), 1);
    }

    #[test]
    fn a_machine_that_is_too_slow_makes_no_burst() {
        let mut clock = PlaybackClock::new(1.0);
        let due: Vec<u64> = (0..1_000).map(|frame| clock.due_ns(100 * frame, 150 * frame)).collect();
        assert!(due.windows(2).all(|pair| pair[1] - pair[0] == 150), "each frame when it is there");
        assert_eq!((clock.overruns(), clock.behind_ns()), (999, 50 * 999));
    }

    #[test]
    fn a_frame_that_is_due_now_is_not_late() {
        let mut clock = PlaybackClock::new(1.0);
        clock.due_ns(0, 10);
        assert_eq!((clock.due_ns(5, 15), clock.overruns()), (15, 0));
    }

    #[test]
    fn at_another_rate_frames_are_nearer_together_or_further_apart_without_drift() {
        for (rate, last_ns) in [(10.0, 1_000_000_000), (3.0, 3_333_333_333), (0.01, 1_000_000_000_000)] {
            let mut clock = PlaybackClock::new(rate);
            let due: Vec<u64> = (0..=10_000).map(|tick| clock.due_ns(5 + tick * 1_000_000, 0)).collect();
            assert_eq!((due[0], due[10_000], clock.overruns()), (0, last_ns, 0), "at rate {rate}");
        }
    }

    #[test]
    fn another_lap_follows_as_the_next_frame_would_have() {
        let mut clock = PlaybackClock::new(1.0);
        let mut lap = |now_ns| [700, 800, 900].map(|recorded_ns| clock.due_ns(recorded_ns, now_ns));
        assert_eq!(lap(50), [50, 150, 250]);
        clock.begin_lap();
        let mut lap = |now_ns| [700, 800, 900].map(|recorded_ns| clock.due_ns(recorded_ns, now_ns));
        assert_eq!(lap(260), [350, 450, 550]);
        clock.begin_lap();
        assert_eq!(
            (clock.due_ns(700, 9_000), clock.overruns()),
            (9_000, 0),
            "it took long to begin, which is no overrun"
        );
    }

    #[test]
    fn instants_that_no_recorder_writes_overflow_nothing() {
        let mut clock = PlaybackClock::new(1.0);
        assert_eq!(clock.due_ns(1_000, 100), 100);
        assert_eq!(clock.due_ns(3, 200), 200, "before the frame before");
        assert_eq!(clock.due_ns(u64::MAX, 300), u64::MAX);
    }
}
