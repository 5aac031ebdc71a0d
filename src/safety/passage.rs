//! What happened between two frames: whether the head walked from the one to the other, so that the way between can
//! be swept, or was repositioned.

use bench_dragon_ipc::{FrameHeader, Request, ShowState};

use crate::source::server::motion::FASTEST;

/// How far show time may be from a whole number of steps, in seconds: its resolution on the wire.
const SIM_TIME_TOLERANCE_S: f64 = 2e-9;
/// How far travel may be from speed times show time, in metres: that resolution at the greatest speed.
const TRAVEL_TOLERANCE_M: f64 = SIM_TIME_TOLERANCE_S * Request::MAX_SPEED_MPS;

/// How much faster than configured a source may have gone for a while that follows timecode, with some room.
const TIMECODE_HASTE: f64 = 1.25;
/// Rounding of the instants at which two frames were due, in seconds.
const CLOCK_TOLERANCE_S: f64 = 2e-9;
/// Periods between two frames from which on a release was missed.
const MISSED_FROM: f64 = 1.5;

/// How a source moves the head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SourcePace {
    /// Show seconds that a running tick advances, as configured.
    pub tick_s: f64,
    /// Ticks a second: a source that follows timecode advances show time by its frames' time scale ÷ this.
    pub rate_hz: u32,
    /// Greatest acceleration in m/s²; without one the head starts and stops at once.
    pub accel_mps2: Option<f64>,
    /// Releases that a server may miss between two of its frames and jump.
    pub most_jumped: u64,
}

/// The way from one frame to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HeadPassage {
    /// The head walked, or stood: every travel between the two was passed, in this order.
    Walked,
    /// The source was started again, or the head was repositioned: nothing is known of the way between.
    Broken,
}

impl HeadPassage {
    /// The way from `last` to `next`, two frames of a source.
    pub fn between(last: &FrameHeader, next: &FrameHeader, pace: SourcePace) -> Self {
        let same_run = last.run_id == next.run_id && last.tick < next.tick;
        if same_run && walked(last, next, pace) { Self::Walked } else { Self::Broken }
    }
}

/// A server that misses releases goes on by as many periods in its next tick. So two successive frames with missed releases
/// between them are taken as frames with others lost between them: the head walked as long as the clock let it.
fn walked(last: &FrameHeader, next: &FrameHeader, pace: SourcePace) -> bool {
    let SourcePace { tick_s, rate_hz, accel_mps2, .. } = pace;
    let sim_step_s = (next.sim_time_ns - last.sim_time_ns) as f64 * 1e-9;
    let travel_step_m = next.head_travel_m - last.head_travel_m;
    let (ticks, clock_s) = (next.tick - last.tick, clock_s(last, next));
    let [last_s, next_s] = [last, next].map(|header| header.time_scale / f64::from(rate_hz));
    // Where the time scale is not the configured one, timecode is followed, a standstill is made up, or a recording is replayed
    // faster or slower, whose time scale tells nothing of its steps.
    let longest_tick_s = if [last_s, next_s] == [tick_s; 2] { tick_s } else { TIMECODE_HASTE * tick_s };
    let has_missed = clock_s > MISSED_FROM * longest_tick_s;
    let longest_s = match ticks {
        // On a run from another host frames are due when they come: a period more, for those that come early.
        1 if has_missed => (clock_s + longest_tick_s).min((pace.most_jumped as f64 + 1.0) * longest_tick_s),
        1 => longest_tick_s,
        // Between them the source may have jumped, and made up for a standstill.
        _ => FASTEST * clock_s.max(ticks as f64 * longest_tick_s),
    };
    if !(0.0..=longest_s + SIM_TIME_TOLERANCE_S).contains(&sim_step_s) || travel_step_m < 0.0 {
        return false;
    }
    let runs = next.show_state().is_some_and(ShowState::walks);
    if ticks > 1 || has_missed || !runs {
        return travel_step_m <= sim_step_s * Request::MAX_SPEED_MPS + TRAVEL_TOLERANCE_M;
    }
    // Successive frames of a running show: one whole step, at the speed that the second one states or on a ramp up or down
    // to it, which leaves the mean of both speeds by at most a quarter of what the speed may change.
    let (step_m, off_m) = match accel_mps2 {
        None => (next.head_speed_mps * sim_step_s, 0.0),
        Some(accel_mps2) => {
            let mean_mps = 0.5 * (last.head_speed_mps + next.head_speed_mps);
            (mean_mps * sim_step_s, 0.25 * accel_mps2 * sim_step_s * sim_step_s)
        }
    };
    let is_step = [tick_s, next_s].iter().any(|step_s| (sim_step_s - step_s).abs() <= SIM_TIME_TOLERANCE_S);
    is_step && (travel_step_m - step_m).abs() <= off_m + TRAVEL_TOLERANCE_M
}

