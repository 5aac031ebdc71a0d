//! Timecode of the show: which frame is sent when, so that sound and light follow the dragon. Pure: the time is an argument.
//!
//! The position of the timecode is show time plus an offset. While the show runs, each frame is sent when it begins, once. Show
//! time between two frames of the bus follows from the time scale. While the show stands, its frame is sent again once a period,
//! so a receiver sees a timecode that stands and is not lost.
//!
//! At another time scale than 1, frames are sent at most twice as often as the rate, and at least two thirds as often: frames are
//! left out or sent again. A stale frame of the bus counts as a show that stands.
//!
//! A position before 00:00:00:00 is that of the day before: a show time of −1 s is 23:59:59:00.

use bench_dragon_ipc::ShowState;

use super::latest_frame::LatestFrame;
use crate::source::timecode::FrameRate;

/// Decides which frame of timecode is sent when.
#[derive(Clone, Copy, Debug)]
pub struct TimecodePacer {
    rate: FrameRate,
    offset_ns: i64,
    last: Option<Sent>,
    left_out: u64,
}

#[derive(Clone, Copy, Debug)]
struct Sent {
    frame: i128,
    at_ns: u64,
}

/// What to do at an instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PacerStep {
    /// Send this frame now, counted from 00:00:00:00 of any day.
    Send(i128),
    /// Nothing before this instant of `CLOCK_MONOTONIC`, unless the show changes.
    Wait(u64),
}

impl TimecodePacer {
    /// Paces timecode whose position is show time plus an offset in nanoseconds.
    pub fn new(rate: FrameRate, offset_ns: i64) -> Self {
        Self { rate, offset_ns, last: None, left_out: 0 }
    }

    /// The step at `now_ns` of `CLOCK_MONOTONIC`, with the newest frame of the bus. A frame to send counts as sent.
    pub fn step(&mut self, latest: &LatestFrame, now_ns: u64) -> PacerStep {
        let pace = pace(latest);
        let position_ns = self.position_ns(latest, pace, now_ns);
        let frame = self.rate.frame_at(position_ns);
        if let Some(last) = self.last {
            let due_ns = self.due_ns(last, frame, pace);
            // A pace above 0 has a next frame.
            let begin_ns = (frame == last.frame && pace > 0.0).then(|| {
                let ahead_ns = (self.rate.begin_ns(frame + 1) - position_ns) as f64 / pace;
                now_ns.saturating_add(ahead_ns.ceil() as u64)
            });
            if now_ns < due_ns {
                return PacerStep::Wait(begin_ns.map_or(due_ns, |begin_ns| begin_ns.min(due_ns)));
            }
        }
        let step = self.last.map_or(0, |last| frame - last.frame);
        // A longer step is a seek.
        if (2..=i128::from(self.rate.numbers_per_second())).contains(&step) {
            self.left_out += (step - 1) as u64;
        }
        self.last = Some(Sent { frame, at_ns: now_ns });
        PacerStep::Send(frame)
    }

    /// Number of frames that were left out: they began while this program was busy, or faster than frames are sent.
    pub fn left_out(&self) -> u64 {
        self.left_out
    }

    /// The instant at which a frame is due, after the last one.
    fn due_ns(&self, last: Sent, frame: i128, pace: f64) -> u64 {
        let period_ns = (1e9 / self.rate.frames_per_second()) as u64;
        let wait_ns = match (frame == last.frame, pace > 0.0) {
            (false, _) => period_ns / 2,
            (true, true) => period_ns + period_ns / 2,
            (true, false) => period_ns,
        };
        last.at_ns.saturating_add(wait_ns)
    }

    fn position_ns(&self, latest: &LatestFrame, pace: f64, now_ns: u64) -> i128 {
        // Sound that is late begins before the newest frame.
        let elapsed_ns = (i128::from(now_ns) - i128::from(latest.header.scheduled_ns)) as f64 * pace;
        i128::from(latest.header.show_time_ns) + i128::from(self.offset_ns) + elapsed_ns as i128
    }
}

/// Decides which frame of linear timecode is written next, and how long it is.
///
/// Frames of sound follow each other without a gap. While the show runs, each frame ends when the next one begins: so its length
/// follows the time scale, from half of it to twice. At other time scales, and while the show stands, frames have the length of
/// the rate, with the position at which they begin.
#[derive(Clone, Copy, Debug)]
pub struct LtcPacer {
    pacer: TimecodePacer,
    samples_per_second: u32,
}

impl LtcPacer {
    /// Paces sound whose position is show time plus an offset in nanoseconds.
    pub fn new(rate: FrameRate, offset_ns: i64, samples_per_second: u32) -> Self {
        Self { pacer: TimecodePacer::new(rate, offset_ns), samples_per_second }
    }

