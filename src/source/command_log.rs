//! Record of commands: a queue of events from the loop to the thread that publishes them.

#[cfg(feature = "zenoh")]
use bench_dragon_ipc::{Command, CommandReply, Request, service::Service};
use bench_dragon_ipc::{CommandEvent, EventKind};
#[cfg(feature = "zenoh")]
use iceoryx2::active_request::ActiveRequest;
use rtrb::{Consumer, Producer, RingBuffer};

use crate::system::clock::unix_ns;

/// Greatest number of events that wait to be published: more than a flood of commands produces between two reports.
const MOST_WAITING: usize = 1024;

/// The loop's end of the record. Recording neither waits nor allocates.
#[derive(Debug)]
pub(crate) struct CommandLog {
    waiting: Producer<CommandEvent>,
    run_id: u64,
    number: u64,
    /// The first accepted stop.
    stop: Option<CommandEvent>,
}

impl CommandLog {
    /// Creates the empty record of a run. Returns it with the end that the publishing thread reads.
    pub(super) fn new(run_id: u64) -> (Self, Consumer<CommandEvent>) {
        let (waiting, to_publish) = RingBuffer::new(MOST_WAITING);
        (Self { waiting, run_id, number: 0, stop: None }, to_publish)
    }

    /// Records an event at a show time, with the number of periods missed so far. A full queue drops the event.
    /// Readers detect this by the gap in the event numbers.
    pub(crate) fn record(&mut self, event: CommandEvent, moment: Moment) {
        let Moment { show_time_ns, overruns } = moment;
        let (run_id, number) = (self.run_id, self.number);
        if event.event_kind() == Some(EventKind::Stop) && event.outcome().is_ok() {
            self.stop.get_or_insert(event);
        }
        let _ = self.waiting.push(CommandEvent { run_id, number, show_time_ns, overruns, wall_ns: unix_ns(), ..event });
        self.number += 1;
    }

    /// The first accepted stop of the run.
    pub(crate) fn stop(&self) -> Option<&CommandEvent> {
        self.stop.as_ref()
    }
}

impl CommandLog {
    /// Records an event of a recording. It keeps its times; run and number become those of this record.
    pub(crate) fn record_again(&mut self, event: CommandEvent) {
        let _ = self.waiting.push(CommandEvent { run_id: self.run_id, number: self.number, ..event });
        self.number += 1;
    }
}

/// Show time and missed periods of a run when it takes a command.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Moment {
    pub(crate) show_time_ns: i64,
    pub(crate) overruns: u64,
}

/// Command whose client waits for a reply.
#[cfg(feature = "zenoh")]
#[derive(Debug)]
pub(crate) struct AskedCommand(pub(super) ActiveRequest<Service, Command, (), CommandReply, ()>);

#[cfg(feature = "zenoh")]
impl AskedCommand {
    /// The request; `None` for a kind that this version does not recognise.
    pub(crate) fn request(&self) -> Option<Request> {
        Request::from_wire(self.0.payload())
    }

    /// Sends the reply. A client that has disconnected is not an error.
    pub(crate) fn answer(self, reply: CommandReply) {
        let _ = self.0.send_copy(reply);
    }
}
