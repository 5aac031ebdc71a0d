//! The growth of a recording: as measured, and as estimated for a walking dragon.

use std::time::Duration;

use bench_dragon_geometry::formation::Layout;
use bench_dragon_ipc::{FrameHeader, HandleState};

use super::progress::{DiskSpace, SpaceForecast};

/// Averaging span: the rate is the mean over the last one to two spans.
const RATE_SPAN: Duration = Duration::from_secs(10);
/// Least recording time for a rate: the start-up phase is not typical.
const FIRST_RATE_AFTER: Duration = Duration::from_secs(1);
/// Size of the recorded frames ÷ size of the frames, while the dragon walks.
const COMPRESSED: f64 = 0.6;
/// Recorded bytes of a bench for viewers, each time: its pose, and its frame of reference.
const VIEWED_BYTES: usize = 40;
/// Greatest number of these times per second.
const VIEWED_HZ: u32 = 30;
/// Recorded bytes of a board, each time: as a cube and as a marker, whose poses the file has already. And the greatest
/// number of these times.
const BOARD_BYTES: usize = 18;
const BOARDS_HZ: u32 = 10;

/// Estimates the growth of the recording of a walking dragon, in bytes per second of wall time.
pub fn walking_bytes_per_s(layout: &Layout, rate_hz: u32) -> f64 {
    let frame_bytes = FrameHeader::SHOW_BYTES + layout.handles() * size_of::<HandleState>();
    let frames = frame_bytes as f64 * COMPRESSED * f64::from(rate_hz);
    let viewed = |bytes: usize, hz: u32| (layout.benches() * bytes) as f64 * f64::from(rate_hz.min(hz));
    frames + viewed(VIEWED_BYTES, VIEWED_HZ) + viewed(BOARD_BYTES, BOARDS_HZ)
}

/// Measures the growth rate of the recording, and forecasts when the disk will be full.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Growth {
    older: Measurement,
    newer: Measurement,
}

#[derive(Clone, Copy, Debug, Default)]
struct Measurement {
    at: Duration,
    written_bytes: u64,
}

impl Growth {
    /// Takes the bytes written until `elapsed` after the start, and returns a forecast.
    ///
    /// The forecast uses the measured rate, or `walking_bytes_per_s` if that is higher: frames of a standing dragon compress ten
    /// times better, and the dragon may walk on at any time.
    ///
    /// `growth_left_bytes` is the growth left until the recording removes its own oldest files. If the disk has room for it,
    /// the recording never fills the disk, and the result is `None`.
    pub(super) fn observe(
        &mut self,
        elapsed: Duration,
        written_bytes: u64,
        space: DiskSpace,
        growth_left_bytes: Option<u64>,
        walking_bytes_per_s: f64,
    ) -> Option<SpaceForecast> {
        if growth_left_bytes.is_some_and(|growth| growth < space.free_bytes) {
            return None;
        }
        let now = Measurement { at: elapsed, written_bytes };
        let walking = (walking_bytes_per_s > 0.0).then_some(walking_bytes_per_s);
        let bytes_per_s = self.bytes_per_s(now).into_iter().chain(walking).reduce(f64::max);
        let seconds_until_full = bytes_per_s.map(|rate| space.free_bytes as f64 / rate);
        if now.at.saturating_sub(self.newer.at) >= RATE_SPAN {
            self.older = std::mem::replace(&mut self.newer, now);
        }
        Some(SpaceForecast { space, seconds_until_full })
    }

    fn bytes_per_s(&self, now: Measurement) -> Option<f64> {
        let span = now.at.saturating_sub(self.older.at);
        let grown_bytes = now.written_bytes - self.older.written_bytes;
        (span >= FIRST_RATE_AFTER && grown_bytes > 0).then(|| grown_bytes as f64 / span.as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::super::progress::SpaceWarning;
    use super::*;

    const ROOMY: DiskSpace = DiskSpace { free_bytes: 500_000_000_000, total_bytes: 1_000_000_000_000 };

    fn after(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    #[test]
    fn forecast_is_the_free_space_divided_by_the_rate() {
        let mut growth = Growth::default();
        let forecast = growth.observe(after(5), 50_000_000, ROOMY, None, 0.0).expect("an unbounded recording");
        assert_eq!(forecast.seconds_until_full, Some(50_000.0));
        assert_eq!(forecast.warning(), None);
    }

    #[test]
    fn first_second_gives_no_rate() {
        let forecast = Growth::default().observe(Duration::from_millis(900), 9_000_000, ROOMY, None, 0.0);
        assert_eq!(forecast.and_then(|forecast| forecast.seconds_until_full), None);
    }

    #[test]
    fn forecast_follows_a_slower_rate_within_two_spans() {
        let mut growth = Growth::default();
        let mut written_bytes = 0;
        let mut last = None;
        for second in 1..=60 {
            written_bytes += if second <= 30 { 10_000_000 } else { 1_000_000 };
            last = growth.observe(after(second), written_bytes, ROOMY, None, 0.0);
        }
        assert_eq!(last.and_then(|forecast| forecast.seconds_until_full), Some(500_000.0));
    }

    #[test]
    fn disk_full_within_ten_minutes_gives_a_warning() {
        let mut growth = Growth::default();
        let forecast = growth.observe(after(2), 2_000_000_000, ROOMY, None, 0.0).expect("an unbounded recording");
        assert_eq!(forecast.warning(), Some(SpaceWarning::FullSoon { seconds: 500.0, free_bytes: 500_000_000_000 }));
    }

    #[test]
    fn disk_with_little_room_gives_a_warning_at_any_rate() {
        let space = DiskSpace { free_bytes: 4_900_000_000, total_bytes: 100_000_000_000 };
        let forecast = Growth::default().observe(after(0), 0, space, None, 0.0).expect("an unbounded recording");
        assert_eq!(
            forecast.warning().expect("a warning").to_string(),
            "the disk is nearly full: 4.9 GB of 100.0 GB are free"
        );
    }

    #[test]
    fn recording_that_removes_its_oldest_files_in_time_has_no_forecast() {
        let forecast = Growth::default().observe(after(2), 2_000_000_000, ROOMY, Some(1_000_000_000), 0.0);
        assert_eq!(forecast, None);
    }

    #[test]
    fn the_forecast_of_a_standing_dragon_is_that_of_a_walking_one() {
        let mut growth = Growth::default();
        let forecast = growth.observe(after(5), 5_000_000, ROOMY, None, 10_000_000.0).expect("an unbounded recording");
        assert_eq!(forecast.seconds_until_full, Some(50_000.0));
        let faster = growth.observe(after(10), 200_000_000, ROOMY, None, 10_000_000.0).expect("an unbounded recording");
        assert_eq!(faster.seconds_until_full, Some(25_000.0));
    }

    #[test]
    fn a_recording_grows_as_measured() {
        // Measured: 23.8 GB an hour at 1 kHz, and 2.49 GB at 60 Hz.
        for (rate_hz, measured_gb_per_h) in [(1000, 23.8), (60, 2.49)] {
            let gb_per_h = walking_bytes_per_s(&Layout::of([223]), rate_hz) * 3600.0 * 1e-9;
            assert!((gb_per_h / measured_gb_per_h - 1.0).abs() < 0.05, "{gb_per_h} GB an hour at {rate_hz} Hz");
        }
    }
}
