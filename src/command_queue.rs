//! Commands to the server of an instance. [`call()`] sends one and waits for its reply. A [`CommandQueue`] is for
//! callers that must not wait, or that send many commands.
//!
//! A queue sends commands one at a time, in the order of their submission. A hold overtakes them: a separate thread
//! sends it at once. It cancels all unsent commands, and a seek that waits for its proof. A command in flight may reach
//! the server after the hold and undo it. So the hold is sent again after that command's reply, and the second reply is
//! the hold's outcome.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, SyncSender, TrySendError};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use bench_dragon_ipc::guard::GuardLock;
use bench_dragon_ipc::{BusError, CommandClient, CommandReply, Domain, Refusal, Request, Sender};

/// Greatest number of waiting commands in each lane.
const MAX_WAITING: usize = 8;

/// Reason why a command has no reply.
#[derive(Debug, thiserror::Error)]
pub enum CommandQueueError {
    /// Error of the bus.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// A later hold cancelled the command before it was sent.
    #[error("a later hold cancelled it")]
    Overtaken,
    /// The queue closed before the command was sent.
    #[error("this program is ending")]
    Closed,
    /// The queue is full.
    #[error("{MAX_WAITING} commands already wait for the server; try again later")]
    Crowded,
}

type Callback = Box<dyn FnOnce(Result<CommandReply, CommandQueueError>) + Send>;

/// Sends a command. The closure returns whether the command has been cancelled.
type SendCommand = dyn Fn(Request, &dyn Fn() -> bool) -> Result<CommandReply, BusError> + Send + Sync;

/// Sends commands in their order; holds overtake all others.
#[derive(Debug)]
pub struct CommandQueue {
    lanes: Arc<LaneState>,
    others: Lane,
    holds: Lane,
}

/// Waiting commands and the thread that sends them. Dropping the lane ends the thread.
#[derive(Debug)]
struct Lane {
    commands: Option<SyncSender<QueuedCommand>>,
    thread: Option<JoinHandle<()>>,
}

type QueuedCommand = (Unanswered, Callback);

/// A command without a reply.
#[derive(Clone, Copy, Debug)]
struct Unanswered {
    request: Request,
    number: u64,
    /// Number of holds submitted before the command.
    holds_before: u64,
    /// Whether no other command waited when this one was submitted. Then closing the queue does not cancel it.
    is_first: bool,
    is_sent: bool,
}

/// State that both lanes share.
#[derive(Debug, Default)]
struct LaneState {
    /// Number of holds submitted so far.
    holds: AtomicU64,
    /// Whether the queue has closed. Then it sends only holds and commands with `is_first`.
    is_closed: AtomicBool,
    /// Whether the queue has been dropped. Then no caller waits for a reply.
    is_over: AtomicBool,
    /// Locked while a command is in flight.
    in_flight: Mutex<()>,
    /// Number of commands submitted so far.
    given: AtomicU64,
    unanswered: Mutex<Vec<Unanswered>>,
    answered: Condvar,
}

impl CommandQueue {
    /// Opens a queue of an instance. It joins the bus under the node name `name`. Its commands name `sender` as their
    /// origin.
    ///
    /// # Errors
    /// The operating system cannot start a thread.
    pub fn open(domain: Domain, name: &'static str, sender: Sender) -> io::Result<Self> {
        let lanes = Arc::new(LaneState::default());
        let state = Arc::clone(&lanes);
        let is_over = move || state.is_over.load(Ordering::SeqCst);
        let send =
            move |request, is_given_up: &dyn Fn() -> bool| call(&domain, name, sender, request, is_given_up, &is_over);
        Self::sending(lanes, Arc::new(send))
    }

    fn sending(lanes: Arc<LaneState>, send: Arc<SendCommand>) -> io::Result<Self> {
        Ok(Self {
            others: Lane::start("commands", Arc::clone(&send), Arc::clone(&lanes), send_others)?,
            holds: Lane::start("holds", send, Arc::clone(&lanes), send_holds)?,
            lanes,
        })
    }

