//! Timecode as hours, minutes, seconds and frames (SMPTE ST 12-1), and its position within a day.

use std::fmt;
use std::str::FromStr;

use super::Malformed;

/// Frame rate and counting method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FrameRate {
    /// Film: 24.
    Film,
    /// EBU: 25.
    #[default]
    Ebu,
    /// 30 000 / 1001, about 29.97, with drop-frame counting. Frames are numbered as at 30 a second. The numbers 0 and 1
    /// are skipped in each minute except every tenth, so that the count follows the time of day.
    DropFrame,
    /// 30 000 / 1001, about 29.97, with all numbers. The count is 86.4 s longer than the time of day after 24 hours of the clock.
    NonDrop,
    /// SMPTE: 30.
    Smpte,
}

/// Reading of a timecode clock: hours, minutes, seconds and frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock {
    /// 0 to 23.
    pub hours: u32,
    /// 0 to 59.
    pub minutes: u32,
    /// 0 to 59.
    pub seconds: u32,
    /// From 0 to [`FrameRate::numbers_per_second`] − 1.
    pub frames: u32,
}

impl FrameRate {
    /// Returns the rate with this number of frames a second, as usually rounded; `None` for any other number.
    pub fn of(frames_per_second: f64) -> Option<Self> {
        match frames_per_second {
            24.0 => Some(Self::Film),
            25.0 => Some(Self::Ebu),
            30.0 => Some(Self::Smpte),
            // 29.97 is 29.970 029…, rounded. The tolerance also admits an `f32`.
            _ if (frames_per_second - 30_000.0 / 1001.0).abs() < 1e-4 => Some(Self::DropFrame),
            _ => None,
        }
    }

    /// Frames a second.
    pub fn frames_per_second(self) -> f64 {
        let (frames, seconds) = self.ratio();
        f64::from(frames) / f64::from(seconds)
    }

    /// The rate as a number of frames in a number of seconds.
    fn ratio(self) -> (u32, u32) {
        match self {
            Self::DropFrame | Self::NonDrop => (30_000, 1001),
            Self::Film | Self::Ebu | Self::Smpte => (self.numbers_per_second(), 1),
        }
    }

    /// The frame at a position in nanoseconds: the last one that begins at it or before.
    pub fn frame_at(self, position_ns: i128) -> i128 {
        let (frames, seconds) = self.ratio();
        (position_ns * i128::from(frames)).div_euclid(i128::from(seconds) * SECOND_NS)
    }

    /// The position at which a frame begins, in nanoseconds, rounded up.
    pub fn begin_ns(self, frame: i128) -> i128 {
        let (frames, seconds) = self.ratio();
        -(-frame * i128::from(seconds) * SECOND_NS).div_euclid(i128::from(frames))
    }

    /// Number of frames of a day of the clock.
    pub fn frames_per_day(self) -> u32 {
        let leaves_out_per_day = 24 * 6 * 9 * 2;
        let numbers = 86_400 * self.numbers_per_second();
        if self == Self::DropFrame { numbers - leaves_out_per_day } else { numbers }
    }

    /// Length of a day of the clock in seconds. With drop-frame counting it is about 86 ms less than 24 hours, and without, at
    /// 29.97, 86.4 s more.
    pub fn day_s(self) -> f64 {
        f64::from(self.frames_per_day()) / self.frames_per_second()
    }

    /// Number of different frame numbers within a second.
    pub fn numbers_per_second(self) -> u32 {
        match self {
            Self::Film => 24,
            Self::Ebu => 25,
            Self::DropFrame | Self::NonDrop | Self::Smpte => 30,
        }
    }
}

const SECOND_NS: i128 = 1_000_000_000;
/// Name of the rate 29.97 without drop-frame counting.
const NON_DROP: &str = "29.97ndf";

impl FromStr for FrameRate {
    type Err = String;

    /// ```
    /// use bench_dragon::source::timecode::FrameRate;
    ///
    /// assert_eq!(["29.97", "29.97ndf"].map(str::parse), [Ok(FrameRate::DropFrame), Ok(FrameRate::NonDrop)]);
    /// ```
    fn from_str(text: &str) -> Result<Self, String> {
        if text.eq_ignore_ascii_case(NON_DROP) {
            return Ok(Self::NonDrop);
        }
        let rate = text.parse().ok().and_then(Self::of);
        rate.ok_or_else(|| format!("must be 24, 25, 29.97 (drop-frame), {NON_DROP} or 30"))
    }
}

