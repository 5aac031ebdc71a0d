//! The record of a run's commands: from the loop, which takes them, to the thread that publishes their events.

use bench_dragon_ipc::CommandEvent;
use rtrb::{Consumer, Producer, RingBuffer};

use crate::system::clock::unix_ns;

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