    /// Submits a command. The queue calls `answer` once, on one of its threads. If the queue is full, it calls `answer`
    /// at once on the caller's thread.
    pub fn submit(
        &self,
        request: Request,
        answer: impl FnOnce(Result<CommandReply, CommandQueueError>) + Send + 'static,
    ) {
        let is_hold = request == Request::Hold;
        let holds_before = self.lanes.holds.fetch_add(u64::from(is_hold), Ordering::SeqCst);
        let command = self.lanes.begin(request, holds_before);
        let lane = if is_hold { &self.holds } else { &self.others };
        let commands = lane.commands.as_ref().expect("a lane is open until the queue is dropped");
        let sent = commands.try_send((command, Box::new(answer)));
        if let Err(TrySendError::Full((_, answer)) | TrySendError::Disconnected((_, answer))) = sent {
            answer(Err(CommandQueueError::Crowded));
            self.lanes.end(command);
        }
    }

    /// Cancels all unsent commands except holds. Then waits for the replies of the commands that `is_waited_for`
    /// selects, for `timeout` at most. Returns those of them that have been sent and have no reply.
    pub fn close(&self, timeout: Duration, is_waited_for: impl Fn(Request) -> bool) -> Vec<Request> {
        self.lanes.is_closed.store(true, Ordering::SeqCst);
        let is_waiting = |unanswered: &mut Vec<Unanswered>| unanswered.iter().any(|one| is_waited_for(one.request));
        let waited = self.lanes.answered.wait_timeout_while(lock(&self.lanes.unanswered), timeout, is_waiting);
        let (left, _) = waited.unwrap_or_else(PoisonError::into_inner);
        left.iter().filter(|one| one.is_sent && is_waited_for(one.request)).map(|one| one.request).collect()
    }
}

impl Drop for CommandQueue {
    fn drop(&mut self) {
        self.lanes.is_closed.store(true, Ordering::SeqCst);
        self.lanes.is_over.store(true, Ordering::SeqCst);
    }
}

impl Lane {
    fn start(
        name: &str,
        send: Arc<SendCommand>,
        lanes: Arc<LaneState>,
        send_all: fn(&Receiver<QueuedCommand>, &SendCommand, &LaneState),
    ) -> io::Result<Self> {
        let (sender, commands) = mpsc::sync_channel(MAX_WAITING);
        let thread = thread::Builder::new().name(name.to_owned()).spawn(move || send_all(&commands, &*send, &lanes))?;
        Ok(Self { commands: Some(sender), thread: Some(thread) })
    }
}

