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
        let elapsed_ns = now_ns.saturating_sub(latest.header.scheduled_ns) as f64 * pace;
        i128::from(latest.header.show_time_ns) + i128::from(self.offset_ns) + elapsed_ns as i128
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
