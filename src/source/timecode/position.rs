//! Where a timecode is within its day. Pure.

use super::{Clock, FrameRate, Malformed};

/// A position of a timecode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// Seconds from 00:00:00:00.
    pub since_midnight_s: f64,
    /// Seconds after which it is 00:00:00:00 again.
    pub day_s: f64,
}

impl Position {
    /// The position that a clock at a frame rate stands for.
    ///
    /// # Errors
    /// [`Malformed`] for a clock that never shows.
    pub fn of_clock(clock: Clock, rate: FrameRate) -> Result<Self, Malformed> {
        Ok(Self { since_midnight_s: clock.position_s(rate)?, day_s: rate.day_s() })
    }

    /// The position so many seconds from 00:00:00:00, of a clock that tells seconds and no frames.
    ///
    /// # Errors
    /// [`Malformed`] for what is not within a day.
    pub fn of_seconds(since_midnight_s: f64) -> Result<Self, Malformed> {
        const DAY_S: f64 = 86_400.0;
        let is_within = (0.0..DAY_S).contains(&since_midnight_s);
        if is_within { Ok(Self { since_midnight_s, day_s: DAY_S }) } else { Err(Malformed) }
    }

    /// The way to a later position in seconds, at most half a day, negative where it is back.
    ///
    /// ```
    /// use bench_dragon::source::timecode::Position;
    ///
    /// let [late, early] = [86_399.5, 0.25].map(|seconds| Position::of_seconds(seconds).expect("within a day"));
    /// assert_eq!((late.step_to_s(early), early.step_to_s(late)), (0.75, -0.75));
    /// ```
    pub fn step_to_s(self, later: Self) -> f64 {
        let half_s = 0.5 * self.day_s;
        (later.since_midnight_s - self.since_midnight_s + half_s).rem_euclid(self.day_s) - half_s
    }
}