/// Show time that may have passed between the instants at which two frames were due, in seconds.
fn clock_s(last: &FrameHeader, next: &FrameHeader) -> f64 {
    let elapsed_s = next.scheduled_ns.saturating_sub(last.scheduled_ns) as f64 * 1e-9;
    (elapsed_s + CLOCK_TOLERANCE_S) * last.time_scale.max(next.time_scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACE: SourcePace = SourcePace { tick_s: 0.02, rate_hz: 50, accel_mps2: None, most_jumped: 12 };

    fn frame(tick: u64, sim_time_s: f64, head_travel_m: f64) -> FrameHeader {
        FrameHeader {
            run_id: 1,
            tick,
            sim_time_ns: (sim_time_s * 1e9) as i64,
            head_travel_m,
            head_speed_mps: 1.0,
            time_scale: 1.0,
            state: ShowState::Running.to_wire(),
            ..FrameHeader::default()
        }
    }

    #[test]
    fn a_step_at_the_stated_speed_is_walked() {
        assert_eq!(HeadPassage::between(&frame(5, 0.1, 0.1), &frame(6, 0.12, 0.12), PACE), HeadPassage::Walked);
    }

    #[test]
    fn a_step_at_the_time_scale_of_a_followed_timecode_is_walked() {
        let next = FrameHeader { time_scale: 1.05, ..frame(6, 0.121, 0.121) };
        assert_eq!(HeadPassage::between(&frame(5, 0.1, 0.1), &next, PACE), HeadPassage::Walked);
        let gap = FrameHeader { time_scale: 1.05, ..frame(15, 0.31, 0.31) };
        assert_eq!(HeadPassage::between(&frame(5, 0.1, 0.1), &gap, PACE), HeadPassage::Walked);
    }

    #[test]
    fn a_seek_within_a_gap_of_a_fast_replay_is_broken() {
        let fast = |frame: FrameHeader| FrameHeader { time_scale: 100.0, ..frame };
        let passage = |next| HeadPassage::between(&fast(frame(5, 0.1, 0.1)), &fast(next), PACE);
        assert_eq!(passage(frame(10, 0.2, 0.2)), HeadPassage::Walked);
        assert_eq!(passage(frame(10, 1.2, 1.2)), HeadPassage::Broken);
    }

    #[test]
    fn a_gap_that_the_head_could_walk_is_walked() {
        assert_eq!(HeadPassage::between(&frame(5, 0.1, 0.1), &frame(15, 0.3, 0.3), PACE), HeadPassage::Walked);
        assert_eq!(
            HeadPassage::between(&frame(5, 0.1, 0.1), &frame(15, 0.1, 0.1), PACE),
            HeadPassage::Walked,
            "paused"
        );
    }

    #[test]
    fn seeks_forward_and_back_are_broken() {
        for (sim_time_s, travel_m) in [(0.05, 0.05), (0.11, 0.11), (0.121, 0.121), (300.0, 300.0), (0.12, 0.2)] {
            let next = frame(6, sim_time_s, travel_m);
            assert_eq!(HeadPassage::between(&frame(5, 0.1, 0.1), &next, PACE), HeadPassage::Broken, "{sim_time_s}");
        }
        assert_eq!(
            HeadPassage::between(&frame(5, 0.1, 0.1), &frame(15, 0.4, 0.4), PACE),
            HeadPassage::Broken,
            "in a gap"
        );
    }

    /// A frame that was due so many periods after instant 0.
    fn due(periods: u64, frame: FrameHeader) -> FrameHeader {
        FrameHeader { scheduled_ns: 7_000_000_000 + periods * 20_000_000, ..frame }
    }

    #[test]
    fn a_jump_over_missed_releases_is_walked() {
        let last = due(5, frame(5, 0.1, 0.1));
        for missed in [1_u32, 5, 12] {
            let time_s = 0.12 + 0.02 * f64::from(missed);
            let next = due(6 + u64::from(missed), frame(6, time_s, time_s));
            assert_eq!(HeadPassage::between(&last, &next, PACE), HeadPassage::Walked, "{missed} missed");
            let rested = FrameHeader { state: ShowState::Held.to_wire(), head_speed_mps: 0.0, ..next };
            assert_eq!(
                HeadPassage::between(&last, &rested, PACE),
                HeadPassage::Walked,
                "{missed} missed, at rest behind them"
            );
        }
        let next = due(12, frame(8, 0.24, 0.24));
        assert_eq!(HeadPassage::between(&last, &next, PACE), HeadPassage::Walked, "missed releases and lost frames");
        let next = due(106, frame(105, 2.2, 2.2));
        assert_eq!(HeadPassage::between(&last, &next, PACE), HeadPassage::Walked, "frames lost while it made up");
    }

    #[test]
    fn a_seek_beyond_what_the_clock_allows_is_broken() {
        let last = due(5, frame(5, 0.1, 0.1));
        assert_eq!(
            HeadPassage::between(&last, &due(6, frame(6, 0.22, 0.22)), PACE),
            HeadPassage::Broken,
            "no release is missed"
        );
        assert_eq!(
            HeadPassage::between(&last, &due(11, frame(6, 0.32, 0.32)), PACE),
            HeadPassage::Broken,
            "five are missed"
        );
        assert_eq!(
            HeadPassage::between(&last, &due(100, frame(6, 2.0, 2.0)), PACE),
            HeadPassage::Broken,
            "more than are jumped"
        );
    }

    #[test]
    fn a_tick_that_makes_up_for_a_standstill_is_walked() {
        let making_up = |frame: FrameHeader| FrameHeader { time_scale: 1.1, ..frame };
        let stood = due(5, frame(5, 0.1, 0.1));
        let first = making_up(due(105, frame(6, 0.122, 0.122)));
        let second = making_up(due(106, frame(7, 0.144, 0.144)));
        let jump = making_up(due(110, frame(8, 0.232, 0.232)));
        let on_time = due(111, frame(9, 0.252, 0.252));
        for pair in [stood, first, second, jump, on_time].windows(2) {
            assert_eq!(HeadPassage::between(&pair[0], &pair[1], PACE), HeadPassage::Walked, "{pair:?}");
        }
    }

    #[test]
    fn frames_of_another_host_are_walked_though_they_are_due_when_they_come() {
        let came = |at_ns: u64, frame: FrameHeader| FrameHeader { scheduled_ns: 7_000_000_000 + at_ns, ..frame };
        let last = came(0, frame(5, 0.1, 0.1));
        for (at_ns, time_s) in [(14_000_000, 0.12), (27_000_000, 0.12), (51_000_000, 0.16), (333_000_000, 0.34)] {
            let next = came(at_ns, frame(6, time_s, time_s));
            assert_eq!(HeadPassage::between(&last, &next, PACE), HeadPassage::Walked, "{time_s} s after {at_ns} ns");
        }
    }

    #[test]
    fn another_run_is_broken() {
        let next = FrameHeader { run_id: 2, ..frame(6, 0.12, 0.12) };
        assert_eq!(HeadPassage::between(&frame(5, 0.1, 0.1), &next, PACE), HeadPassage::Broken);
    }

    #[test]
    fn the_shortened_last_step_of_a_show_is_walked() {
        let last = FrameHeader { state: ShowState::Finished.to_wire(), head_speed_mps: 0.0, ..frame(6, 0.107, 0.107) };
        assert_eq!(HeadPassage::between(&frame(5, 0.1, 0.1), &last, PACE), HeadPassage::Walked);
    }

    #[test]
    fn a_ramp_is_walked_and_a_leap_on_it_is_not() {
        let pace = SourcePace { accel_mps2: Some(2.0), ..PACE };
        let last = FrameHeader { head_speed_mps: 0.5, ..frame(5, 0.1, 0.1) };
        let next = |travel_m| FrameHeader { head_speed_mps: 0.54, ..frame(6, 0.12, travel_m) };
        assert_eq!(HeadPassage::between(&last, &next(0.1104), pace), HeadPassage::Walked);
        assert_eq!(HeadPassage::between(&last, &next(0.1104), PACE), HeadPassage::Broken);
        assert_eq!(HeadPassage::between(&last, &next(0.1107), pace), HeadPassage::Broken);
    }
}
