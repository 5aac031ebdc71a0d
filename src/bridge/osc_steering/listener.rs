//! The listener: a thread that reads a socket, submits commands, and sends replies and the state.

use std::fmt;
use std::io;
use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use bench_dragon_ipc::{Domain, Request, Sender};
use serde::Serialize;

use super::admission::{AllowedNetworks, Secret};
use super::message::{Incoming, Malformed, Rules, read};
use super::reply::{Reply, encode_cue, encode_state};
use super::state::{ShowReport, StateReceivers};
use crate::bridge::LatestFrame;
use crate::bridge::rate_limit::RateLimit;
use crate::command_queue::{CommandQueue, CommandQueueError, HOLD_PATIENCE, Outcome};
use crate::config::{MAX_CUES, PlannedCue, PlannedCues};
use crate::system::clock::monotonic_ns;

/// Greatest length of a packet. A longer one is malformed.
const MAX_PACKET_BYTES: usize = 2048;
/// Longest wait for a packet: the state is sent, and the end of the program noticed, at least this often.
const LOOK_PERIOD: Duration = Duration::from_millis(20);
/// Longest time that a send blocks while the system's send buffer is full.
const SEND_TIMEOUT: Duration = Duration::from_millis(5);
/// Limit of packets: per second, and burst. Beyond it, the listener pauses, and the kernel drops packets. A stranger's packet costs
/// two microseconds, so a flood of them takes a tenth of a processor.
const PACKET_RATE: (u64, u64) = (50_000, 5_000);
/// The pause. The kernel stores some 270 packets meanwhile.
const PAUSE: Duration = Duration::from_millis(1);
/// Limit of reported answers: per second, and burst.
const ANSWER_RATE: (u64, u64) = (10, 50);
/// Shortest time between two reports of refused messages.
const REFUSED_PERIOD_NS: u64 = 10_000_000_000;

/// Settings of a listener.
#[derive(Clone, Debug)]
pub struct SteeringSettings {
    /// Address to listen on.
    pub listen: SocketAddr,
    /// Networks from which commands are accepted.
    pub allowed: AllowedNetworks,
    /// The first argument of each message.
    pub secret: Option<Secret>,
    /// Whether `release`, `seek`, `cue` and `stop` are accepted.
    pub is_full: bool,
    /// The port of the sender's machine to which replies and the state are sent; `None`: the port from which it sends.
    pub reply_port: Option<u16>,
    /// Further receivers of the state.
    pub state_to: Vec<SocketAddr>,
}

/// Why a message of a stranger is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Refused {
    /// The address is in no allowed network.
    NotAllowed,
    /// The secret is missing or wrong.
    WrongSecret,
}

impl fmt::Display for Refused {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::NotAllowed => "not in --allow",
            Self::WrongSecret => "the secret is missing or wrong",
        })
    }
}

/// An event for the operator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SteeringEvent {
    /// A command has been answered.
    Answered {
        /// The sender.
        from: SocketAddr,
        /// Name of the command.
        command: String,
        /// The tick from which it holds, or the reason of the refusal.
        outcome: Result<u64, String>,
    },
    /// Messages have been refused since the last such event.
    Refused {
        /// The sender of the last one.
        from: IpAddr,
        /// Why the last one was refused.
        why: Refused,
        /// Number of messages of all senders.
        messages: u64,
    },
}

/// Totals of a listener.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SteeringCounts {
    /// Commands that the server accepted.
    pub accepted: u64,
    /// Messages and commands that were answered with a reason.
    pub refused: u64,
    /// Values of faders that a newer value replaced before they were sent.
    pub replaced: u64,
    /// Messages of strangers: from other addresses, or without the secret.
    pub strangers: u64,
    /// Packets that are no Open Sound Control, or too long.
    pub malformed: u64,
    /// Number of times that packets came too fast, so that the listener paused.
    pub floods: u64,
}