    /// The frame that begins at `at_ns` of `CLOCK_MONOTONIC`, counted from 00:00:00:00 of any day, and its number of samples.
    pub fn next(&self, latest: &LatestFrame, at_ns: u64) -> (i128, usize) {
        let Self { pacer: TimecodePacer { rate, .. }, samples_per_second } = *self;
        let (pace, per_second) = (pace(latest), f64::from(samples_per_second));
        let position_ns = self.pacer.position_ns(latest, pace, at_ns);
        let usual = per_second / rate.frames_per_second();
        if !(0.5..=2.0).contains(&pace) {
            return (rate.frame_at(position_ns), usual.round() as usize);
        }
        // The nearest frame: this one begins within a sample of its position.
        let half_period_ns = (0.5e9 / rate.frames_per_second()) as i128;
        let frame = rate.frame_at(position_ns + half_period_ns);
        let ahead_s = (rate.begin_ns(frame + 1) - position_ns) as f64 * 1e-9;
        let samples = ahead_s / pace * per_second;
        (frame, samples.clamp(0.4 * usual, 2.5 * usual).round() as usize)
    }
}

/// The instant at which each sample is due.
#[derive(Clone, Copy, Debug)]
pub struct SampleInstants {
    /// Samples per second.
    pub samples_per_second: u32,
    /// Number of samples that have been written.
    pub written: u64,
    epoch_ns: u64,
}

impl SampleInstants {
    /// The first sample is due at `epoch_ns` of `CLOCK_MONOTONIC`.
    pub fn new(samples_per_second: u32, epoch_ns: u64) -> Self {
        Self { samples_per_second, written: 0, epoch_ns }
    }

    /// The instant of a sample.
    pub fn at(&self, sample: u64) -> u64 {
        let since_ns = u128::from(sample) * 1_000_000_000 / u128::from(self.samples_per_second);
        self.epoch_ns.saturating_add(since_ns as u64)
    }

    /// Counts written samples. If they are late by more than a limit, the next ones are due from now on. Returns whether they are.
    pub fn advance(&mut self, samples: u64, now_ns: u64, limit_ns: u64) -> bool {
        self.written += samples;
        let late_ns = now_ns.saturating_sub(self.at(self.written));
        let is_late = late_ns > limit_ns;
        if is_late {
            self.epoch_ns += late_ns;
        }
        is_late
    }
}

