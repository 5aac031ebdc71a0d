//! Commands to the server of an instance. [`call()`] sends one and waits for its reply. A [`CommandQueue`] is for whoever may
//! not wait, or sends many.
//!
//! A queue sends commands one at a time, in the order in which they are submitted. A hold overtakes them: at once, on a thread of its
//! own. Those that have not been sent by then are given up, and so is a seek that waits for its proof. One that is on its way
//! may reach the server after the hold and undo it; so the hold is sent once more when that one is answered, and its own answer is
//! that of the last time.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, SyncSender, TrySendError};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use bench_dragon_ipc::{BusError, CommandClient, CommandReply, Domain, GuardLock, Refusal, Request, Sender};

/// Commands that may wait for those before them, in either lane.
const ROOM: usize = 8;

/// Why a command has no reply.
#[derive(Debug, thiserror::Error)]
pub enum CommandQueueError {
    /// The bus's reason.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// It had not been sent yet when a hold came.
    #[error("a hold has come after it")]
    Overtaken,
    /// It had not been sent yet when the queue closed.
    #[error("nobody waits for it any more")]
    Closed,
    /// As many commands wait as there is room for.
    #[error("{ROOM} commands wait for the server already")]
    Crowded,
}

type Callback = Box<dyn FnOnce(Result<CommandReply, CommandQueueError>) + Send>;

/// Sends a command; the closure says whether the command is given up.
type SendCommand = dyn Fn(Request, &dyn Fn() -> bool) -> Result<CommandReply, BusError> + Send + Sync;

/// Sends commands in their order, and a hold past all others.
#[derive(Debug)]
pub struct CommandQueue {
    lanes: Arc<LaneState>,
    others: Lane,
    holds: Lane,
}

/// Commands that wait, and the thread that sends them, which ends with it.
#[derive(Debug)]
struct Lane {
    commands: Option<SyncSender<QueuedCommand>>,
    thread: Option<JoinHandle<()>>,
}

type QueuedCommand = (Unanswered, Callback);

/// A command that has not been answered.
#[derive(Clone, Copy, Debug)]
struct Unanswered {
    request: Request,
    number: u64,
    /// How many holds were given before it.
    holds_before: u64,
    /// Whether it waited for no other command when it was submitted: then closing the queue does not cancel it.
    is_first: bool,
    is_sent: bool,
}

/// What the two lanes have in common.
#[derive(Debug, Default)]
struct LaneState {
    /// Holds given so far.
    holds: AtomicU64,
    /// Whether nothing but holds is sent any more.
    is_closed: AtomicBool,
    /// Whether nobody waits for any reply any more.
    is_over: AtomicBool,
    /// Locked while a command is in flight.
    in_flight: Mutex<()>,
    /// Commands given so far.
    given: AtomicU64,
    unanswered: Mutex<Vec<Unanswered>>,
    answered: Condvar,
}

impl CommandQueue {
    /// A queue of an instance, which joins the bus under this node name, and commands as this kind of sender.
    ///
    /// # Errors
    /// The operating system's reason for having no more threads.
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

    /// Submits a command. `answer` is called once, on a thread of the queue's: at once where there is no room for the command, on the
    /// caller's.
    pub fn submit(
        &self,
        request: Request,
        answer: impl FnOnce(Result<CommandReply, CommandQueueError>) + Send + 'static,
    ) {
        let is_hold = request == Request::Hold;
        let holds_before = self.lanes.holds.fetch_add(u64::from(is_hold), Ordering::SeqCst);
        let command = self.lanes.begin(request, holds_before);
        let lane = if is_hold { &self.holds } else { &self.others };
        let commands = lane.commands.as_ref().expect("a lane is open for as long as the queue lasts");
        let sent = commands.try_send((command, Box::new(answer)));
        if let Err(TrySendError::Full((_, answer)) | TrySendError::Disconnected((_, answer))) = sent {
            answer(Err(CommandQueueError::Crowded));
            self.lanes.end(command);
        }
    }

    /// Gives up whatever has not been sent, but for holds. Then waits until of those commands that `is_waited_for` names all are
    /// answered, at most so long, and says which have been sent and are not.
    pub fn close(&self, patience: Duration, is_waited_for: impl Fn(Request) -> bool) -> Vec<Request> {
        self.lanes.is_closed.store(true, Ordering::SeqCst);
        let is_waiting = |unanswered: &mut Vec<Unanswered>| unanswered.iter().any(|one| is_waited_for(one.request));
        let waited = self.lanes.answered.wait_timeout_while(lock(&self.lanes.unanswered), patience, is_waiting);
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
        let (sender, commands) = mpsc::sync_channel(ROOM);
        let thread = thread::Builder::new().name(name.to_owned()).spawn(move || send_all(&commands, &*send, &lanes))?;
        Ok(Self { commands: Some(sender), thread: Some(thread) })
    }
}