/// A running listener. Dropping it ends its thread, after the replies to its holds.
#[derive(Debug)]
pub struct SteeringListener {
    /// Address that it listens on.
    pub listen: SocketAddr,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl SteeringListener {
    /// Binds the socket and starts to listen. `report` is called on threads of the listener.
    ///
    /// # Errors
    /// The operating system's error if it cannot bind the socket or start a thread.
    pub fn start(
        settings: SteeringSettings,
        domain: Domain,
        report: impl Fn(SteeringEvent) + Send + Sync + 'static,
    ) -> io::Result<Self> {
        let SteeringSettings { listen, allowed, secret, is_full, reply_port, state_to } = settings;
        let socket = UdpSocket::bind(listen)?;
        socket.set_read_timeout(Some(LOOK_PERIOD))?;
        socket.set_write_timeout(Some(SEND_TIMEOUT))?;
        socket.set_broadcast(true)?;
        let listen = socket.local_addr()?;
        let queue = CommandQueue::open(domain, "bridge-osc-command", Sender::Osc)?;
        let shared = Arc::new(Shared {
            socket,
            reply_port,
            show: Mutex::new(ShowReport::NONE),
            cues: Mutex::default(),
            counts: Counts::default(),
            answer_limit: Mutex::new(RateLimit::new(ANSWER_RATE.0, ANSWER_RATE.1)),
            report: Box::new(report),
            is_over: AtomicBool::new(false),
        });
        let listening = Listening {
            shared: Arc::clone(&shared),
            queue,
            allowed,
            rules: Rules { secret, is_full },
            receivers: StateReceivers::new(state_to),
            faders: Vec::new(),
            strangers: Strangers::default(),
        };
        let thread = thread::Builder::new().name("osc-steering".to_owned()).spawn(move || listening.run())?;
        Ok(Self { listen, shared, thread: Some(thread) })
    }

    /// Takes the state of the show from the newest frame, its cues, and those that it has just reached.
    pub fn note(&self, latest: &LatestFrame, planned: &Arc<PlannedCues>, reached: &[PlannedCue]) {
        *lock(&self.shared.show) = ShowReport::of(latest);
        let mut cues = lock(&self.shared.cues);
        cues.planned = Arc::clone(planned);
        cues.messages.extend(reached.iter().take(MAX_CUES).map(encode_cue));
    }

    /// Stops listening, waits for the replies to holds, and returns the totals.
    pub fn finish(mut self) -> SteeringCounts {
        self.end();
        self.shared.counts.totals()
    }

    fn end(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        // The panic of the thread has already been reported.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

impl Drop for SteeringListener {
    fn drop(&mut self) {
        self.end();
    }
}

/// What the listener shares with the threads of its queue, which answer commands.
struct Shared {
    socket: UdpSocket,
    reply_port: Option<u16>,
    show: Mutex<ShowReport>,
    cues: Mutex<Cues>,
    counts: Counts,
    answer_limit: Mutex<RateLimit>,
    report: Box<dyn Fn(SteeringEvent) + Send + Sync>,
    is_over: AtomicBool,
}

/// The cues of the show, and messages about those that it has reached, which are to be sent.
#[derive(Default)]
struct Cues {
    planned: Arc<PlannedCues>,
    messages: Vec<Vec<u8>>,
}

impl fmt::Debug for Shared {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Shared").finish_non_exhaustive()
    }
}

#[derive(Debug, Default)]
struct Counts {
    accepted: AtomicU64,
    refused: AtomicU64,
    replaced: AtomicU64,
    strangers: AtomicU64,
    malformed: AtomicU64,
    floods: AtomicU64,
}

impl Counts {
    fn totals(&self) -> SteeringCounts {
        let Self { accepted, refused, replaced, strangers, malformed, floods } = self;
        let [accepted, refused, replaced, strangers, malformed, floods] =
            [accepted, refused, replaced, strangers, malformed, floods].map(|count| count.load(Ordering::Relaxed));
        SteeringCounts { accepted, refused, replaced, strangers, malformed, floods }
    }
}

fn count(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}

/// Ignores a poisoned lock: the values are consistent even after a panic.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    /// Answers a command or a message, to the operator too.
    fn answer(&self, from: SocketAddr, command: &str, outcome: Result<u64, String>) {
        count(if outcome.is_ok() { &self.counts.accepted } else { &self.counts.refused });
        let reply = Reply { command, outcome: outcome.as_ref().map(|tick| *tick).map_err(String::as_str) };
        self.send(&reply.encode(), self.receiver(from));
        if lock(&self.answer_limit).allows(monotonic_ns()) {
            (self.report)(SteeringEvent::Answered { from: canonical(from), command: command.to_owned(), outcome });
        }
    }

    /// The address to which replies to a sender are sent.
    fn receiver(&self, from: SocketAddr) -> SocketAddr {
        SocketAddr::new(from.ip(), self.reply_port.unwrap_or(from.port()))
    }

    /// Sends a packet. A desk that does not listen is no error: it sends all the same.
    fn send(&self, packet: &[u8], to: SocketAddr) {
        let _ = self.socket.send_to(packet, to);
    }
}

/// An address as people know it: IPv4 also where the socket has both.
fn canonical(address: SocketAddr) -> SocketAddr {
    SocketAddr::new(address.ip().to_canonical(), address.port())
}

/// The outcome of a command for its sender.
fn outcome_of(outcome: Outcome, request: Request) -> Result<u64, String> {
    match outcome {
        Ok(reply) => reply.outcome().map_err(|refusal| refusal.explain(&request)),
        Err(error) => Err(error.to_string()),
    }
}

struct Listening {
    shared: Arc<Shared>,
    queue: CommandQueue,
    allowed: AllowedNetworks,
    rules: Rules,
    receivers: StateReceivers,
    faders: Vec<Fader>,
    strangers: Strangers,
}

/// A command of which a fader sends many values. One value at a time is in the queue.
struct Fader {
    command: &'static str,
    is_in_queue: Arc<AtomicBool>,
    /// The newest value that has not been submitted, and its sender.
    waiting: Option<(Request, SocketAddr)>,
}

impl Listening {
    fn run(mut self) {
        let mut packet = [0; MAX_PACKET_BYTES + 1];
        let mut limit = RateLimit::new(PACKET_RATE.0, PACKET_RATE.1);
        while !self.shared.is_over.load(Ordering::Relaxed) {
            self.send_state();
            self.submit_faders();
            self.report_strangers();
            // An error is the read timeout, or an ICMP error from some host. Both are ignored.
            let Ok((length, from)) = self.shared.socket.recv_from(&mut packet) else { continue };
            if !limit.allows(monotonic_ns()) {
                count(&self.shared.counts.floods);
                thread::sleep(PAUSE);
            }
            self.take(&packet[..length], from);
        }
        self.queue.close(HOLD_PATIENCE, |request| request == Request::Hold);
        let show = lock(&self.shared.show).silent();
        *lock(&self.shared.show) = show;
        self.send_state();
    }

