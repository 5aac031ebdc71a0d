//! Taking commands off the bus.

use bench_dragon_ipc::service::{CommandService, MAX_ACTIVE_REQUESTS, Member, Service};
use bench_dragon_ipc::{BusError, Command, CommandReply, Refusal, Request, service};
use iceoryx2::port::server::Server;

/// Commands taken in one tick at most; the others wait for the next.
pub(crate) const MAX_COMMANDS_PER_TICK: usize = MAX_ACTIVE_REQUESTS;

/// The answering side of an instance's commands.
#[derive(Debug)]
pub(crate) struct CommandServer {
    // Dropped before its service.
    server: Server<Service, Command, (), CommandReply, ()>,
    _commands: CommandService,
}

impl CommandServer {
    /// Creates the service, or takes over the one that clients of an earlier server keep open.
    ///
    /// # Errors
    /// As [`Member::commands`].
    pub(crate) fn create(member: &Member) -> Result<Self, BusError> {
        let commands = member.commands()?;
        let server = commands
            .server_builder()
            .create()
            .map_err(|error| BusError::Failed { service: service::COMMANDS, reason: error.to_string() })?;
        Ok(Self { server, _commands: commands })
    }

    /// Takes up to [`MAX_COMMANDS_PER_TICK`] commands and answers each with what `decide` says of it.
    ///
    /// A client that is gone before its answer, or a connection that fails, changes nothing for the others.
    pub(crate) fn drain(&self, run_id: u64, tick: u64, mut decide: impl FnMut(Request) -> Result<(), Refusal>) {
        for _ in 0..MAX_COMMANDS_PER_TICK {
            let Ok(Some(active)) = self.server.receive() else { return };
            let outcome = Request::from_wire(active.payload()).ok_or(Refusal::Unknown).and_then(&mut decide);
            let reply = match outcome {
                Ok(()) => CommandReply::accepted(run_id, tick),
                Err(refusal) => CommandReply::refused(run_id, tick, refusal),
            };
            let _ = active.send_copy(reply);
        }
    }
}
