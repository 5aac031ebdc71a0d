//! The speed that `+` and `-` start from.

use bench_dragon_ipc::{Request, ShowState};

use crate::display::observe::Snapshot;

/// By so much a key changes it, in metres per show second.
const STEP_MPS: f64 = 0.1;

/// The speed that was last asked for, until the head keeps one; then the head's own.
///
/// So a key that is hit three times asks for three steps, however slowly the head speeds up; and a paused head, which says
/// nothing of its speed, is still known to have had one. Where somebody else has asked for another speed meanwhile, or the guard
/// grants no more, the head keeps that.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SpeedSteps {
    run_id: u64,
    asked_mps: Option<f64>,
    /// Speeds that were asked for and are not answered yet.
    unanswered: u32,
    /// The tick from which the speed that was last asked for holds.
    holds_from: u64,
    walked: Option<HeadSpeed>,
}

/// A speed that the head walks at, and the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HeadSpeed {
    tick: u64,
    speed_mps: f64,
}

impl SpeedSteps {
    /// Takes note of the head's speed.
    pub(super) fn see(&mut self, snapshot: &Snapshot) {
        let Some(header) = snapshot.header() else { return };
        if header.run_id != self.run_id {
            *self = Self { run_id: header.run_id, ..Self::default() };
        }
        if header.show_state() != Some(ShowState::Running) || self.walked.is_some_and(|walk| walk.tick == header.tick) {
            return;
        }
        let walk = HeadSpeed { tick: header.tick, speed_mps: header.head_speed_mps };
        let before = self.walked.replace(walk);
        // On a ramp no two ticks have the same speed.
        let keeps_it =
            before.is_some_and(|before| before.tick > self.holds_from && before.is_as_fast_as(walk.speed_mps));
        let is_reached = self.asked_mps.is_some_and(|asked_mps| walk.is_as_fast_as(asked_mps));
        if is_reached || self.unanswered == 0 && keeps_it {
            self.asked_mps = None;
        }
    }

    /// Takes note that this speed is asked for.
    pub(super) fn ask(&mut self, speed_mps: f64) {
        self.asked_mps = Some(speed_mps);
        self.unanswered += 1;
    }

    /// Takes note that what was asked for holds from a tick on, or is not to be had.
    pub(super) fn answer(&mut self, answer: Result<u64, ()>) {
        self.unanswered = self.unanswered.saturating_sub(1);
        match answer {
            Ok(tick) => self.holds_from = tick,
            Err(()) => self.asked_mps = None,
        }
    }

    /// The speed that is so many steps faster, in tenths, within what may be asked for.
    pub(super) fn stepped(&self, snapshot: &Snapshot, steps: f64) -> f64 {
        let planned_mps = snapshot.run.as_ref().map_or(1.0, |run| run.config.head_speed_mps());
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