    /// Reads a packet, and submits its commands. The address is checked before anything else.
    fn take(&mut self, packet: &[u8], from: SocketAddr) {
        if !self.allowed.contain(from.ip()) {
            return self.refuse(from, Refused::NotAllowed);
        }
        let read = if packet.len() > MAX_PACKET_BYTES { Err(Malformed) } else { read(packet, &self.rules) };
        let Ok(messages) = read else { return count(&self.shared.counts.malformed) };
        for message in messages {
            if message == Incoming::NoSecret {
                self.refuse(from, Refused::WrongSecret);
                continue;
            }
            self.receivers.note(self.shared.receiver(from), monotonic_ns());
            match message {
                Incoming::Command { name, request, is_fader: false } => self.submit(name, request, from, || {}),
                Incoming::Command { name, request, is_fader: true } => self.note_fader(name, request, from),
                Incoming::Invalid { name, reason } => self.shared.answer(from, &name, Err(reason)),
                Incoming::Cue { name } => self.seek_cue(&name, from),
                Incoming::State => {
                    let state = encode_state(&lock(&self.shared.show));
                    self.shared.send(&state, self.shared.receiver(from));
                }
                Incoming::NoSecret => unreachable!("refused above"),
            }
        }
    }

    /// Submits a command. A hold also cancels the values of faders that wait here.
    fn submit(
        &mut self,
        name: &'static str,
        request: Request,
        from: SocketAddr,
        answered: impl FnOnce() + Send + 'static,
    ) {
        if request == Request::Hold {
            for fader in &mut self.faders {
                if let Some((_, sender)) = fader.waiting.take() {
                    self.shared.answer(sender, fader.command, Err(CommandQueueError::Overtaken.to_string()));
                }
            }
        }
        let shared = Arc::clone(&self.shared);
        self.queue.submit(request, move |outcome| {
            answered();
            shared.answer(from, name, outcome_of(outcome, request));
        });
    }

