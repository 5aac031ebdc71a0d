//! Due times of replayed frames. Pure: the present is an argument.

use crate::source::server::motion::FASTEST;

/// Converts recorded due times to due times of the replay: the recorded distances, divided by a rate.
///
/// A late frame is sent at once and counted. The frames behind it follow a tenth faster than planned until the replay
/// is on time again. So every frame is published, without a burst.
#[derive(Clone, Copy, Debug)]
pub struct PlaybackClock {
    rate: f64,
    /// A recorded instant, and the planned instant of its replay.
    anchor: Option<(u64, u64)>,
    /// The last late frame, while the replay catches up: its recorded and its actual due time.
    put_off: Option<(u64, u64)>,
    /// Due time of the last frame, and its distance from the frame before.
    last: Option<(u64, u64)>,
    overruns: u64,
    behind_ns: u64,
}

impl PlaybackClock {
    /// Creates a clock with a rate in recorded seconds per second, above 0.
    pub fn new(rate: f64) -> Self {
        Self { rate, anchor: None, put_off: None, last: None, overruns: 0, behind_ns: 0 }
    }

    /// Returns the due time of a frame that was due at `recorded_ns`, on the clock of `now_ns`. The first frame is due
    /// now. So is a frame that was due before the frame in front of it; no recorder writes such frames.
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

    /// Begins a new lap with the next frame, or goes on after a standstill. It follows the last frame at the distance
    /// of the last two frames, or now if that instant has passed.
    pub fn begin_lap(&mut self) {
        (self.anchor, self.put_off) = (None, None);
    }

    /// Begins elsewhere in the recording with the next frame. It is due now.
    pub fn begin_elsewhere(&mut self) {
        self.begin_lap();
        self.last = None;
    }

    /// Changes the rate, and begins anew with the next frame as [`PlaybackClock::begin_lap`].
    pub fn set_rate(&mut self, rate: f64) {
        self.rate = rate;
        self.begin_lap();
    }

    /// Number of late frames.
    pub fn overruns(&self) -> u64 {
        self.overruns
    }

    /// How far the replay is behind its plan, in nanoseconds.
    pub fn behind_ns(&self) -> u64 {
        self.behind_ns
    }

    /// Rate at which the present frame follows the one before, in recorded seconds per second.
    pub fn rate(&self) -> f64 {
        if self.put_off.is_some() { FASTEST * self.rate } else { self.rate }
    }

    /// Due time of the frame as if no frame had been late.
    fn planned_ns(&mut self, recorded_ns: u64, now_ns: u64) -> u64 {
        let Some((from_ns, to_ns)) = self.anchor else {
            let follows_ns = self.last.map_or(now_ns, |(last_ns, step_ns)| last_ns.saturating_add(step_ns));
            let due_ns = follows_ns.max(now_ns);
            self.anchor = Some((recorded_ns, due_ns));
            return due_ns;
        };
        // Counted from the anchor, so that rounding does not add up. At rate 1 this is exact for a hundred days.
        after_ns(to_ns, recorded_ns.saturating_sub(from_ns), self.rate)
    }

    /// Due time of the frame while the replay catches up.
    fn made_up_ns(&mut self, recorded_ns: u64, planned_ns: u64) -> u64 {
        let Some((from_ns, to_ns)) = self.put_off else { return planned_ns };
        let made_up_ns = after_ns(to_ns, recorded_ns.saturating_sub(from_ns), FASTEST * self.rate);
        if made_up_ns <= planned_ns {
            self.put_off = None;
        }
        made_up_ns.max(planned_ns)
    }
}

/// Returns the instant that follows `from_ns` by a recorded time at a rate.
fn after_ns(from_ns: u64, recorded_ns: u64, rate: f64) -> u64 {
    from_ns.saturating_add((recorded_ns as f64 / rate).round() as u64)
}
