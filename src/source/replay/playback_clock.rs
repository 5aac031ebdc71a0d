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
