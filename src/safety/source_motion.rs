//! Decides whether the head walked from one frame to the next, so that the travel between can be swept, or was repositioned.

use bench_dragon_ipc::{FrameHeader, Request, ShowState};

use crate::config::Config;
use crate::source::server::motion::FASTEST;

/// Greatest difference of show time from a whole number of steps, in seconds: its resolution on the wire.
const SHOW_TIME_TOLERANCE_S: f64 = 2e-9;
/// Greatest difference of travel from speed times show time, in metres: that resolution at the greatest speed.
const TRAVEL_TOLERANCE_M: f64 = SHOW_TIME_TOLERANCE_S * Request::MAX_SPEED_MPS;

/// Greatest time scale of a source that follows timecode ÷ configured time scale, with a reserve.
const TIMECODE_SPEEDUP: f64 = 1.25;
/// Rounding of the instants at which two frames were due, in seconds.
const CLOCK_TOLERANCE_S: f64 = 2e-9;
/// Show time that may have passed between two frames, in configured steps, above which a period was missed. One period takes at most
/// 1.21, with the fastest timecode and a standstill to make up for, and two periods take at least 1.8, with the slowest timecode.
const MISSED_FROM: f64 = 1.5;

/// Properties of the source's steps in a configuration.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SourceMotion {
    /// Configured step of show time per running tick, in seconds.
    tick_s: f64,
    /// Ticks per second. With timecode, the step of show time is the frame's time scale ÷ this rate.
    rate_hz: u32,
    /// Greatest acceleration in m/s². `None`: the head starts and stops at once.
    accel_mps2: Option<f64>,
    /// Whether the show starts and stops at once where its plan rests.
    has_planned_ends: bool,
    /// The beginning of a plan and its waits: a show that has not left one of these yet also takes a new speed at once.
    planned_rests_m: Vec<f64>,
    /// Greatest number of missed periods over which a server jumps between two frames.
    most_jumped: u64,
}

impl SourceMotion {
    pub(super) fn of(config: &Config) -> Self {
        let begin_m = config.formation().begin_m();
        Self {
            tick_s: config.tick_s(),
            rate_hz: config.tables().serve.rate_hz,
            accel_mps2: config.accel_mps2(),
            has_planned_ends: config.formation().has_plan_course(),
            planned_rests_m: std::iter::once(begin_m).chain(config.waits_m().iter().copied()).collect(),
            most_jumped: config.most_jumped(),
        }
    }

    /// Whether the head walked, or stood still, from one frame of a source to a later one. It then passed all travel between,
    /// in this order. Otherwise the source restarted or the head was repositioned, and the travel between is unknown.
    ///
    /// After missed periods, the next tick of a server advances by all missed periods. So missed periods between two
    /// successive frames count like lost frames: the clock limits how far the head walked.
    pub(super) fn has_walked(&self, last: &FrameHeader, next: &FrameHeader) -> bool {
        let Self { tick_s, rate_hz, accel_mps2, has_planned_ends, most_jumped, .. } = *self;
        if last.run_id != next.run_id || last.tick >= next.tick {
            return false;
        }
        let show_step_s = (next.show_time_ns - last.show_time_ns) as f64 * 1e-9;
        let travel_step_m = next.course_m - last.course_m;
        let (ticks, clock_s) = (next.tick - last.tick, clock_s(last, next));
        let [last_s, next_s] = [last, next].map(|header| header.time_scale / f64::from(rate_hz));
        // Another time scale than the configured one has three causes. The source follows timecode, it makes up for a
        // standstill, or it replays a recording faster or slower, perhaps one of the first two. In the last case, the time
        // scale does not determine the steps.
        let has_own_pace = [last_s, next_s] != [tick_s; 2];
        let longest_tick_s = if has_own_pace { TIMECODE_SPEEDUP * tick_s } else { tick_s };
        let has_missed = clock_s > MISSED_FROM * tick_s;
        let longest_s = match ticks {
            // A frame from another host is due at its arrival. It may arrive early, so one more period is allowed.
            1 if has_missed => (clock_s + longest_tick_s).min((most_jumped as f64 + 1.0) * longest_tick_s),
            1 => longest_tick_s,
            // Between the two frames, the source may have jumped and made up for a standstill.
            _ => FASTEST * clock_s.max(ticks as f64 * longest_tick_s),
        };
        if !(0.0..=longest_s + SHOW_TIME_TOLERANCE_S).contains(&show_step_s) || travel_step_m < 0.0 {
            return false;
        }
        let runs = next.show_state().is_some_and(ShowState::walks);
        if ticks > 1 || has_missed || !runs {
            return travel_step_m <= show_step_s * Request::MAX_SPEED_MPS + TRAVEL_TOLERANCE_M;
        }
        // Successive frames of a running show are one step apart. At another pace than configured, the step is at most that long.
        // The head walks at the speed in the second frame, or on a ramp to it. On a ramp, the mean speed differs from the mean of
        // both speeds by at most a quarter of the greatest speed change.
        let mean_mps = 0.5 * (last.course_mps + next.course_mps);
        let off_m = accel_mps2.map_or(0.0, |accel_mps2| 0.25 * accel_mps2 * show_step_s * show_step_s);
        let at_once_m = next.course_mps * show_step_s;
        let is_near = |step_m: f64, off_m: f64| (travel_step_m - step_m).abs() <= off_m + TRAVEL_TOLERANCE_M;
        let is_at_rest = last.course_mps == 0.0 || self.planned_rests_m.contains(&last.course_m);
        let may_start_at_once = accel_mps2.is_none() || has_planned_ends && is_at_rest;
        let walks_so = may_start_at_once && is_near(at_once_m, 0.0)
            || accel_mps2.is_some() && is_near(mean_mps * show_step_s, off_m);
        let is_step = has_own_pace || (show_step_s - tick_s).abs() <= SHOW_TIME_TOLERANCE_S;
        is_step && walks_so
    }
}

