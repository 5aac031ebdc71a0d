//! Commands to the server.

use core::mem::MaybeUninit;
use std::time::Duration;

use bench_dragon_ipc::{BusError, Command, CommandReply, EventKind, Request};

use crate::layout::same_layout;
use crate::result::{Failure, answer, bd_result_t};
use crate::show::{bd_show_t, opened};

/// The server's reply to a command. 40 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct bd_reply_t {
    /// Run of the server that replies.
    pub run_id: u64,
    /// Tick from which an accepted command holds; for a refused command, the tick at which it was refused.
    pub tick: u64,
    /// Least allowed value, after `BD_REFUSED_OUT_OF_RANGE`; else 0.
    pub lowest: f64,
    /// Greatest allowed value, after `BD_REFUSED_OUT_OF_RANGE`; else 0.
    pub highest: f64,
    /// A `bd_refusal_t`.
    pub refusal: u32,
    /// Always 0.
    pub reserved: u32,
}

same_layout!(bd_reply_t, CommandReply { run_id, tick, lowest, highest, refusal, reserved });

/// Sends a command and waits for the reply at most `timeout_ns` nanoseconds. A reply takes about one tick of the server.
/// `command` is a `bd_command_t`. `value` is the speed in metres per show second, the show time in seconds or the
/// pace; other commands ignore it. `reply` may be NULL.
///
/// `BD_REFUSED` if the server refuses the command: the reply and `bd_last_error` have the reason. `BD_NO_SERVER` if no
/// server is connected, or none replied in time. After such a timeout the server may have executed the command
/// nevertheless. `BD_INVALID_ARGUMENT` if `command` is not a `bd_command_t`.
#[unsafe(no_mangle)]
pub extern "C" fn bd_show_command(
    show: *const bd_show_t,
    command: i32,
    value: f64,
    timeout_ns: u64,
    reply: Option<&mut MaybeUninit<bd_reply_t>>,
) -> bd_result_t {
    answer(|| {
        let show = opened(show)?;
        let request = request(command, value)?;
        let outcome = show.call(request, Duration::from_nanos(timeout_ns));
        let answered = match &outcome {
            Ok(answered) | Err(BusError::Refused { reply: answered, .. }) => Some(answered),
            Err(_) => None,
        };
        if let (Some(reply), Some(answered)) = (reply, answered) {
            reply.write(answered.into());
        }
        outcome?;
        Ok(Some(()))
    })
}

fn request(command: i32, value: f64) -> Result<Request, Failure> {
    let kinds = EventKind::OF_CLIENTS.map(EventKind::to_wire);
    let kind = u32::try_from(command).ok().filter(|kind| kinds.contains(kind));
    let wire = kind.map(|kind| Command { kind, values: [value, 0.0], ..Command::default() });
    wire.and_then(|wire| Request::from_wire(&wire)).ok_or_else(|| {
        let text = format!("command is {command}, must be a bd_command_t");
        Failure::new(bd_result_t::BD_INVALID_ARGUMENT, text)
    })
}

impl From<&CommandReply> for bd_reply_t {
    fn from(reply: &CommandReply) -> Self {
        let CommandReply { run_id, tick, lowest, highest, refusal, reserved } = *reply;
        Self { run_id, tick, lowest, highest, refusal, reserved }
    }
}
