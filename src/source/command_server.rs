//! Taking commands off the bus.

use bench_dragon_ipc::service::{CommandService, MAX_ACTIVE_REQUESTS, Member, Service};
use bench_dragon_ipc::{BusError, Command, CommandEvent, CommandReply, Refusal, Request, service};
#[cfg(feature = "zenoh")]
use iceoryx2::active_request::ActiveRequest;
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
        let server = commands.server_builder().create().map_err(|error| BusError::failed(service::COMMANDS, error))?;
        Ok(Self { server, _commands: commands })
    }

    /// Takes the next command, to be answered later.
    #[cfg(feature = "zenoh")]
    pub(crate) fn take(&self) -> Option<AskedCommand> {
        self.server.receive().ok().flatten().map(AskedCommand)
    }

    /// Takes up to [`MAX_COMMANDS_PER_TICK`] commands, answers each with what `decide` says of it, and hands it with its
    /// answer to `record`.
    ///
    /// A client that is gone before its answer, or a connection that fails, changes nothing for the others.
    pub(crate) fn drain(
        &self,
        run_id: u64,
        tick: u64,
        mut decide: impl FnMut(Request) -> Result<(), Refusal>,
        mut record: impl FnMut(CommandEvent),
    ) {
        for _ in 0..MAX_COMMANDS_PER_TICK {
            let Ok(Some(active)) = self.server.receive() else { return };
            let outcome = Request::from_wire(active.payload()).ok_or(Refusal::Unknown).and_then(&mut decide);
            let reply = match outcome {
                Ok(()) => CommandReply::accepted(run_id, tick),
                Err(refusal) => CommandReply::refused(run_id, tick, refusal),
            };
            record(CommandEvent::answered(active.payload(), &reply));
            let _ = active.send_copy(reply);
        }
    }
}

/// A command that its client waits for an answer to.
#[cfg(feature = "zenoh")]
#[derive(Debug)]
pub(crate) struct AskedCommand(ActiveRequest<Service, Command, (), CommandReply, ()>);

#[cfg(feature = "zenoh")]
impl AskedCommand {
    /// What is asked for; `None` for a kind that this version does not know.
    pub(crate) fn request(&self) -> Option<Request> {
        Request::from_wire(self.0.payload())
    }

    /// Answers it. A client that has gone in the meantime changes nothing.
    pub(crate) fn answer(self, reply: CommandReply) {
        let _ = self.0.send_copy(reply);
    }
}
