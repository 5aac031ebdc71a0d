//! Commands to the server.

use core::mem::MaybeUninit;
use std::time::Duration;

use bench_dragon_ipc::{BusError, CommandReply, Request};

use crate::layout::same_layout;
use crate::result::{Failure, answer, bd_result_t};
use crate::show::{bd_show_t, opened};

/// Kind of a command to the server.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum bd_command_t {
    /// Stop walking until `BD_COMMAND_RESUME`.
    BD_COMMAND_PAUSE = 0,
    /// Walk on after `BD_COMMAND_PAUSE`.
    BD_COMMAND_RESUME = 1,
    /// Walk with a head speed of `value` metres per show second, 0 to 10.
    BD_COMMAND_SPEED = 2,
    /// Seek to the show time of `value` seconds.
    BD_COMMAND_SEEK = 3,
    /// Stop for safety. Only `BD_COMMAND_RELEASE` lifts the hold.
    BD_COMMAND_HOLD = 4,
    /// Lift a hold.
    BD_COMMAND_RELEASE = 5,
    /// End the server. The head comes to rest first, and the last frame has the state `BD_ENDED`.
    BD_COMMAND_STOP = 6,
}

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

/// Reason for which a server refuses a command. Later versions may add reasons.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum bd_refusal_t {
    /// The command was accepted.
    BD_ACCEPTED = 0,
    /// The server does not support this kind of command.
    BD_REFUSED_UNKNOWN = 1,
    /// The value is outside the range from `lowest` to `highest`, or NaN.
    BD_REFUSED_OUT_OF_RANGE = 2,
    /// The show is held. Only `BD_COMMAND_RELEASE` lifts the hold.
    BD_REFUSED_HELD = 3,
    /// There is no hold to release.
    BD_REFUSED_NOT_HELD = 4,
    /// The show is finished. A seek starts it again.
    BD_REFUSED_FINISHED = 5,
    /// The server accepts no grants, because it is not guarded.
    BD_REFUSED_NOT_GUARDED = 6,
    /// The guard has not yet proved that the benches are apart at the sought show time. Send the same seek again a little
    /// later.
    BD_REFUSED_NOT_PROVED = 7,
    /// The grant is for another run.
    BD_REFUSED_OTHER_RUN = 8,
    /// The guard holds the dragon. It walks on with the next grant; where the proven travel has ended, only a seek moves it.
    BD_REFUSED_HELD_BY_GUARD = 9,
    /// The source replays a recording, which commands cannot change.
    BD_REFUSED_REPLAYED = 10,
    /// The source is on another host, which does not answer.
    BD_REFUSED_UNREACHABLE = 11,
    /// The source is on another host, and its bridge accepts no commands.
    BD_REFUSED_NOT_TAKEN = 12,
    /// More commands at a time than a bridge forwards to another host.
    BD_REFUSED_TOO_MANY = 13,
    /// The show follows timecode, which determines the show time. The timecode would undo a seek immediately.
    BD_REFUSED_FOLLOWED = 14,
    /// The show waits at its start. Only a release starts it.
    BD_REFUSED_READY = 15,
}

/// Sends a command and waits for the reply at most `timeout_ns` nanoseconds. A reply takes about one tick of the server.
/// `command` is a `bd_command_t`. `value` is the speed in metres per show second or the show time in seconds; other
/// commands ignore it. `reply` may be NULL.
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
    use bd_command_t as Command;
    let requests = [
        (Command::BD_COMMAND_PAUSE, Request::Pause),
        (Command::BD_COMMAND_RESUME, Request::Resume),
        (Command::BD_COMMAND_SPEED, Request::Speed { speed_mps: value }),
        (Command::BD_COMMAND_SEEK, Request::Seek { sim_time_s: value }),
        (Command::BD_COMMAND_HOLD, Request::Hold),
        (Command::BD_COMMAND_RELEASE, Request::Release),
        (Command::BD_COMMAND_STOP, Request::Stop),
    ];
    let known = requests.into_iter().find(|&(known, _)| known as i32 == command);
    known.map(|(_, request)| request).ok_or_else(|| {
        let text = format!("command is {command}, must be {} to {}", 0, requests.len() - 1);
        Failure::new(bd_result_t::BD_INVALID_ARGUMENT, text)
    })
}

impl From<&CommandReply> for bd_reply_t {
    fn from(reply: &CommandReply) -> Self {
        let CommandReply { run_id, tick, lowest, highest, refusal, reserved } = *reply;
        Self { run_id, tick, lowest, highest, refusal, reserved }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_refusal_of_the_server_has_a_number_in_c() {
        let outcome = |refusal| CommandReply { refusal, ..CommandReply::default() }.outcome();
        let last = bd_refusal_t::BD_REFUSED_READY as u32;
        assert_ne!(outcome(last), Err(bench_dragon_ipc::Refusal::Unknown));
        assert_eq!(outcome(last + 1), Err(bench_dragon_ipc::Refusal::Unknown), "bd_refusal_t lacks this refusal");
    }
}