impl Drop for Lane {
    fn drop(&mut self) {
        self.commands = None;
        // A panic has been reported already.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

impl LaneState {
    /// Why a command is not to be sent any more: a hold was given after it, or nobody waits for it.
    fn cancels(&self, command: Unanswered) -> Option<CommandQueueError> {
        let is_overtaken = self.holds.load(Ordering::SeqCst) > command.holds_before;
        let is_closed = self.is_closed.load(Ordering::SeqCst) && !command.is_first;
        is_overtaken.then_some(CommandQueueError::Overtaken).or(is_closed.then_some(CommandQueueError::Closed))
    }

    /// Notes a command as unanswered. One that waits for no other is under way.
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
                // At once; and again when the command in flight can no longer come after it.
                let first = send();
                let _alone = lock(&lanes.in_flight);
                // A server that is gone meanwhile has stopped too.
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

/// How long a server may take to answer: far more than a tick at the lowest rate.
const PATIENCE: Duration = Duration::from_secs(5);
/// The longest that a hold may take in a queue, where it is sent twice: a little more than that.
pub const HOLD_PATIENCE: Duration = Duration::from_secs(12);
/// How often a seek that is not proved yet is sent again.
const PROOF_PERIOD: Duration = Duration::from_millis(20);

/// Sends a command, under this node name and as this kind of sender, and waits for its reply. A seek that the server's guard has still to prove is sent
/// again until it is, or until it is given up; then it is refused. Where no guard runs, which could prove it, it is refused
/// at once.
///
/// Each call joins the bus anew: a client that stays would take a killed server for one that is slow.
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
        let reply = client.call_unless(request, PATIENCE, is_over)?;
        let may_be_proved = reply.outcome() == Err(Refusal::NotProved) && GuardLock::holder(domain).is_some();
        if !may_be_proved || began.elapsed() >= PATIENCE || is_given_up() {
            return Ok(reply);
        }
        thread::sleep(PROOF_PERIOD);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Sender, channel};

    use super::*;

    /// A server that takes each command when the test lets it.
    struct FakeServer {
        queue: CommandQueue,
        /// What has been sent, in order.
        sent: Receiver<Request>,
        /// Lets the next command that is no hold be answered.
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

    /// Gives a command, and what comes of it later.
    fn give(queue: &CommandQueue, request: Request) -> Receiver<Result<CommandReply, CommandQueueError>> {
        let (answer, answered) = channel();
        queue.submit(request, move |outcome| answer.send(outcome).expect("the test listens"));
        answered
    }

    #[test]
    fn commands_are_sent_one_at_a_time_in_their_order() {
        let FakeServer { queue, sent, go_on } = fake_server();
        let answers = [Request::Pause, Request::Resume, Request::Release].map(|request| give(&queue, request));
        for request in [Request::Pause, Request::Resume, Request::Release] {
            assert_eq!(sent.recv(), Ok(request));
            assert!(sent.try_recv().is_err(), "the next one waits for the answer of this one");
            go_on.send(()).expect("it waits");
        }
        assert!(answers.iter().all(|answer| answer.recv().expect("an answer").is_ok()));
    }

    #[test]
    fn a_hold_is_sent_at_once_and_again_after_the_command_in_flight_and_cancels_what_waits() {
        let FakeServer { queue, sent, go_on } = fake_server();
        let release = give(&queue, Request::Release);
        assert_eq!(sent.recv(), Ok(Request::Release));
        let resume = give(&queue, Request::Resume);
        let hold = give(&queue, Request::Hold);
        assert_eq!(sent.recv(), Ok(Request::Hold));
        assert!(hold.try_recv().is_err(), "the release may still come after it");
        go_on.send(()).expect("the release waits");
        assert_eq!(release.recv().expect("an answer").expect("a reply").run_id, 1, "it was given up");
        assert!(matches!(resume.recv(), Ok(Err(CommandQueueError::Overtaken))));
        assert_eq!(sent.recv(), Ok(Request::Hold));
        assert!(matches!(hold.recv(), Ok(Ok(_))));
        assert_eq!(queue.close(Duration::from_mins(1), |_| true), []);
        assert!(sent.try_recv().is_err());
    }

    #[test]
    fn what_is_given_after_a_hold_is_sent_after_it() {
        let FakeServer { queue, sent, go_on } = fake_server();
        give(&queue, Request::Hold).recv().expect("an answer").expect("a reply");
        let release = give(&queue, Request::Release);
        go_on.send(()).expect("it waits");
        assert_eq!(release.recv().expect("an answer").expect("a reply").run_id, 0);
        assert_eq!([sent.recv(), sent.recv()], [Ok(Request::Hold), Ok(Request::Release)]);
    }

    #[test]
    fn more_commands_than_there_is_room_for_are_refused_and_a_hold_has_room_of_its_own() {
        let FakeServer { queue, sent, go_on } = fake_server();
        let first = give(&queue, Request::Pause);
        assert_eq!(sent.recv(), Ok(Request::Pause));
        let waiting: Vec<_> = (0..ROOM).map(|_| give(&queue, Request::Resume)).collect();
        assert!(matches!(give(&queue, Request::Resume).recv(), Ok(Err(CommandQueueError::Crowded))));
        let hold = give(&queue, Request::Hold);
        go_on.send(()).expect("the first one waits");
        assert!(first.recv().expect("an answer").is_ok() && hold.recv().expect("an answer").is_ok());
        assert!(waiting.iter().all(|answer| matches!(answer.recv(), Ok(Err(CommandQueueError::Overtaken)))));
    }

    #[test]
    fn a_queue_that_closes_waits_for_its_holds_and_gives_up_the_rest() {
        let FakeServer { queue, sent, go_on } = fake_server();
        let pause = give(&queue, Request::Pause);
        assert_eq!(sent.recv(), Ok(Request::Pause));
        let hold = give(&queue, Request::Hold);
        let release = give(&queue, Request::Release);
        let is_hold = |request| request == Request::Hold;
        assert_eq!(sent.recv(), Ok(Request::Hold));
        assert_eq!(queue.close(Duration::ZERO, is_hold), [Request::Hold], "it has no answer before that of the pause");
        assert_eq!(queue.close(Duration::ZERO, |_| true), [Request::Pause, Request::Hold]);
        go_on.send(()).expect("the pause waits");
        assert_eq!(queue.close(Duration::from_mins(1), |_| true), []);
        assert!(pause.recv().expect("an answer").is_ok() && hold.recv().expect("an answer").is_ok());
        assert!(matches!(release.recv(), Ok(Err(CommandQueueError::Closed))));
    }
}