/// Show seconds per second of a frame: 0 while the show stands, or is silent.
fn pace(latest: &LatestFrame) -> f64 {
    let walks = latest.header.show_state().is_some_and(ShowState::walks);
    if walks { latest.speed_factor().max(0.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::FrameHeader;

    use super::*;
    use crate::bridge::Freshness;

    const RATES: [FrameRate; 5] =
        [FrameRate::Film, FrameRate::Ebu, FrameRate::DropFrame, FrameRate::NonDrop, FrameRate::Smpte];
    const BEGIN_NS: u64 = 5_000_000_000;

    fn latest(show_time_ns: i64, state: ShowState, time_scale: f64) -> LatestFrame {
        let state = state.to_wire();
        let header = FrameHeader { show_time_ns, scheduled_ns: BEGIN_NS, time_scale, state, ..FrameHeader::default() };
        LatestFrame { header, ..LatestFrame::default() }
    }

    /// Steps until an instant, always waiting as long as the pacer says. Returns the frames and their instants.
    fn sent(pacer: &mut TimecodePacer, latest: &LatestFrame, from_ns: u64, until_ns: u64) -> Vec<(i128, u64)> {
        let (mut now_ns, mut sent) = (from_ns, Vec::new());
        while now_ns < until_ns {
            match pacer.step(latest, now_ns) {
                PacerStep::Send(frame) => sent.push((frame, now_ns)),
                PacerStep::Wait(then_ns) => {
                    assert!(then_ns > now_ns, "a wait ends later");
                    now_ns = then_ns;
                }
            }
        }
        sent
    }

    #[test]
    fn a_running_show_sends_each_frame_once_when_it_begins() {
        for rate in RATES {
            let mut pacer = TimecodePacer::new(rate, 3_600_000_000_000);
            let first = rate.frame_at(3_600_000_000_000 - 100_000_000_000);
            let show = latest(-100_000_000_000, ShowState::Running, 1.0);
            let sent = sent(&mut pacer, &show, BEGIN_NS, BEGIN_NS + 60_000_000_000);
            assert!(sent.len() as f64 >= 59.9 * rate.frames_per_second(), "{rate}: {}", sent.len());
            for (&(frame, at_ns), expected) in sent.iter().zip(first..) {
                assert_eq!(frame, expected, "{rate}");
                let begin_ns = rate.begin_ns(frame) - 3_500_000_000_000 + i128::from(BEGIN_NS);
                let late_ns = i128::from(at_ns) - begin_ns;
                assert!(frame == first || (0..2_000).contains(&late_ns), "{rate}: frame {frame} is {late_ns} ns late");
            }
        }
    }

    #[test]
    fn a_standing_show_repeats_its_frame_once_a_period() {
        for rate in RATES {
            let shows = [
                latest(61_000_000_000, ShowState::Paused, 1.0),
                latest(61_000_000_000, ShowState::Held, 1.0),
                LatestFrame {
                    freshness: Freshness::Stale { age_ns: 1 },
                    ..latest(61_000_000_000, ShowState::Running, 1.0)
                },
            ];
            for show in shows {
                let sent = sent(&mut TimecodePacer::new(rate, 0), &show, BEGIN_NS, BEGIN_NS + 10_000_000_000);
                assert!(sent.iter().all(|(frame, _)| *frame == rate.frame_at(61_000_000_000)), "{rate}");
                let expected = 10.0 * rate.frames_per_second();
                assert!((sent.len() as f64 - expected).abs() < 1.5, "{rate}: {} packets", sent.len());
            }
        }
    }

    #[test]
    fn a_seek_is_sent_within_half_a_period() {
        let mut pacer = TimecodePacer::new(FrameRate::Ebu, 0);
        let [here, there] = [1, 300].map(|second| latest(second * 1_000_000_000, ShowState::Held, 1.0));
        assert_eq!(pacer.step(&here, BEGIN_NS), PacerStep::Send(25));
        assert_eq!(pacer.step(&there, BEGIN_NS + 1), PacerStep::Wait(BEGIN_NS + 20_000_000));
        assert_eq!(pacer.step(&there, BEGIN_NS + 20_000_000), PacerStep::Send(7_500));
    }

    /// 24 hours of sound of each rate: no frame is left out, repeated or shifted.
    #[test]
    fn frames_of_sound_do_not_drift_in_24_hours() {
        for rate in RATES {
            for samples_per_second in [44_100, 48_000] {
                let pacer = LtcPacer::new(rate, -1_000_000_000, samples_per_second);
                let mut instants = SampleInstants::new(samples_per_second, BEGIN_NS);
                let show = latest(1_000_000_000, ShowState::Running, 1.0);
                for expected in 0..rate.frames_per_day() {
                    let at_ns = instants.at(instants.written);
                    let (frame, samples) = pacer.next(&show, at_ns);
                    assert_eq!(frame, i128::from(expected), "{rate}");
                    let late_ns = i128::from(at_ns - BEGIN_NS) - rate.begin_ns(frame);
                    assert!(late_ns.abs() <= 1_000_000_000 / i128::from(samples_per_second), "{rate}: {late_ns} ns");
                    assert!(!instants.advance(samples as u64, at_ns, 0));
                }
            }
        }
    }

    #[test]
    fn the_length_of_a_frame_of_sound_follows_the_show() {
        let pacer = LtcPacer::new(FrameRate::Ebu, 0, 48_000);
        let at = |show: &LatestFrame, later_ns| pacer.next(show, BEGIN_NS + later_ns);
        assert_eq!(at(&latest(0, ShowState::Running, 1.0), 0), (0, 1_920));
        // The last frame began a millisecond late, so this one is shorter.
        assert_eq!(at(&latest(0, ShowState::Running, 1.0), 41_000_000), (1, 1_872));
        assert_eq!(at(&latest(0, ShowState::Running, 1.1), 0), (0, 1_745));
        assert_eq!(at(&latest(100_000_000, ShowState::Held, 1.0), 500_000_000), (2, 1_920));
        assert_eq!(pacer.next(&latest(43_000_000, ShowState::Running, 1.0), BEGIN_NS - 3_000_000), (1, 1_920));
        assert_eq!(at(&latest(0, ShowState::Running, 20.0), 100_000_000), (50, 1_920));
    }

    #[test]
    fn sound_that_is_late_goes_on_from_the_present() {
        let mut instants = SampleInstants::new(48_000, BEGIN_NS);
        assert!(!instants.advance(480, BEGIN_NS + 20_000_000, 100_000_000));
        assert_eq!(instants.at(960), BEGIN_NS + 20_000_000);
        assert!(instants.advance(480, BEGIN_NS + 5_000_000_000, 100_000_000));
        assert_eq!(instants.at(960), BEGIN_NS + 5_000_000_000);
    }

    #[test]
    fn at_any_time_scale_the_number_of_packets_is_bounded_and_frames_never_go_back() {
        for time_scale in [0.001, 0.05, 0.9, 1.1, 20.0, 1000.0] {
            let show = latest(0, ShowState::Running, time_scale);
            let sent = sent(&mut TimecodePacer::new(FrameRate::Ebu, 0), &show, BEGIN_NS, BEGIN_NS + 10_000_000_000);
            assert!((160..=501).contains(&sent.len()), "{} packets at {time_scale}", sent.len());
            assert!(sent.is_sorted(), "{time_scale}");
        }
    }
}
