//! Events of commands: what the server was asked for, by whom, and whether it did it.

use core::mem::MaybeUninit;
use std::time::Duration;

use bench_dragon_ipc::CommandEvent;

use crate::layout::same_layout;
use crate::result::{Failure, answer, bd_result_t};
use crate::show::{bd_show_t, opened};

/// `kind` of an event for a command that the source does not support.
pub const BD_EVENT_UNKNOWN: u32 = 0xFFFF_FFFF;

const _: () = assert!(BD_EVENT_UNKNOWN == CommandEvent::UNKNOWN_KIND);

/// One event: a command and its outcome, or the start or the end of the run. 120 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct bd_command_event_t {
    /// Run of the source.
    pub run_id: u64,
    /// Number of the event in its run, from 0, without a gap. A jump means that this reader lost events.
    pub number: u64,
    /// Tick from which an accepted command holds; for a refused command, the tick at which it was refused.
    pub tick: u64,
    /// Show time of the event, at the start of its tick, in nanoseconds.
    pub show_time_ns: i64,
    /// Wall-clock time of the event: nanoseconds since 1970-01-01 00:00 UTC.
    pub wall_ns: i64,
    /// Number of periods that the run missed before this tick.
    pub overruns: u64,
    /// Values of the command in their order; 0 for unused ones. For a start: show time in seconds, travel in metres, speed in
    /// metres per show second, and the show time at which the run ends, or NaN.
    pub values: [f64; 4],
    /// Least allowed value, after `BD_REFUSED_OUT_OF_RANGE`; else 0.
    pub lowest: f64,
    /// Greatest allowed value, after `BD_REFUSED_OUT_OF_RANGE`; else 0.
    pub highest: f64,
    /// A `bd_event_kind_t`, or `BD_EVENT_UNKNOWN`.
    pub kind: u32,
    /// A `bd_sender_t`.
    pub sender: u32,
    /// Process id of the sender; 0 if unknown.
    pub pid: u32,
    /// A `bd_refusal_t`.
    pub refusal: u32,
    /// Bits. For a grant, 1: it is final. For a start, 1: held, 2: paused, 4: guarded, 8: follows timecode, 16: ready, 32:
    /// restarted, 64: stays at its end. Else 0.
    pub flags: u32,
    /// Always 0.
    pub reserved: u32,
}

same_layout!(
    bd_command_event_t,
    CommandEvent {
        run_id,
        number,
        tick,
        show_time_ns,
        wall_ns,
        overruns,
        values,
        lowest,
        highest,
        kind,
        sender,
        pid,
        refusal,
        flags,
        reserved
    }
);

/// Returns the oldest unread event of a command in `event`. Waits for one at most `timeout_ns` nanoseconds; 0 does not wait. A
/// server publishes events ten times a second.
///
/// The first call also receives up to 128 earlier events of the run.
///
/// `BD_NOTHING` if no event arrived in time. `BD_NO_SERVER` if the first call found no server. On error `event` is unchanged.
#[unsafe(no_mangle)]
pub extern "C" fn bd_show_command_event(
    show: *const bd_show_t,
    timeout_ns: u64,
    event: Option<&mut MaybeUninit<bd_command_event_t>>,
) -> bd_result_t {
    answer(|| {
        let event = event.ok_or_else(|| Failure::missing("event"))?;
        let received = opened(show)?.command_event(Duration::from_nanos(timeout_ns))?;
        Ok(received.map(|received| {
            event.write((&received).into());
        }))
    })
}

impl From<&CommandEvent> for bd_command_event_t {
    fn from(event: &CommandEvent) -> Self {
        Self {
            run_id: event.run_id,
            number: event.number,
            tick: event.tick,
            show_time_ns: event.show_time_ns,
            wall_ns: event.wall_ns,
            overruns: event.overruns,
            values: event.values,
            lowest: event.lowest,
            highest: event.highest,
            kind: event.kind,
            sender: event.sender,
            pid: event.pid,
            refusal: event.refusal,
            flags: event.flags,
            reserved: event.reserved,
        }
    }
}
