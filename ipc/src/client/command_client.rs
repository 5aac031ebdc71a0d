//! The client that commands the server.

use core::time::Duration;
use std::time::Instant;

use iceoryx2::pending_response::PendingResponse;
use iceoryx2::port::client::Client;

use crate::domain::{BusError, Domain, SourceLock};
use crate::service::{COMMANDS, Member, Role, Service};
use crate::wire::{Command, CommandReply, Request, Sender};

/// Sends commands to the server of an instance.
#[derive(Debug)]
pub struct CommandClient {
    client: Client<Service, Command, (), CommandReply, ()>,
    sender: Sender,
    domain: Domain,
    _member: Member,
}

impl CommandClient {
    /// Opens the commands of a domain.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        let member = Member::join(domain, name, Role::Client)?;
        let client = member.command_client()?;
        member.reserve_memory()?;
        Ok(Self { client, sender: Sender::Client, domain: domain.clone(), _member: member })
    }

    /// Returns the same client. Its commands are recorded with this kind of sender.
    #[must_use]
    pub fn sending_as(self, sender: Sender) -> Self {
        Self { sender, ..self }
    }

    /// Sends one command and waits until the server has accepted it, at most `timeout`. Returns the server's reply.
    ///
    /// The server replies at the start of its next tick, so a reply takes about one period.
    ///
    /// # Errors
    /// [`BusError::Refused`] where the server refuses the command; else as [`CommandClient::ask`].
    pub fn call(&self, request: Request, timeout: Duration) -> Result<CommandReply, BusError> {
        accepted(request, self.ask(request, timeout)?)
    }

    /// Sends one command and returns its reply, also if the server has refused the command. Waits at most `timeout`.
    ///
    /// # Errors
    /// [`BusError::NoServer`] where no server runs, or where the server ended or was killed before it replied.
    /// [`BusError::NoAnswer`] where no reply arrived in time, else [`BusError::Failed`].
    pub fn ask(&self, request: Request, timeout: Duration) -> Result<CommandReply, BusError> {
        self.ask_unless(request, timeout, || false)
    }

    /// Does the same as [`CommandClient::ask`], but also stops waiting as soon as `is_given_up` returns `true`. The
    /// command may still be executed.
    ///
    /// # Errors
    /// As [`CommandClient::ask`].
    pub fn ask_unless(
        &self,
        request: Request,
        timeout: Duration,
        is_given_up: impl Fn() -> bool,
    ) -> Result<CommandReply, BusError> {
        let mut pending = self.send(request)?;
        let no_answer = || BusError::NoAnswer { instance: self.domain.instance().to_string(), waited: timeout };
        await_reply(timeout, is_given_up, || pending.poll())?.ok_or_else(no_answer)
    }

    /// Sends one command, without waiting for its reply.
    pub(crate) fn send(&self, request: Request) -> Result<PendingReply, BusError> {
        let command = Command { sender: self.sender.to_wire(), pid: std::process::id(), ..request.to_wire() };
        let pending = self.client.send_copy(command).map_err(|error| BusError::failed(COMMANDS, error))?;
        let pending = PendingReply { pending, domain: self.domain.clone(), polls: 0 };
        if pending.pending.number_of_server_connections() == 0 || !SourceLock::is_held(&self.domain) {
            return Err(pending.no_server());
        }
        Ok(pending)
    }
}

/// Returns the server's reply to an accepted request.
///
/// # Errors
/// [`BusError::Refused`] where the server has refused the request.
pub(crate) fn accepted(request: Request, reply: CommandReply) -> Result<CommandReply, BusError> {
    match reply.outcome() {
        Ok(_tick) => Ok(reply),
        Err(refusal) => Err(BusError::Refused { request, refusal, reply }),
    }
}

/// Polls for the reply to a command. `None` as soon as `timeout` has passed or `is_given_up` returns `true`.
pub(crate) fn await_reply(
    timeout: Duration,
    is_given_up: impl Fn() -> bool,
    mut poll: impl FnMut() -> Result<Option<CommandReply>, BusError>,
) -> Result<Option<CommandReply>, BusError> {
    let begun = Instant::now();
    loop {
        // Read before the reply is received.
        let is_late = begun.elapsed() >= timeout || is_given_up();
        let reply = poll()?;
        if reply.is_some() || is_late {
            return Ok(reply);
        }
        std::thread::sleep(POLL_PERIOD);
    }
}

/// The reply to a command, which has not arrived yet.
#[derive(Debug)]
pub(crate) struct PendingReply {
    pending: PendingResponse<Service, Command, (), CommandReply, ()>,
    domain: Domain,
    polls: u32,
}

impl PendingReply {
    /// Returns the reply, if it has arrived. Never waits. Call it every [`POLL_PERIOD`].
    pub(crate) fn poll(&mut self) -> Result<Option<CommandReply>, BusError> {
        self.polls = self.polls.wrapping_add(1);
        // Read before the reply is received: a server disconnects from a command as soon as it has replied. A killed
        // server stays connected, but no longer holds its lock.
        let is_dead = self.polls.is_multiple_of(POLLS_PER_LOOK) && !SourceLock::is_held(&self.domain);
        let is_gone = is_dead || !self.pending.is_connected();
        match self.pending.receive().map_err(|error| BusError::failed(COMMANDS, error))? {
            Some(reply) => Ok(Some(*reply.payload())),
            None if is_gone => Err(self.no_server()),
            None => Ok(None),
        }
    }

    fn no_server(&self) -> BusError {
        BusError::NoServer { instance: self.domain.instance().to_string() }
    }
}

/// Period in which a client looks for the reply to its command.
const POLL_PERIOD: Duration = Duration::from_micros(200);
/// Polls after which a client looks whether the server still lives: about 20 ms.
const POLLS_PER_LOOK: u32 = 100;
