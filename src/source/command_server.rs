//! Taking commands off the bus, and the record of them: from the loop to the thread that publishes their events.

use bench_dragon_ipc::service::{self, CommandService, MAX_ACTIVE_REQUESTS, Member, Service};
use bench_dragon_ipc::{BusError, Command, CommandEvent, CommandReply, Refusal, Request};
use iceoryx2::port::server::Server;
use rtrb::{Consumer, Producer, RingBuffer};

use crate::system::clock::unix_ns;
#[cfg(feature = "zenoh")]
use iceoryx2::active_request::ActiveRequest;

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

/// Events that may wait to be published: more than a flood of commands makes in the time between two reports.
const MOST_WAITING: usize = 1024;

/// The loop's end of the record. Recording neither waits nor allocates.
#[derive(Debug)]
pub(crate) struct CommandLog {
    waiting: Producer<CommandEvent>,
    run_id: u64,
    /// The next event's number.
    number: u64,
}

impl CommandLog {
    /// The empty record of a run, and the end of it that the publishing thread reads.
    pub(super) fn new(run_id: u64) -> (Self, Consumer<CommandEvent>) {
        let (waiting, to_publish) = RingBuffer::new(MOST_WAITING);
        (Self { waiting, run_id, number: 0 }, to_publish)
    }

    /// Records an event at a show time, after so many missed releases. Where too many wait already, it is lost, which its
    /// readers see by the next one's number.
    pub(crate) fn record(&mut self, event: CommandEvent, moment: Moment) {
        let Moment { sim_time_ns, overruns } = moment;
        let (run_id, number) = (self.run_id, self.number);
        let _ = self.waiting.push(CommandEvent { run_id, number, sim_time_ns, overruns, wall_ns: unix_ns(), ..event });
        self.number += 1;
    }
}

/// Where a run stands as it takes a command.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Moment {
    /// Show time in nanoseconds.
    pub(crate) sim_time_ns: i64,
    /// Releases missed so far.
    pub(crate) overruns: u64,
}
