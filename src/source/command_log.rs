//! Record of commands: a queue of events from the loop to the thread that publishes them.

#[cfg(feature = "zenoh")]
use bench_dragon_ipc::service::Service;
use bench_dragon_ipc::{Command, CommandEvent, CommandReply, EventKind, Refusal, Request};
#[cfg(feature = "zenoh")]
use iceoryx2::active_request::ActiveRequest;
use rtrb::{Consumer, Producer, RingBuffer};

/// Greatest number of events that wait to be published: more than a flood of commands produces between two reports.
const MOST_WAITING: usize = 1024;

/// The loop's end of the record. Recording neither waits nor allocates.
#[derive(Debug)]
pub struct CommandLog {
    waiting: Producer<CommandEvent>,
    /// Reads the Unix time in nanoseconds.
    wall_ns: fn() -> i64,
    run_id: u64,
    number: u64,
    /// The first accepted stop.
    stop: Option<CommandEvent>,
}

impl CommandLog {
    /// Creates the empty record of a run, whose events get their Unix time in nanoseconds from `wall_ns`. Returns it with the end
    /// that the publishing thread reads.
    pub fn new(run_id: u64, wall_ns: fn() -> i64) -> (Self, Consumer<CommandEvent>) {
        let (waiting, to_publish) = RingBuffer::new(MOST_WAITING);
        (Self { waiting, wall_ns, run_id, number: 0, stop: None }, to_publish)
    }

    /// Records an event at a show time, with the number of periods missed so far. A full queue drops the event.
    /// Readers detect this by the gap in the event numbers.
    pub fn record(&mut self, event: CommandEvent, moment: Moment) {
        let Moment { show_time_ns, overruns } = moment;
        let (run_id, number, wall_ns) = (self.run_id, self.number, (self.wall_ns)());
        if event.event_kind() == Some(EventKind::Stop) && event.outcome().is_ok() {
            self.stop.get_or_insert(event);
        }
        let _ = self.waiting.push(CommandEvent { run_id, number, show_time_ns, overruns, wall_ns, ..event });
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
pub struct Moment {
    /// Show time in nanoseconds.
    pub show_time_ns: i64,
    /// Periods missed so far.
    pub overruns: u64,
}

/// Answers a command in a run: its reply, and its event for the record. `decide` returns the speed along the course that the head walks
/// at from now on, if nothing stops it.
pub fn answer_command(
    command: &Command,
    run_id: u64,
    tick: u64,
    decide: impl FnMut(Request) -> Result<f64, Refusal>,
) -> (CommandReply, CommandEvent) {
    let outcome = Request::from_wire(command).ok_or(Refusal::Unknown).and_then(decide);
    let reply = match outcome {
        Ok(_) => CommandReply::accepted(run_id, tick),
        Err(refusal) => CommandReply::refused(run_id, tick, refusal),
    };
    let event = CommandEvent::answered(command, &reply);
    (reply, outcome.map_or(event, |course_mps| event.ordering(course_mps)))
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
