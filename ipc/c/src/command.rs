//! Commanding the server.

use core::mem::MaybeUninit;
use std::time::Duration;

use bench_dragon_ipc::{CommandClient, CommandReply, Request};

use crate::dragon::bd_dragon_t;
use crate::layout::same_layout;
use crate::result::{Failure, answer, bd_result_t};

/// What the server is asked to do.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum bd_command_t {
    /// Stop walking until `BD_COMMAND_RESUME`.
    BD_COMMAND_PAUSE = 0,
    /// Go on after `BD_COMMAND_PAUSE`.
    BD_COMMAND_RESUME = 1,
    /// Walk at `value` metres per show second, 0 to 10.
    BD_COMMAND_SPEED = 2,
    /// Go to the show time of `value` seconds.
    BD_COMMAND_SEEK = 3,
    /// Stop for safety; only `BD_COMMAND_RELEASE` lifts it.
    BD_COMMAND_HOLD = 4,
    /// Lift a hold.
    BD_COMMAND_RELEASE = 5,
    /// End the server.
    BD_COMMAND_STOP = 6,
}

/// The server's answer.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct bd_reply_t {
    /// Run of the server that answers.
    pub run_id: u64,
    /// Tick from which an accepted command holds; the tick at which it was refused otherwise.
    pub tick: u64,
    /// Least value that a refused value may have.
    pub lowest: f64,
    /// Greatest value that a refused value may have.
    pub highest: f64,
    /// A `bd_refusal_t`.
    pub refusal: u32,
    /// Always 0.
    pub reserved: u32,
}

same_layout!(bd_reply_t, CommandReply { run_id, tick, lowest, highest, refusal, reserved });

/// Why a command was refused. More may follow.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum bd_refusal_t {
    /// It was accepted.
    BD_ACCEPTED = 0,
    /// The server does not know this kind of command.
    BD_REFUSED_UNKNOWN = 1,
    /// The value is not a number from `lowest` to `highest`.
    BD_REFUSED_OUT_OF_RANGE = 2,
    /// The show is held, and only `BD_COMMAND_RELEASE` lifts that.
    BD_REFUSED_HELD = 3,
    /// There is no hold to release.
    BD_REFUSED_NOT_HELD = 4,
    /// The show is over; a seek starts it again.
    BD_REFUSED_FINISHED = 5,
    /// The server takes no grants: it is not guarded.
    BD_REFUSED_NOT_GUARDED = 6,
    /// The guard has not proved yet that the benches are apart where the seek goes: ask again a little later.
    BD_REFUSED_NOT_PROVED = 7,
    /// The grant is for another run.
    BD_REFUSED_OTHER_RUN = 8,
    /// The guard holds the dragon, and only its next grant moves it on.
    BD_REFUSED_HELD_BY_GUARD = 9,
    /// The source replays a recording, which is as it is.
    BD_REFUSED_REPLAYED = 10,
    /// The source is on another host, which does not answer.
    BD_REFUSED_UNREACHABLE = 11,
    /// The source is on another host, whose bridge takes no commands.
    BD_REFUSED_NOT_TAKEN = 12,
    /// More commands at a time than a bridge to another host passes on.
    BD_REFUSED_TOO_MANY = 13,
    /// The show follows timecode, which says where it is: a seek would be undone at once.
    BD_REFUSED_FOLLOWED = 14,
}

/// Sends a command, a `bd_command_t`, and waits for the reply, at most `timeout_ns`: about one period of the server. `value`
/// is that of a speed or a seek, and not looked at otherwise. `reply` may be NULL.
///
/// `BD_REFUSED` where the server refuses it, with the reason in the reply and in `bd_last_error`; `BD_NO_SERVER` where no
/// server took it, or none answered in time: it may have been taken all the same.
#[unsafe(no_mangle)]
pub extern "C" fn bd_dragon_command(
    dragon: Option<&bd_dragon_t>,
    command: i32,
    value: f64,
    timeout_ns: u64,
    reply: Option<&mut MaybeUninit<bd_reply_t>>,
) -> bd_result_t {
    answer(|| {
        let dragon = dragon.ok_or_else(|| Failure::missing("dragon"))?;
        let request = request(command, value)?;
        let mut port = dragon.commands.lock();
        let client = dragon.origin.open(&mut port, CommandClient::open)?;
        let answered = client.call(request, Duration::from_nanos(timeout_ns))?;
        if let Some(reply) = reply {
            reply.write((&answered).into());
        }
        let refused =
            |refusal: bench_dragon_ipc::Refusal| Failure::new(bd_result_t::BD_REFUSED, refusal.explain(&request));
        answered.outcome().map(|_tick| Some(())).map_err(refused)
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
    fn every_reason_of_a_server_has_its_number_here() {
        let outcome = |refusal| CommandReply { refusal, ..CommandReply::default() }.outcome();
        let last = bd_refusal_t::BD_REFUSED_FOLLOWED as u32;
        assert_ne!(outcome(last), Err(bench_dragon_ipc::Refusal::Unknown));
        assert_eq!(outcome(last + 1), Err(bench_dragon_ipc::Refusal::Unknown), "a reason that C does not know");
    }
}
