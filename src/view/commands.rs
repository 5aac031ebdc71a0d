//! Commands on their way to the bus.

use std::sync::Arc;

use bench_dragon_ipc::{BusError, CommandReply, Domain, Request};
use tokio::sync::Semaphore;

use crate::control;

/// Commands that wait for their reply at a time, in each lane.
const LANE_WIDTH: usize = 4;

/// Sends commands, on threads that may wait for the server. A hold has a lane of its own, so that no other command that waits
/// can keep it waiting.
#[derive(Clone, Debug)]
pub(super) struct Commands {
    domain: Domain,
    holds: Arc<Semaphore>,
    others: Arc<Semaphore>,
}

/// Why there is no reply.
#[derive(Debug)]
pub(super) enum CommandFailure {
    /// As many commands as the lane takes are on their way.
    Crowded,
    /// The bus's reason.
    Bus(BusError),
}

impl Commands {
    pub(super) fn new(domain: Domain) -> Self {
        let lane = || Arc::new(Semaphore::new(LANE_WIDTH));
        Self { domain, holds: lane(), others: lane() }
    }

    /// Sends a command and waits for its reply, which takes as long as [`control::call`].
    pub(super) async fn call(&self, request: Request) -> Result<CommandReply, CommandFailure> {
        let lane = if request == Request::Hold { &self.holds } else { &self.others };
        let place = Arc::clone(lane).try_acquire_owned().map_err(|_| CommandFailure::Crowded)?;
        let domain = self.domain.clone();
        let called = tokio::task::spawn_blocking(move || {
            let _place = place;
            control::call(&domain, "view-command", request)
        });
        called.await.expect("a call does not panic").map_err(CommandFailure::Bus)
    }
}