impl Drop for Lane {
    fn drop(&mut self) {
        self.commands = None;
        // The panic of the thread has already been reported.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

impl LaneState {
    /// Returns why a command must not be sent: a later hold has cancelled it, or the queue has closed.
    fn cancels(&self, command: Unanswered) -> Option<CommandQueueError> {
        let is_overtaken = self.holds.load(Ordering::SeqCst) > command.holds_before;
        let is_closed = self.is_closed.load(Ordering::SeqCst) && !command.is_first;
        is_overtaken.then_some(CommandQueueError::Overtaken).or(is_closed.then_some(CommandQueueError::Closed))
    }

    /// Registers a command without a reply. It counts as sent if all other commands without a reply are holds.
    fn begin(&self, request: Request, holds_before: u64) -> Unanswered {
        let number = self.given.fetch_add(1, Ordering::Relaxed);
        let mut unanswered = lock(&self.unanswered);
        let is_first = unanswered.iter().all(|one| one.request == Request::Hold);
        let command = Unanswered { request, number, holds_before, is_first, is_sent: is_first };
        unanswered.push(command);
        command
    }

    fn note_sent(&self, command: Unanswered) {
        let mut unanswered = lock(&self.unanswered);
        unanswered.iter_mut().filter(|one| one.number == command.number).for_each(|one| one.is_sent = true);
    }

    fn end(&self, command: Unanswered) {
        lock(&self.unanswered).retain(|one| one.number != command.number);
        self.answered.notify_all();
    }
}

fn send_others(commands: &Receiver<QueuedCommand>, send: &SendCommand, lanes: &LaneState) {
    for (command, answer) in commands {
        let in_flight = lock(&lanes.in_flight);
        let outcome = if let Some(error) = lanes.cancels(command) {
            Err(error)
        } else {
            lanes.note_sent(command);
            let is_cancelled = || lanes.cancels(Unanswered { is_first: false, ..command }).is_some();
            send(command.request, &is_cancelled).map_err(CommandQueueError::Bus)
        };
        drop(in_flight);
        answer(outcome);
        lanes.end(command);
    }
}

fn send_holds(commands: &Receiver<QueuedCommand>, send: &SendCommand, lanes: &LaneState) {
    for (command, answer) in commands {
        lanes.note_sent(command);
        let send = || send(command.request, &|| false);
        let outcome = match lanes.in_flight.try_lock() {
            Ok(_) | Err(TryLockError::Poisoned(_)) => send(),
            Err(TryLockError::WouldBlock) => {
                // The hold is sent at once, and again when the command in flight can no longer follow it.
                let first = send();
                let _alone = lock(&lanes.in_flight);
                // A server that has ended since then has stopped too, so the first reply counts.
                send().or(first)
            }
        };
        answer(outcome.map_err(CommandQueueError::Bus));
        lanes.end(command);
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Time that a server may take for its reply: far more than a tick at the lowest rate.
const REPLY_TIMEOUT: Duration = Duration::from_secs(5);
/// Time that a hold may take in a queue, where it is sent twice: slightly more than two replies.
pub const HOLD_PATIENCE: Duration = Duration::from_secs(12);
/// Period at which a seek without a proof is sent again.
const PROOF_PERIOD: Duration = Duration::from_millis(20);

/// Sends a command under the node name `name`, as this kind of sender, and waits for its reply.
///
/// A guard may have to prove a seek first. Then the seek is sent again until it is accepted, `is_given_up` returns
/// true, or 5 s have passed. If no guard runs, the server refuses the seek at once.
///
/// Each call joins the bus anew. A client that stays connected could not distinguish a killed server from a slow one.
///
/// # Errors
/// As [`CommandClient::open`] and [`CommandClient::call`].
pub fn call(
    domain: &Domain,
    name: &str,
    sender: Sender,
    request: Request,
    is_given_up: &dyn Fn() -> bool,
    is_over: &dyn Fn() -> bool,
) -> Result<CommandReply, BusError> {
    let client = CommandClient::open(domain, name)?.sending_as(sender);
    let began = Instant::now();
    loop {
        let reply = client.ask_unless(request, REPLY_TIMEOUT, is_over)?;
        let may_be_proved = reply.outcome() == Err(Refusal::NotProved) && GuardLock::holder(domain).is_some();
        if !may_be_proved || began.elapsed() >= REPLY_TIMEOUT || is_given_up() {
            return Ok(reply);
        }
        thread::sleep(PROOF_PERIOD);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Sender, channel};

    use super::*;

    /// A server that accepts each command when the test allows it.
    struct FakeServer {
        queue: CommandQueue,
        /// The commands sent, in order.
        sent: Receiver<Request>,
        /// Allows the reply to the next command other than a hold.
        go_on: Sender<()>,
    }

    fn fake_server() -> FakeServer {
        let (sending, sent) = channel();
        let (go_on, gate) = channel::<()>();
        let (sending, gate) = (Mutex::new(sending), Mutex::new(gate));
        let send = move |request: Request, is_given_up: &dyn Fn() -> bool| {
            lock(&sending).send(request).expect("the test listens");
            if request != Request::Hold {
                lock(&gate).recv().expect("the test answers");
            }
            Ok(CommandReply::accepted(u64::from(is_given_up()), 0))
        };
        FakeServer { queue: CommandQueue::sending(Arc::default(), Arc::new(send)).expect("two threads"), sent, go_on }
    }

    /// Submits a command. Returns a channel for its outcome.
    fn submit(queue: &CommandQueue, request: Request) -> Receiver<Result<CommandReply, CommandQueueError>> {
        let (answer, answered) = channel();
        queue.submit(request, move |outcome| answer.send(outcome).expect("the test listens"));
        answered
    }

    #[test]
    fn commands_are_sent_one_at_a_time_in_their_order() {
        let FakeServer { queue, sent, go_on } = fake_server();
        let answers = [Request::Pause, Request::Resume, Request::Release].map(|request| submit(&queue, request));
        for request in [Request::Pause, Request::Resume, Request::Release] {
            assert_eq!(sent.recv(), Ok(request));
            assert!(sent.try_recv().is_err(), "the next command waits for this reply");
            go_on.send(()).expect("the command waits");
        }
        assert!(answers.iter().all(|answer| answer.recv().expect("an answer").is_ok()));
    }

    #[test]
    fn a_hold_is_sent_at_once_and_again_after_the_command_in_flight_and_cancels_waiting_commands() {
        let FakeServer { queue, sent, go_on } = fake_server();
        let release = submit(&queue, Request::Release);
        assert_eq!(sent.recv(), Ok(Request::Release));
        let resume = submit(&queue, Request::Resume);
        let hold = submit(&queue, Request::Hold);
        assert_eq!(sent.recv(), Ok(Request::Hold));
        assert!(hold.try_recv().is_err(), "the release may still follow the hold");
        go_on.send(()).expect("the release waits");
        assert_eq!(release.recv().expect("an answer").expect("a reply").run_id, 1, "the release was cancelled");
        assert!(matches!(resume.recv(), Ok(Err(CommandQueueError::Overtaken))));
        assert_eq!(sent.recv(), Ok(Request::Hold));
        assert!(matches!(hold.recv(), Ok(Ok(_))));
        assert_eq!(queue.close(Duration::from_mins(1), |_| true), []);
        assert!(sent.try_recv().is_err());
    }

    #[test]
    fn a_command_submitted_after_a_hold_is_sent_after_it() {
        let FakeServer { queue, sent, go_on } = fake_server();
        submit(&queue, Request::Hold).recv().expect("an answer").expect("a reply");
        let release = submit(&queue, Request::Release);
        go_on.send(()).expect("the release waits");
        assert_eq!(release.recv().expect("an answer").expect("a reply").run_id, 0);
        assert_eq!([sent.recv(), sent.recv()], [Ok(Request::Hold), Ok(Request::Release)]);
    }

    #[test]
    fn a_full_queue_rejects_commands_but_accepts_a_hold() {
        let FakeServer { queue, sent, go_on } = fake_server();
        let first = submit(&queue, Request::Pause);
        assert_eq!(sent.recv(), Ok(Request::Pause));
        let waiting: Vec<_> = (0..MAX_WAITING).map(|_| submit(&queue, Request::Resume)).collect();
        assert!(matches!(submit(&queue, Request::Resume).recv(), Ok(Err(CommandQueueError::Crowded))));
        let hold = submit(&queue, Request::Hold);
        go_on.send(()).expect("the pause waits");
        assert!(first.recv().expect("an answer").is_ok() && hold.recv().expect("an answer").is_ok());
        assert!(waiting.iter().all(|answer| matches!(answer.recv(), Ok(Err(CommandQueueError::Overtaken)))));
    }

    #[test]
    fn a_closing_queue_waits_for_its_holds_and_cancels_the_rest() {
        let FakeServer { queue, sent, go_on } = fake_server();
        let pause = submit(&queue, Request::Pause);
        assert_eq!(sent.recv(), Ok(Request::Pause));
        let hold = submit(&queue, Request::Hold);
        let release = submit(&queue, Request::Release);
        let is_hold = |request| request == Request::Hold;
        assert_eq!(sent.recv(), Ok(Request::Hold));
        assert_eq!(queue.close(Duration::ZERO, is_hold), [Request::Hold], "the hold waits for the reply to the pause");
        assert_eq!(queue.close(Duration::ZERO, |_| true), [Request::Pause, Request::Hold]);
        go_on.send(()).expect("the pause waits");
        assert_eq!(queue.close(Duration::from_mins(1), |_| true), []);
        assert!(pause.recv().expect("an answer").is_ok() && hold.recv().expect("an answer").is_ok());
        assert!(matches!(release.recv(), Ok(Err(CommandQueueError::Closed))));
    }
}
