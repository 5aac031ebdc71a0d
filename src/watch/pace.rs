//! The speed that `+` and `-` start from.

use bench_dragon_ipc::{Request, ShowState};

use crate::observe::Scene;

/// By so much a key changes it, in metres per show second.
const STEP_MPS: f64 = 0.1;

/// The speed that was last asked for, until the head walks at it; then the head's own.
///
/// So a key that is hit three times asks for three steps, however slowly the head speeds up; and a paused head, which says
/// nothing of its speed, is still known to have had one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Pace {
    run_id: u64,
    asked_mps: Option<f64>,
    walked_mps: Option<f64>,
}

impl Pace {
    /// Takes note of the head's speed.
    pub(super) fn see(&mut self, scene: &Scene) {
        let Some(still) = &scene.frame else { return };
        let header = &still.header;
        if header.run_id != self.run_id {
            *self = Self { run_id: header.run_id, ..Self::default() };
        }
        if header.show_state() == Some(ShowState::Running) {
            self.walked_mps = Some(header.head_speed_mps);
            if self.asked_mps.is_some_and(|asked_mps| (asked_mps - header.head_speed_mps).abs() < 1e-9) {
                self.asked_mps = None;
            }
        }
    }

    /// Takes note that this speed is asked for.
    pub(super) fn ask(&mut self, speed_mps: f64) {
        self.asked_mps = Some(speed_mps);
    }

    /// Takes note that what was asked for is not to be had.
    pub(super) fn forget(&mut self) {
        self.asked_mps = None;
    }

    /// The speed that is so many steps faster, in tenths, within what may be asked for.
    pub(super) fn stepped(&self, scene: &Scene, steps: f64) -> f64 {
        let planned_mps = scene.run.as_ref().map_or(1.0, |run| run.config.head_speed_mps());
        let now_mps = self.asked_mps.or(self.walked_mps).unwrap_or(planned_mps);
        let tenths = (now_mps / STEP_MPS + steps).round();
        (tenths / 10.0).clamp(0.0, Request::MAX_SPEED_MPS)
    }
}