/// Show time that may have passed between the instants at which two frames were due, in seconds.
fn clock_s(last: &FrameHeader, next: &FrameHeader) -> f64 {
    let elapsed_s = next.scheduled_ns.saturating_sub(last.scheduled_ns) as f64 * 1e-9;
    (elapsed_s + CLOCK_TOLERANCE_S) * last.time_scale.max(next.time_scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::safety::monitor::walking_frame as frame;
    use crate::source::timecode::Follower;

    const MOTION: SourceMotion = SourceMotion {
        tick_s: 0.02,
        rate_hz: 50,
        accel_mps2: None,
        has_planned_ends: false,
        planned_rests_m: Vec::new(),
        most_jumped: 12,
    };

    fn scaled(time_scale: f64, frame: FrameHeader) -> FrameHeader {
        FrameHeader { time_scale, ..frame }
    }

    fn at_travel(head_travel_m: f64, frame: FrameHeader) -> FrameHeader {
        FrameHeader { head_travel_m, ..frame }.of_one_dragon()
    }

    /// A frame that was due `at_ns` after a fixed instant.
    fn due(at_ns: u64, frame: FrameHeader) -> FrameHeader {
        FrameHeader { scheduled_ns: 7_000_000_000 + at_ns, ..frame }
    }

    const PERIOD_NS: u64 = 20_000_000;

    #[test]
    fn steps_within_the_stated_speed_and_time_are_walked_and_others_are_not() {
        let last = frame(5, 0.1);
        let (fast, finished) = (scaled(100.0, last), ShowState::Finished.to_wire());
        for (last, next, is_walked, what) in vec![
            (last, frame(6, 0.12), true, "a step at the stated speed"),
            (last, scaled(1.05, frame(6, 0.121)), true, "a step at the time scale of a followed timecode"),
            (last, scaled(1.05, frame(15, 0.31)), true, "a gap at that time scale"),
            (fast, scaled(100.0, frame(10, 0.2)), true, "a gap of a fast replay"),
            (fast, scaled(100.0, frame(10, 1.2)), false, "a seek within such a gap"),
            (last, frame(15, 0.3), true, "a gap that the head could walk"),
            (last, frame(15, 0.1), true, "paused"),
            (last, frame(6, 0.05), false, "a seek back"),
            (last, frame(6, 0.11), false, "a seek by less than a step"),
            (last, frame(6, 0.121), false, "a seek by a little"),
            (last, frame(6, 300.0), false, "a seek far ahead"),
            (last, at_travel(0.2, frame(6, 0.12)), false, "travel that the time does not allow"),
            (last, frame(15, 0.4), false, "a seek in a gap"),
            (last, FrameHeader { run_id: 2, ..frame(6, 0.12) }, false, "another run"),
            (last, FrameHeader { state: finished, course_mps: 0.0, ..frame(6, 0.107) }, true, "a last step, shortened"),
        ] {
            assert_eq!(MOTION.has_walked(&last, &next), is_walked, "{what}");
        }
    }

    #[test]
    fn jump_over_missed_periods_is_walked_and_seek_beyond_the_clock_is_not() {
        let last = due(5 * PERIOD_NS, frame(5, 0.1));
        let walked = |periods, next| MOTION.has_walked(&last, &due(periods * PERIOD_NS, next));
        for missed in [1_u32, 5, 12] {
            let (periods, next) = (6 + u64::from(missed), frame(6, 0.12 + 0.02 * f64::from(missed)));
            assert!(walked(periods, next), "{missed} missed");
            let rested = FrameHeader { state: ShowState::Held.to_wire(), course_mps: 0.0, ..next };
            assert!(walked(periods, rested), "{missed} missed, at rest after them");
        }
        for (periods, next, is_walked, what) in [
            (12, frame(8, 0.24), true, "missed periods and lost frames"),
            (106, frame(105, 2.2), true, "frames lost while the server made up for a standstill"),
            (6, frame(6, 0.22), false, "no missed period"),
            (11, frame(6, 0.32), false, "five missed periods"),
            (100, frame(6, 2.0), false, "more missed periods than a server jumps over"),
        ] {
            assert_eq!(walked(periods, next), is_walked, "{what}");
        }
    }

    #[test]
    fn jump_over_one_missed_period_is_walked_at_every_pace_of_a_timecode() {
        for time_scale in [Follower::LEAST_TIME_SCALE, 0.9357, 1.0, Follower::GREATEST_TIME_SCALE] {
            let last = due(5 * PERIOD_NS, scaled(time_scale, frame(5, 0.1)));
            let next = due(7 * PERIOD_NS, scaled(time_scale, frame(6, 0.1 + 0.04 * time_scale)));
            assert!(MOTION.has_walked(&last, &next), "at {time_scale}");
        }
    }

    #[test]
    fn seek_at_the_greatest_pace_of_a_timecode_without_a_missed_period_is_not_walked() {
        let fastest = scaled(Follower::GREATEST_TIME_SCALE * FASTEST, frame(5, 0.1));
        let next = scaled(fastest.time_scale, frame(6, 0.14));
        assert!(!MOTION.has_walked(&due(5 * PERIOD_NS, fastest), &due(6 * PERIOD_NS, next)));
    }

    #[test]
    fn ticks_that_make_up_for_a_standstill_are_walked() {
        let making_up = |periods, tick, time_s| due(periods * PERIOD_NS, scaled(1.1, frame(tick, time_s)));
        let stood = due(5 * PERIOD_NS, frame(5, 0.1));
        let (first, second, jump) = (making_up(105, 6, 0.122), making_up(106, 7, 0.144), making_up(110, 8, 0.232));
        let on_time = due(111 * PERIOD_NS, frame(9, 0.252));
        for pair in [stood, first, second, jump, on_time].windows(2) {
            assert!(MOTION.has_walked(&pair[0], &pair[1]), "{pair:?}");
        }
    }

    /// The recorded show made up for a standstill, so its steps are a tenth longer; its replay has another time scale yet.
    #[test]
    fn replay_of_ticks_that_make_up_for_a_standstill_is_walked_at_any_rate() {
        for rate in [0.01, 0.95, 1.0, 2.0, 100.0] {
            let played = |periods: u32, tick, time_s| {
                let at_ns = f64::from(periods) * 20e6 / rate;
                due(at_ns as u64, scaled(1.1 * rate, frame(tick, time_s)))
            };
            let steps = [played(5, 5, 0.1), played(6, 6, 0.122), played(7, 7, 0.144)];
            for pair in steps.windows(2) {
                assert!(MOTION.has_walked(&pair[0], &pair[1]), "at {rate}: {pair:?}");
            }
            assert!(!MOTION.has_walked(&steps[2], &played(8, 8, 0.3)), "a seek at {rate}");
        }
    }

    #[test]
    fn frames_of_another_host_that_are_due_at_their_arrival_are_walked() {
        let last = due(0, frame(5, 0.1));
        for (at_ns, time_s) in [(14_000_000, 0.12), (27_000_000, 0.12), (51_000_000, 0.16), (333_000_000, 0.34)] {
            assert!(MOTION.has_walked(&last, &due(at_ns, frame(6, time_s))), "{time_s} s after {at_ns} ns");
        }
    }

    #[test]
    fn ramp_is_walked_and_jump_on_a_ramp_is_not() {
        let ramping = SourceMotion { accel_mps2: Some(2.0), ..MOTION };
        let last = FrameHeader { course_mps: 0.5, ..frame(5, 0.1) };
        let next = |travel_m| FrameHeader { course_mps: 0.54, ..at_travel(travel_m, frame(6, 0.12)) };
        assert!(ramping.has_walked(&last, &next(0.1104)) && !ramping.has_walked(&last, &next(0.1107)));
        assert!(!MOTION.has_walked(&last, &next(0.1104)));
    }

    #[test]
    fn new_speed_where_a_plan_rests_is_walked_and_elsewhere_is_not() {
        let planned =
            |planned_rests_m| SourceMotion { accel_mps2: Some(0.3), has_planned_ends: true, planned_rests_m, ..MOTION };
        // The frame before shows the show at the wait, with the speed at which it leaves.
        let last = FrameHeader { course_mps: 1.0, ..frame(5, 0.1) };
        let next = FrameHeader { course_mps: 2.0, ..at_travel(0.1 + 0.02 * 2.0, frame(6, 0.12)) };
        assert!(planned(vec![0.0, 0.1]).has_walked(&last, &next));
        assert!(!planned(vec![0.0, 0.2]).has_walked(&last, &next));
    }
}
