//! A rehearsal that gives GO by itself, a fixed time after the show has begun to wait at a cue.

use std::time::{Duration, Instant};

use bench_dragon_ipc::{Domain, FrameHeader, Request, Sender, ShowState};

use super::wall_time::log;
use crate::command_queue::CommandQueue;

/// Time after which a GO that had no effect is sent again.
const AGAIN: Duration = Duration::from_secs(2);

/// Sends GO to each cue that waits.
pub(super) struct AutoGo {
    wait: Duration,
    queue: CommandQueue,
    /// When the next GO is due; `None` while nothing waits.
    due: Option<Instant>,
}

impl AutoGo {
    /// Joins the bus.
    ///
    /// # Errors
    /// The operating system cannot start a thread.
    pub(super) fn open(domain: &Domain, wait: Duration) -> std::io::Result<Self> {
        Ok(Self { wait, queue: CommandQueue::open(domain.clone(), "show-go", Sender::Show)?, due: None })
    }

    /// Notes a frame that the show has read at an instant.
    pub(super) fn see_frame(&mut self, header: &FrameHeader, now: Instant) {
        if header.show_state() != Some(ShowState::Waiting) {
            self.due = None;
            return;
        }
        if now < *self.due.get_or_insert(now + self.wait) {
            return;
        }
        self.due = Some(now + AGAIN);
        self.queue.submit(Request::Go, |outcome| match outcome.map(|reply| reply.outcome()) {
            Ok(Ok(_)) => {}
            Ok(Err(refusal)) => log(&format!("GO refused: {}", refusal.explain(&Request::Go))),
            Err(error) => log(&format!("GO not sent: {error}")),
        });
    }
}
