//! Commands of the other side, on their last way to the server.
//!
//! A command that was reported as refused must not be carried out: whoever asked waits for [`PATIENCE`] and a little more, and a
//! command that comes later is held up on its way or here, by a cut or a process that stood. It is refused.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::{Duration, Instant};

use bench_dragon_ipc::{
    BusError, CommandClient, CommandReply, Domain, IntoBytes as _, Refusal, Request, Sender, Status, StatusReader,
};
use zenoh::Wait as _;
use zenoh::bytes::ZBytes;

use super::query_server::{QueryState, Question};
use super::wire::{COMMAND_BYTES, REPLY_ENCODING, SEEN_BYTES, Seen, decode_seen, read};
use crate::system::clock::monotonic_ns;

/// How long a command may take from whoever asks to the server and its answer back to here: less than the other side waits.
const PATIENCE: Duration = Duration::from_secs(2);
/// How long the first status may take: a source that is well sends one to whoever has come ten times a second.
const STATUS_PATIENCE: Duration = Duration::from_millis(300);
const LOOK_PERIOD: Duration = Duration::from_millis(1);
/// Statuses that are read at a time: one a source.
const MAX_STATUSES: usize = 4;

#[derive(Debug)]
pub(super) struct CommandForwarder {
    domain: Domain,
    state: Arc<QueryState>,
    key: String,
    // Ports stay on the thread that they were made on.
    connection: Option<ServerConnection>,
}

/// What a forwarder has open to the server.
#[derive(Debug)]
struct ServerConnection {
    client: CommandClient,
    reader: StatusReader,
    status: Option<Status>,
}

impl CommandForwarder {
    pub(super) fn new(domain: Domain, state: Arc<QueryState>, key: String) -> Self {
        Self { domain, state, key, connection: None }
    }

    pub(super) fn pass_on(&mut self, question: &Question) -> zenoh::Result<()> {
        let query = &question.query;
        let refuse = |reason: String| {
            self.state.refused.fetch_add(1, Ordering::Relaxed);
            query.reply_err(reason).wait()
        };
        let payload = query.payload().filter(|payload| payload.len() == COMMAND_BYTES);
        let Some(command) = payload.and_then(|payload| read(&payload.to_bytes())) else {
            return refuse(format!("a command has {COMMAND_BYTES} bytes"));
        };
        let seen = query.attachment().map(read_seen);
        if seen == Some(None) {
            return refuse(format!("what is attached to a command has {SEEN_BYTES} bytes"));
        }
        let reply = match Request::from_wire(&command) {
            _ if question.is_too_many => Err(Refusal::TooMany),
            None => Err(Refusal::Unknown),
            // A guard stands where the server is: what it grants has to reach it, whatever happens to the link.
            Some(Request::Grant { .. }) => Err(Refusal::NotGuarded),
            Some(request) => self.call(request, seen.flatten(), question.asked_ns),
        };
        let reply = reply.unwrap_or_else(|refusal| CommandReply::refused(0, 0, refusal));
        query.reply(&self.key, reply.as_bytes()).encoding(REPLY_ENCODING).express(true).wait()
    }

    /// Sends a command to the server, unless it comes too late.
    fn call(&mut self, request: Request, seen: Option<Seen>, asked_ns: u64) -> Result<CommandReply, Refusal> {
        let age = if self.state.is_closed.load(Ordering::Relaxed) { None } else { self.age(seen) };
        let waited = Duration::from_nanos(monotonic_ns().saturating_sub(asked_ns));
        let Some(patience) = age.and_then(|age| PATIENCE.checked_sub(age.max(waited))) else {
            self.state.refused.fetch_add(1, Ordering::Relaxed);
            return Err(Refusal::Unreachable);
        };
        self.state.commands.fetch_add(1, Ordering::Relaxed);
        let connection = self.connection.take().ok_or(Refusal::Unreachable)?;
        // Where it fails, the next command opens another connection.
        let reply = connection.client.call(request, patience).map_err(|_| Refusal::Unreachable)?;
        self.connection = Some(connection);
        Ok(reply)
    }

    /// How long ago a command was sent, by the ticks that have passed since; `None` where that is unknown.
    fn age(&mut self, seen: Option<Seen>) -> Option<Duration> {
        if self.connection.is_none() {
            self.connection = ServerConnection::open(&self.domain).ok();
        }
        let connection = self.connection.as_mut()?;
        let Some(seen) = seen else { return Some(Duration::ZERO) };
        age(seen, connection.status()?)
    }
}

impl ServerConnection {
    fn open(domain: &Domain) -> Result<Self, BusError> {
        Ok(Self {
            client: CommandClient::open(domain, "bridge-commands")?.sending_as(Sender::Zenoh),
            reader: StatusReader::open(domain, "bridge-commands")?,
            status: None,
        })
    }

    /// The newest status: a tenth of a second old where the server is well. The first one is waited for, but not for long.
    fn status(&mut self) -> Option<&Status> {
        let deadline = Instant::now() + STATUS_PATIENCE;
        loop {
            // One of the source there is, and one that the last one has left.
            for _ in 0..MAX_STATUSES {
                let Ok(Some(status)) = self.reader.poll() else { break };
                self.status = Some(status);
            }
            if self.status.is_some() || Instant::now() >= deadline {
                return self.status.as_ref();
            }
            thread::sleep(LOOK_PERIOD);
        }
    }
}

fn read_seen(attached: &ZBytes) -> Option<Seen> {
    (attached.len() == SEEN_BYTES).then(|| decode_seen(&attached.to_bytes())).flatten()
}

/// How long ago a run was at a tick; `None` where another run is on.
fn age(seen: Seen, status: &Status) -> Option<Duration> {
    // Where the rate is not known, each tick counts as much as it can.
    let ticks = u128::from(status.tick.saturating_sub(seen.tick));
    let nanos = ticks * 1_000_000_000 / u128::from(status.rate_hz.max(1));
    (seen.run_id == status.run_id).then(|| Duration::from_nanos(nanos.try_into().unwrap_or(u64::MAX)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_seen_of_a_run_is_as_old_as_the_ticks_since() {
        let status = Status { run_id: 7, tick: 5_000, rate_hz: 1_000, ..Status::default() };
        let age_ms = |run_id, tick| age(Seen { run_id, tick }, &status).map(|age| age.as_millis());
        assert_eq!([age_ms(7, 5_000), age_ms(7, 4_900), age_ms(7, 0)], [Some(0), Some(100), Some(5_000)]);
        assert_eq!(age_ms(7, 5_090), Some(0), "the status comes ten times a second, frames more often");
        assert_eq!(age_ms(8, 5_000), None, "another run");
        let unknown = Status { rate_hz: 0, tick: u64::MAX, ..status };
        assert!(age(Seen { run_id: 7, tick: 0 }, &unknown) > Some(PATIENCE));
    }
}
