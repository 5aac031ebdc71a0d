//! Forwards commands from other hosts to the server.
//!
//! The other host waits for an answer longer than [`COMMAND_TIMEOUT`], and then reports the command as unanswered. The server
//! must not execute such a command afterwards. So the forwarder refuses a command that is older than the timeout: a cut link
//! or a suspended process has delayed it.

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

/// Longest time from the sending of a command on the other host to the server's answer here. The other host waits longer.
const COMMAND_TIMEOUT: Duration = Duration::from_secs(2);
/// Longest wait for the first status. A healthy source publishes its status ten times a second.
const STATUS_TIMEOUT: Duration = Duration::from_millis(300);
const LOOK_PERIOD: Duration = Duration::from_millis(1);
/// Most statuses that are read at a time: one for each source.
const MAX_STATUSES: usize = 4;

#[derive(Debug)]
pub(super) struct CommandForwarder {
    domain: Domain,
    state: Arc<QueryState>,
    key: String,
    // Opened on the forwarder's own thread, because a port stays on the thread that opened it.
    connection: Option<ServerConnection>,
}

/// Ports of a forwarder to the server.
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
            return refuse(format!("the command is malformed, must have {COMMAND_BYTES} bytes"));
        };
        let seen = query.attachment().map(read_seen);
        if seen == Some(None) {
            return refuse(format!(
                "the command's attachment is malformed, must be a run and a tick, {SEEN_BYTES} bytes"
            ));
        }
        let reply = match Request::from_wire(&command) {
            _ if question.is_too_many => Err(Refusal::TooMany),
            None => Err(Refusal::Unknown),
            // A guard runs on the server's machine: its grants must reach the server even if the link is cut.
            Some(Request::Grant { .. }) => Err(Refusal::NotGuarded),
            Some(request) => self.call(request, seen.flatten(), question.asked_ns),
        };
        let reply = reply.unwrap_or_else(|refusal| CommandReply::refused(0, 0, refusal));
        query.reply(&self.key, reply.as_bytes()).encoding(REPLY_ENCODING).express(true).wait()
    }

    /// Sends a command to the server, unless the command is too old.
    fn call(&mut self, request: Request, seen: Option<Seen>, asked_ns: u64) -> Result<CommandReply, Refusal> {
        let age = if self.state.is_closed.load(Ordering::Relaxed) { None } else { self.age(seen) };
        let waited = Duration::from_nanos(monotonic_ns().saturating_sub(asked_ns));
        let Some(patience) = age.and_then(|age| COMMAND_TIMEOUT.checked_sub(age.max(waited))) else {
            self.state.refused.fetch_add(1, Ordering::Relaxed);
            return Err(Refusal::Unreachable);
        };
        self.state.commands.fetch_add(1, Ordering::Relaxed);
        let connection = self.connection.take().ok_or(Refusal::Unreachable)?;
        // After a failed call, the next command opens a new connection.
        let reply = connection.client.ask(request, patience).map_err(|_| Refusal::Unreachable)?;
        self.connection = Some(connection);
        Ok(reply)
    }

    /// Returns the time since a command was sent, computed from the ticks since then; `None` if it is unknown.
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

    /// Returns the newest status, which is at most a tenth of a second old if the server is healthy. Waits for the first status
    /// until a timeout.
    fn status(&mut self) -> Option<&Status> {
        let deadline = Instant::now() + STATUS_TIMEOUT;
        loop {
            // The port may hold a status of the current source and one of the previous source.
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

/// Returns the time since a run reached a tick; `None` if another run is current.
fn age(seen: Seen, status: &Status) -> Option<Duration> {
    // An unknown rate counts as 1 Hz, the lowest rate. This overestimates the age.
    let ticks = u128::from(status.tick.saturating_sub(seen.tick));
    let nanos = ticks * 1_000_000_000 / u128::from(status.rate_hz.max(1));
    (seen.run_id == status.run_id).then(|| Duration::from_nanos(nanos.try_into().unwrap_or(u64::MAX)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_age_of_a_command_is_the_time_of_the_ticks_since_it_was_sent() {
        let status = Status { run_id: 7, tick: 5_000, rate_hz: 1_000, ..Status::default() };
        let age_ms = |run_id, tick| age(Seen { run_id, tick }, &status).map(|age| age.as_millis());
        assert_eq!([age_ms(7, 5_000), age_ms(7, 4_900), age_ms(7, 0)], [Some(0), Some(100), Some(5_000)]);
        assert_eq!(age_ms(7, 5_090), Some(0), "the status is published ten times a second, frames more often");
        assert_eq!(age_ms(8, 5_000), None, "another run");
        let unknown = Status { rate_hz: 0, tick: u64::MAX, ..status };
        assert!(age(Seen { run_id: 7, tick: 0 }, &unknown) > Some(COMMAND_TIMEOUT));
    }
}
