//! Whether a hold is really to be released.

use bench_dragon_ipc::FrameHeader;

use crate::observe::Scene;

/// So long the question stands, in nanoseconds.
const STANDS_NS: u64 = 5_000_000_000;

/// The question, since when it is asked, and of what show: its run and its state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Question {
    asked_ns: u64,
    about: Option<(u64, u32)>,
}

impl Question {
    /// What is asked.
    pub(super) const TEXT: &'static str = "release the hold? r again";

    /// Asks it.
    pub(super) fn ask(scene: &Scene, now_ns: u64) -> Self {
        Self { asked_ns: now_ns, about: about(scene) }
    }

    /// Whether it still stands: of a show that has been held meanwhile, or has ended, it was not asked.
    pub(super) fn stands(&self, scene: &Scene, now_ns: u64) -> bool {
        now_ns.saturating_sub(self.asked_ns) < STANDS_NS && self.about == about(scene)
    }
}

fn about(scene: &Scene) -> Option<(u64, u32)> {
    let FrameHeader { run_id, state, .. } = scene.frame.as_ref()?.header;
    Some((run_id, state))
}
