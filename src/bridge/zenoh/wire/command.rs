//! Commands and their replies.

use bench_dragon_ipc::{Command, CommandReply};

use super::WireError;
use super::fields::{Fields, concatenated, pair_of, run_id};

/// Encoding of commands, see [`encode_command`].
pub const COMMAND_ENCODING: &str = "application/octet-stream;bench_dragon.Command.v3";
/// Encoding of replies, see [`encode_reply`].
pub const REPLY_ENCODING: &str = "application/octet-stream;bench_dragon.CommandReply.v1";
/// Bytes of a command.
pub const COMMAND_BYTES: usize = size_of::<Command>();
/// Bytes of a reply.
pub const REPLY_BYTES: usize = size_of::<CommandReply>();

/// Bytes of what is attached to a command.
pub const SEEN_BYTES: usize = 16;

/// What whoever commands has seen of the show: attached to a command, as two little-endian `u64`. By it the other side tells
/// one that was held up on its way, and which must not be carried out any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// The run.
    pub run_id: u64,
    /// The tick that it has come to.
    pub tick: u64,
}

/// What is attached to a command, as bytes.
pub fn encode_seen(seen: Seen) -> [u8; SEEN_BYTES] {
    concatenated([seen.run_id, seen.tick])
}

/// Reads what is attached to a command.
///
/// # Errors
/// [`WireError::Length`], [`WireError::RunId`].
pub fn decode_seen(bytes: &[u8]) -> Result<Seen, WireError> {
    let mut fields = Fields::of(bytes, SEEN_BYTES)?;
    let seen = Seen { run_id: fields.word(), tick: fields.word() };
    run_id(seen.run_id)?;
    Ok(seen)
}

/// A command as bytes, in the order of its fields.
pub fn encode_command(command: &Command) -> [u8; COMMAND_BYTES] {
    let [first, second] = command.values.map(f64::to_bits);
    let (kind, pid) = (pair_of(command.kind, command.sender), pair_of(command.pid, command.flags));
    concatenated([kind, command.run_id, first, second, pid])
}

/// Reads a command. Its kind and values are the server's to judge.
///
/// # Errors
/// [`WireError::Length`].
pub fn decode_command(bytes: &[u8]) -> Result<Command, WireError> {
    let mut fields = Fields::of(bytes, COMMAND_BYTES)?;
    let (kind, sender, run_id, values) = (fields.half(), fields.half(), fields.word(), fields.doubles());
    Ok(Command { kind, sender, run_id, values, pid: fields.half(), flags: fields.half() })
}

/// A reply as bytes, in the order of its fields.
pub fn encode_reply(reply: &CommandReply) -> [u8; REPLY_BYTES] {
    let words = [
        reply.run_id,
        reply.tick,
        reply.lowest.to_bits(),
        reply.highest.to_bits(),
        pair_of(reply.refusal, reply.reserved),
    ];
    concatenated(words)
}

/// Reads a reply. A reason that this version does not know is one all the same.
///
/// # Errors
/// [`WireError::Length`], [`WireError::RunId`].
pub fn decode_reply(bytes: &[u8]) -> Result<CommandReply, WireError> {
    let mut fields = Fields::of(bytes, REPLY_BYTES)?;
    let reply = CommandReply {
        run_id: fields.word(),
        tick: fields.word(),
        lowest: fields.double(),
        highest: fields.double(),
        refusal: fields.half(),
        reserved: fields.half(),
    };
    run_id(reply.run_id)?;
    Ok(reply)
}