    fn seek_cue(&mut self, name: &str, from: SocketAddr) {
        let planned = Arc::clone(&lock(&self.shared.cues).planned);
        match planned.named(name) {
            Some(cue) => self.submit("cue", Request::Seek { show_time_s: cue.at_s }, from, || {}),
            None => self.shared.answer(from, "cue", Err(format!("no such cue, {}", planned.allowed_names()))),
        }
    }

    fn note_fader(&mut self, command: &'static str, request: Request, from: SocketAddr) {
        let known = self.faders.iter().position(|fader| fader.command == command);
        let index = known.unwrap_or_else(|| {
            self.faders.push(Fader { command, is_in_queue: Arc::default(), waiting: None });
            self.faders.len() - 1
        });
        if self.faders[index].waiting.replace((request, from)).is_some() {
            count(&self.shared.counts.replaced);
        }
        self.submit_faders();
    }

    /// Submits the newest value of each fader whose last value has been answered.
    fn submit_faders(&mut self) {
        for index in 0..self.faders.len() {
            let fader = &mut self.faders[index];
            if fader.is_in_queue.load(Ordering::Acquire) {
                continue;
            }
            let Some((request, from)) = fader.waiting.take() else { continue };
            fader.is_in_queue.store(true, Ordering::Relaxed);
            let (command, is_in_queue) = (fader.command, Arc::clone(&fader.is_in_queue));
            self.submit(command, request, from, move || is_in_queue.store(false, Ordering::Release));
        }
    }

    fn send_state(&mut self) {
        let now_ns = monotonic_ns();
        for message in std::mem::take(&mut lock(&self.shared.cues).messages) {
            self.receivers.present(now_ns).for_each(|receiver| self.shared.send(&message, receiver));
        }
        let show = *lock(&self.shared.show);
        let receivers = self.receivers.due(&show, now_ns);
        if !receivers.is_empty() {
            let state = encode_state(&show);
            for receiver in receivers {
                self.shared.send(&state, receiver);
            }
        }
    }

    /// Counts a message of a stranger, which gets no answer.
    fn refuse(&mut self, from: SocketAddr, why: Refused) {
        count(&self.shared.counts.strangers);
        self.strangers.messages += 1;
        self.strangers.last = Some((from.ip().to_canonical(), why));
        self.report_strangers();
    }

    /// Reports the strangers since the last report, if that is long ago.
    fn report_strangers(&mut self) {
        if let Some(event) = self.strangers.due(monotonic_ns()) {
            (self.shared.report)(event);
        }
    }
}

/// Messages of strangers that have not been reported.
#[derive(Debug, Default)]
struct Strangers {
    messages: u64,
    last: Option<(IpAddr, Refused)>,
    reported_ns: Option<u64>,
}

impl Strangers {
    fn due(&mut self, now_ns: u64) -> Option<SteeringEvent> {
        let (from, why) = self.last?;
        if self.reported_ns.is_some_and(|reported_ns| now_ns.saturating_sub(reported_ns) < REFUSED_PERIOD_NS) {
            return None;
        }
        *self = Self { messages: self.messages, last: None, reported_ns: Some(now_ns) };
        Some(SteeringEvent::Refused { from, why, messages: std::mem::take(&mut self.messages) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strangers_are_reported_at_once_and_then_every_ten_seconds() {
        let from = IpAddr::from([10, 0, 0, 66]);
        let mut strangers = Strangers::default();
        let mut note = |messages, now_ns| {
            strangers.messages += messages;
            strangers.last = Some((from, Refused::NotAllowed));
            strangers.due(now_ns)
        };
        let report = |messages| Some(SteeringEvent::Refused { from, why: Refused::NotAllowed, messages });
        assert_eq!(note(1, 5), report(1));
        assert_eq!([note(1, 6), note(3, 7)], [None, None]);
        assert_eq!(note(1, 5 + REFUSED_PERIOD_NS), report(5));
        assert_eq!(strangers.due(u64::MAX), None, "none has come since");
    }
}
