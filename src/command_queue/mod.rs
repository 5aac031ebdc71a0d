//! Commands to the server of an instance. [`call()`] sends one and waits for its reply. A [`CommandQueue`] is for
//! callers that must not wait, or that send many commands.
//!
//! A queue sends commands one at a time, in the order of their submission. A hold overtakes them. [`CommandOrder`] decides
//! which command is sent next; each of its two lanes has a thread, which sends and waits for the reply.

use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use bench_dragon_ipc::guard::GuardLock;
use bench_dragon_ipc::{BusError, CommandClient, CommandReply, Domain, Refusal, Request, Sender};

mod order;

pub use order::{CommandOrder, LaneKind, NextStep, Outcome};

/// Greatest number of waiting commands in each lane.
pub const MAX_WAITING: usize = 8;

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

type Callback = Box<dyn FnOnce(Outcome) + Send>;

/// Sends a command. The first closure returns whether the command has been cancelled, the second whether no one waits for its
/// reply.
type SendCommand =
    dyn Fn(Request, &dyn Fn() -> bool, &dyn Fn() -> bool) -> Result<CommandReply, BusError> + Send + Sync;

/// Sends commands in their order; holds overtake all others.
#[derive(Debug)]
pub struct CommandQueue {
    shared: Arc<SharedOrder>,
    lanes: Vec<JoinHandle<()>>,
}

/// The order that both lanes share.
#[derive(Default)]
struct SharedOrder {
    state: Mutex<QueueState>,
    /// A command has been submitted, replied to or answered, or the queue has been dropped.
    changed: Condvar,
}

#[derive(Default)]
struct QueueState {
    order: CommandOrder<Callback>,
    /// Whether the queue has been dropped. Then no caller waits for a reply.
    is_over: bool,
}

impl CommandQueue {
    /// Opens a queue of an instance. It joins the bus under the node name `name`. Its commands name `sender` as their
    /// origin.
    ///
    /// # Errors
    /// The operating system cannot start a thread.
    pub fn open(domain: Domain, name: &'static str, sender: Sender) -> io::Result<Self> {
        let send = move |request, is_given_up: &dyn Fn() -> bool, is_over: &dyn Fn() -> bool| {
            call(&domain, name, sender, request, is_given_up, is_over)
        };
        Self::sending(&(Arc::new(send) as Arc<SendCommand>))
    }

    fn sending(send: &Arc<SendCommand>) -> io::Result<Self> {
        let mut queue = Self { shared: Arc::default(), lanes: Vec::new() };
        for (name, lane) in [("commands", LaneKind::Others), ("holds", LaneKind::Holds)] {
            let (send, shared) = (Arc::clone(send), Arc::clone(&queue.shared));
            let thread = thread::Builder::new().name(name.to_owned());
            queue.lanes.push(thread.spawn(move || shared.work(lane, &*send))?);
        }
        Ok(queue)
    }

    /// Submits a command. The queue calls `answer` once, on one of its threads. If the queue is full, it calls `answer`
    /// at once on the caller's thread.
    pub fn submit(&self, request: Request, answer: impl FnOnce(Outcome) + Send + 'static) {
        let (number, refused) = self.shared.lock().order.submit(request, Box::new(answer));
        self.shared.changed.notify_all();
        if let Some(answer) = refused {
            self.shared.answer(number, answer, Err(CommandQueueError::Crowded));
        }
    }

    /// Cancels all unsent commands except holds. Then waits for the replies of the commands that `is_waited_for`
    /// selects, for `timeout` at most. Returns those of them that have been sent and have no reply.
    pub fn close(&self, timeout: Duration, is_waited_for: impl Fn(Request) -> bool) -> Vec<Request> {
        let mut state = self.shared.lock();
        state.order.close();
        self.shared.changed.notify_all();
        let is_waiting = |state: &mut QueueState| state.order.unanswered().iter().any(|one| is_waited_for(one.request));
        let waited = self.shared.changed.wait_timeout_while(state, timeout, is_waiting);
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let left = state.order.unanswered().iter();
        left.filter(|one| one.is_sent && is_waited_for(one.request)).map(|one| one.request).collect()
    }
}

impl Drop for CommandQueue {
    fn drop(&mut self) {
        let mut state = self.shared.lock();
        state.order.close();
        state.is_over = true;
        drop(state);
        self.shared.changed.notify_all();
        for lane in self.lanes.drain(..) {
            // The panic of the thread has already been reported.
            let _ = lane.join();
        }
    }
}

impl std::fmt::Debug for SharedOrder {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("SharedOrder").finish_non_exhaustive()
    }
}

impl SharedOrder {
    fn lock(&self) -> MutexGuard<'_, QueueState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Carries out the steps of a lane until the queue has been dropped and the lane is empty.
    fn work(&self, lane: LaneKind, send: &SendCommand) {
        let mut state = self.lock();
        loop {
            match state.order.next(lane) {
                NextStep::Send(request) => {
                    drop(state);
                    let is_given_up = || lane == LaneKind::Others && self.lock().order.is_given_up();
                    let reply = send(request, &is_given_up, &|| self.lock().is_over).map_err(CommandQueueError::Bus);
                    let answered = self.lock().order.take_reply(lane, reply);
                    self.changed.notify_all();
                    if let Some((number, answer, outcome)) = answered {
                        self.answer(number, answer, outcome);
                    }
                    state = self.lock();
                }
                NextStep::Answer(number, answer, error) => {
                    drop(state);
                    self.answer(number, answer, Err(error));
                    state = self.lock();
                }
                NextStep::Wait if state.is_over && state.order.is_idle(lane) => return,
                NextStep::Wait => state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner),
            }
        }
    }

    fn answer(&self, number: u64, answer: Callback, outcome: Outcome) {
        answer(outcome);
        self.lock().order.forget(number);
        self.changed.notify_all();
    }
}

/// Time that a server may take for its reply: far more than a tick at the lowest rate.
pub const REPLY_TIMEOUT: Duration = Duration::from_secs(5);
/// Time that a hold may take in a queue, where it is sent twice: slightly more than two replies.
pub const HOLD_PATIENCE: Duration = Duration::from_secs(12);
/// Period at which a seek without a proof is sent again.
pub const PROOF_PERIOD: Duration = Duration::from_millis(20);

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
        let has_guard = || GuardLock::holder(domain).is_some();
        if !is_sent_again(&reply, began.elapsed(), has_guard) || is_given_up() {
            return Ok(reply);
        }
        thread::sleep(PROOF_PERIOD);
    }
}

/// Whether a command with this reply is sent again after [`PROOF_PERIOD`]: a guard may still prove its target. `elapsed` is the
/// time since it was sent first.
pub fn is_sent_again(reply: &CommandReply, elapsed: Duration, has_guard: impl FnOnce() -> bool) -> bool {
    reply.outcome() == Err(Refusal::NotProved) && has_guard() && elapsed < REPLY_TIMEOUT
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Receiver, Sender, channel};

    use super::*;

    fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
        mutex.lock().unwrap_or_else(PoisonError::into_inner)
    }

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
        let send = move |request: Request, is_given_up: &dyn Fn() -> bool, _: &dyn Fn() -> bool| {
            lock(&sending).send(request).expect("the test listens");
            if request != Request::Hold {
                lock(&gate).recv().expect("the test answers");
            }
            Ok(CommandReply::accepted(u64::from(is_given_up()), 0))
        };
        FakeServer {
            queue: CommandQueue::sending(&(Arc::new(send) as Arc<SendCommand>)).expect("two threads"),
            sent,
            go_on,
        }
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
