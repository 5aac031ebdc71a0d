//! The speed from which `+` and `-` start.

use bench_dragon_ipc::{Request, ShowState};

use crate::display::observe::Snapshot;

/// Change of the speed per key, in metres per show second.
const STEP_MPS: f64 = 0.1;

/// The last requested speed, until the head walks steadily; then the head's own speed.
///
/// So three presses of a key request three steps, however slowly the head accelerates. A paused head, whose frames have speed
/// 0, keeps its last speed as the start. If the head walks steadily at another speed, because another operator has requested
/// one or the guard grants no more, the next step starts from that speed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SpeedSteps {
    run_id: u64,
    asked_mps: Option<f64>,
    /// Number of requested speeds that are not answered yet.
    unanswered: u32,
    /// The tick from which the last requested speed holds.
    holds_from: u64,
    walked: Option<HeadSpeed>,
}

/// A speed of the head, and its tick.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HeadSpeed {
    tick: u64,
    speed_mps: f64,
}

impl SpeedSteps {
    /// Records the head's speed.
    pub(super) fn see(&mut self, snapshot: &Snapshot) {
        let Some(header) = snapshot.header() else { return };
        if header.run_id != self.run_id {
            *self = Self { run_id: header.run_id, ..Self::default() };
        }
        if header.show_state() != Some(ShowState::Running) || self.walked.is_some_and(|walk| walk.tick == header.tick) {
            return;
        }
        let walk = HeadSpeed { tick: header.tick, speed_mps: header.course_mps };
        let before = self.walked.replace(walk);
        // On a ramp, no two ticks have the same speed.
        let keeps_it =
            before.is_some_and(|before| before.tick > self.holds_from && before.is_as_fast_as(walk.speed_mps));
        let is_reached = self.asked_mps.is_some_and(|asked_mps| walk.is_as_fast_as(asked_mps));
        if is_reached || self.unanswered == 0 && keeps_it {
            self.asked_mps = None;
        }
    }

    /// Records that a speed is requested.
    pub(super) fn ask(&mut self, speed_mps: f64) {
        self.asked_mps = Some(speed_mps);
        self.unanswered += 1;
    }

    /// Records that the requested speed holds from a tick on, or was not accepted.
    pub(super) fn answer(&mut self, answer: Result<u64, ()>) {
        self.unanswered = self.unanswered.saturating_sub(1);
        match answer {
            Ok(tick) => self.holds_from = tick,
            Err(()) => self.asked_mps = None,
        }
    }

    /// Returns the speed that is `steps` steps faster, rounded to tenths, within the allowed range.
    pub(super) fn stepped(&self, snapshot: &Snapshot, steps: f64) -> f64 {
        let planned_mps = snapshot.run.as_ref().map_or(1.0, |run| run.config.tables().head.speed_mps);
        let now_mps = self.asked_mps.or(self.walked.map(|walk| walk.speed_mps)).unwrap_or(planned_mps);
        let tenths = (now_mps / STEP_MPS + steps).round();
        (tenths / 10.0).clamp(0.0, Request::MAX_SPEED_MPS)
    }
}

impl HeadSpeed {
    fn is_as_fast_as(&self, speed_mps: f64) -> bool {
        (self.speed_mps - speed_mps).abs() < 1e-9
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bench_dragon_ipc::CommandReply;

    use super::*;
    use crate::display::watch::sample::{new_screen, type_keys, walking};
    use crate::display::watch::{CommandOutcome, KeyAction};

    fn walking_at(speed_mps: f64, tick: u64) -> Snapshot {
        let mut snapshot = walking(ShowState::Running, speed_mps);
        Arc::make_mut(snapshot.frame.as_mut().expect("a frame")).header.tick = tick;
        snapshot
    }

    #[test]
    fn steps_of_speed_add_up_before_the_head_reaches_the_first_one() {
        let (mut screen, snapshot) = (new_screen(false), walking(ShowState::Running, 1.0));
        screen.see(&snapshot, 0);
        let actions = type_keys(&mut screen, "++-+", &snapshot);
        let speeds = [1.1, 1.2, 1.1, 1.2].map(|speed_mps| KeyAction::Command(Request::Speed { speed_mps }));
        assert_eq!(actions, speeds);
    }

    #[test]
    fn steps_of_speed_stay_in_range_and_start_from_the_heads_own_speed() {
        let mut screen = new_screen(false);
        for (tick, (at_mps, key, to_mps)) in (1..).zip([(9.96, "+", 10.0), (0.04, "-", 0.0), (0.73, "+", 0.8)]) {
            let snapshot = walking_at(at_mps, tick);
            screen.speed_steps.answer(Err(()));
            screen.see(&snapshot, 0);
            let expected = KeyAction::Command(Request::Speed { speed_mps: to_mps });
            assert_eq!(type_keys(&mut screen, key, &snapshot), [expected]);
        }
        screen.speed_steps.answer(Err(()));
        let paused = walking(ShowState::Paused, 0.0);
        screen.see(&paused, 0);
        let expected = KeyAction::Command(Request::Speed { speed_mps: 0.8 });
        assert_eq!(type_keys(&mut screen, "+", &paused), [expected], "a paused head had walked at 0.73 m/s");
    }

    #[test]
    fn a_step_after_another_operators_speed_starts_from_that_speed() {
        let (mut screen, paused) = (new_screen(false), walking(ShowState::Paused, 0.0));
        let accepted = CommandReply { tick: 10, ..CommandReply::default() };
        screen.see(&walking(ShowState::Running, 1.0), 0);
        let faster = Request::Speed { speed_mps: 1.1 };
        assert_eq!(type_keys(&mut screen, "+", &paused), [KeyAction::Command(faster)]);
        screen.answer(CommandOutcome::to(faster, Ok(accepted)));
        for (tick, speed_mps) in [(11, 0.5), (12, 0.5)] {
            screen.see(&walking_at(speed_mps, tick), 0);
        }
        let expected = KeyAction::Command(Request::Speed { speed_mps: 0.6 });
        assert_eq!(type_keys(&mut screen, "+", &walking(ShowState::Running, 0.5)), [expected]);
    }

    #[test]
    fn steps_of_speed_add_up_while_the_head_speeds_up() {
        let (mut screen, snapshot) = (new_screen(false), walking(ShowState::Running, 1.0));
        screen.see(&snapshot, 0);
        let speeds = [1.1, 1.2].map(|speed_mps| Request::Speed { speed_mps });
        assert_eq!(type_keys(&mut screen, "++", &snapshot), speeds.map(KeyAction::Command));
        let accepted = |tick| Ok(CommandReply { tick, ..CommandReply::default() });
        // The head keeps the first speed for a while, and the second is not answered yet.
        screen.answer(CommandOutcome::to(speeds[0], accepted(10)));
        for tick in 11..15 {
            screen.see(&walking_at(1.1, tick), 0);
        }
        screen.answer(CommandOutcome::to(speeds[1], accepted(20)));
        // A repeated frame has no effect, and a ramp is no steady speed.
        for (speed_mps, tick) in [(1.1, 20), (1.1, 20), (1.12, 21), (1.14, 22), (1.16, 23)] {
            screen.see(&walking_at(speed_mps, tick), 0);
        }
        let expected = KeyAction::Command(Request::Speed { speed_mps: 1.3 });
        assert_eq!(type_keys(&mut screen, "+", &snapshot), [expected]);
    }
}