impl fmt::Display for FrameRate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Film => "24",
            Self::Ebu => "25",
            Self::DropFrame => "29.97",
            Self::NonDrop => NON_DROP,
            Self::Smpte => "30",
        })
    }
}

impl Clock {
    /// Returns the clock at a frame, counted from 00:00:00:00 of any day.
    ///
    /// ```
    /// use bench_dragon::source::timecode::{Clock, FrameRate};
    ///
    /// let minute = Clock { minutes: 1, frames: 2, ..Clock::default() };
    /// assert_eq!(Clock::of_frame(1800, FrameRate::DropFrame), minute);
    /// assert_eq!(Clock::of_frame(-1, FrameRate::Ebu), Clock { hours: 23, minutes: 59, seconds: 59, frames: 24 });
    /// ```
    pub fn of_frame(frame: i128, rate: FrameRate) -> Self {
        // A remainder of a day fits.
        let frame = frame.rem_euclid(i128::from(rate.frames_per_day())) as u32;
        let number = if rate == FrameRate::DropFrame { frame + skipped_before(frame) } else { frame };
        let numbers = rate.numbers_per_second();
        let (second, frames) = (number / numbers, number % numbers);
        Self { hours: second / 3600, minutes: second / 60 % 60, seconds: second % 60, frames }
    }

    /// Returns the position of the clock at a frame rate, in seconds from 00:00:00:00.
    ///
    /// # Errors
    /// [`Malformed`] for an invalid clock: a number is out of range, or drop-frame counting skips it.
    ///
    /// ```
    /// use bench_dragon::source::timecode::{Clock, FrameRate};
    ///
    /// let clock = Clock { minutes: 1, frames: 5, ..Clock::default() };
    /// assert_eq!(clock.position_s(FrameRate::Ebu), Ok(60.2));
    /// assert!(Clock { hours: 99, ..clock }.position_s(FrameRate::Ebu).is_err());
    /// ```
    pub fn position_s(self, rate: FrameRate) -> Result<f64, Malformed> {
        let frame = f64::from(self.frame(rate).ok_or(Malformed)?);
        Ok(frame / rate.frames_per_second())
    }

    /// Number of frames between 00:00:00:00 and this clock; `None` for an invalid clock.
    fn frame(self, rate: FrameRate) -> Option<u32> {
        let Self { hours, minutes, seconds, frames } = self;
        let numbers = rate.numbers_per_second();
        let is_shown = hours < 24 && minutes < 60 && seconds < 60 && frames < numbers;
        let numbered = is_shown.then(|| ((hours * 60 + minutes) * 60 + seconds) * numbers + frames)?;
        if rate != FrameRate::DropFrame {
            return Some(numbered);
        }
        let is_left_out = minutes % 10 != 0 && seconds == 0 && frames < 2;
        let minutes = hours * 60 + minutes;
        (!is_left_out).then(|| numbered - 2 * (minutes - minutes / 10))
    }
}

/// Number of clock numbers that drop-frame counting skips before a frame of a day.
fn skipped_before(frame: u32) -> u32 {
    const PER_MINUTE: u32 = 60 * 30 - 2;
    // The first of ten minutes has all of its numbers.
    const PER_TEN_MINUTES: u32 = 10 * PER_MINUTE + 2;
    let (tens, rest) = (frame / PER_TEN_MINUTES, frame % PER_TEN_MINUTES);
    18 * tens + 2 * (rest.saturating_sub(2) / PER_MINUTE)
}

/// A position of a timecode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// Seconds from 00:00:00:00.
    pub since_midnight_s: f64,
    /// Length of the day in seconds: after it the timecode is at 00:00:00:00 again.
    pub day_s: f64,
}

impl Position {
    /// Returns the position of a clock at a frame rate.
    ///
    /// # Errors
    /// [`Malformed`] for an invalid clock.
    pub fn of_clock(clock: Clock, rate: FrameRate) -> Result<Self, Malformed> {
        Ok(Self { since_midnight_s: clock.position_s(rate)?, day_s: rate.day_s() })
    }

    /// Returns the position at a time in seconds from 00:00:00:00, for a timecode without frames.
    ///
    /// # Errors
    /// [`Malformed`] for a time outside of a day.
    pub fn of_seconds(since_midnight_s: f64) -> Result<Self, Malformed> {
        const DAY_S: f64 = 86_400.0;
        let is_within = (0.0..DAY_S).contains(&since_midnight_s);
        if is_within { Ok(Self { since_midnight_s, day_s: DAY_S }) } else { Err(Malformed) }
    }

    /// Shortest step to a later position in seconds, at most half a day; negative for a step back.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Every clock of a day in order, including the invalid ones.
    fn clocks(numbers: u32) -> impl Iterator<Item = Clock> {
        (0..24 * 3600 * numbers).map(move |number| {
            let (second, frames) = (number / numbers, number % numbers);
            Clock { hours: second / 3600, minutes: second / 60 % 60, seconds: second % 60, frames }
        })
    }

    #[test]
    fn consecutive_valid_clocks_are_one_frame_apart() {
        for (rate, day) in [
            (FrameRate::Film, 2_073_600),
            (FrameRate::Ebu, 2_160_000),
            (FrameRate::DropFrame, 2_589_408),
            (FrameRate::NonDrop, 2_592_000),
            (FrameRate::Smpte, 2_592_000),
        ] {
            let frames = clocks(rate.numbers_per_second()).filter_map(|clock| clock.frame(rate));
            assert_eq!(frames.zip(0..).map(|(frame, expected)| assert_eq!(frame, expected, "{rate:?}")).count(), day);
            assert_eq!(rate.day_s(), day as f64 / rate.frames_per_second());
        }
    }

    /// Frames of 24 hours, out and in again.
    #[test]
    fn each_frame_of_a_day_begins_when_its_clock_says_so() {
        for rate in [FrameRate::Film, FrameRate::Ebu, FrameRate::DropFrame, FrameRate::NonDrop, FrameRate::Smpte] {
            for frame in 0..rate.frames_per_day() {
                let begin_ns = rate.begin_ns(frame.into());
                assert_eq!(
                    [begin_ns - 1, begin_ns].map(|at_ns| rate.frame_at(at_ns)),
                    [frame, frame + 1].map(|next| i128::from(next) - 1)
                );
                let clock = Clock::of_frame(frame.into(), rate);
                assert_eq!(clock.frame(rate), Some(frame), "{rate} {clock:?}");
                let position_ns = clock.position_s(rate).expect("a valid clock") * 1e9;
                assert!((position_ns - begin_ns as f64).abs() < 2.0, "{rate} {clock:?}: {position_ns}, not {begin_ns}");
            }
        }
    }

    #[test]
    fn without_drop_frame_an_hour_of_the_clock_is_longer_than_an_hour() {
        let hour = Clock { hours: 1, ..Clock::default() };
        let hour_s = hour.position_s(FrameRate::NonDrop).expect("a valid clock");
        assert!((hour_s - 3603.6).abs() < 1e-9, "{hour_s}");
        assert!((FrameRate::NonDrop.day_s() - 86_486.4).abs() < 1e-9);
    }

    #[test]
    fn rates_are_named_as_they_are_read() {
        for rate in [FrameRate::Film, FrameRate::Ebu, FrameRate::DropFrame, FrameRate::NonDrop, FrameRate::Smpte] {
            assert_eq!(rate.to_string().parse(), Ok(rate));
        }
        let refusal = "60".parse::<FrameRate>().expect_err("no rate of timecode");
        assert_eq!(refusal, "must be 24, 25, 29.97 (drop-frame), 29.97ndf or 30");
    }

    #[test]
    fn drop_frame_skips_two_numbers_in_nine_minutes_of_ten() {
        let left_out = clocks(30).filter(|clock| clock.frame(FrameRate::DropFrame).is_none());
        for clock in left_out {
            assert!(clock.minutes % 10 != 0 && clock.seconds == 0 && clock.frames < 2, "{clock:?}");
        }
        let at = |minutes, seconds, frames| {
            Clock { minutes, seconds, frames, ..Clock::default() }.frame(FrameRate::DropFrame)
        };
        assert_eq!((at(0, 59, 29), at(1, 0, 0), at(1, 0, 2)), (Some(1799), None, Some(1800)));
        assert_eq!((at(9, 59, 29), at(10, 0, 0)), (Some(17_981), Some(17_982)));
    }

    #[test]
    fn drop_frame_follows_the_time_of_day() {
        let position_s = |clock: Clock| clock.position_s(FrameRate::DropFrame).expect("a valid clock");
        let hour_s = position_s(Clock { hours: 1, ..Clock::default() });
        assert!((hour_s - 3600.0).abs() < 0.004, "{hour_s}");
        // Within the hour the difference is two frames at most.
        for clock in clocks(30).filter(|clock| clock.hours == 0 && clock.frame(FrameRate::DropFrame).is_some()) {
            let shown_s = f64::from(clock.minutes * 60 + clock.seconds) + f64::from(clock.frames) / 30.0;
            assert!((position_s(clock) - shown_s).abs() < 0.07, "{clock:?}");
        }
    }
}
