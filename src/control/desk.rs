//! Commands of somebody who does not wait for their replies.
//!
//! They are sent one at a time, in the order in which they are given. A hold goes past all others: at once, on a thread of its
//! own. Those that have not been sent by then are given up, and so is a seek that waits for its proof. One that is on its way
//! may reach the server after the hold and undo it; so the hold is sent once more when that one is answered, and its own answer is
//! that of the last time.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, SyncSender, TrySendError};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread;
use std::time::Duration;

use bench_dragon_ipc::{BusError, CommandReply, Domain, Request, Sender};

use super::call::call;

/// Commands that may wait for those before them, in either lane.
const ROOM: usize = 8;

/// Why a command has no reply.
#[derive(Debug, thiserror::Error)]
pub enum DeskError {
    /// The bus's reason.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// It had not been sent yet when a hold came.
    #[error("a hold has come after it")]
    Overtaken,
    /// It had not been sent yet when the desk closed.
    #[error("nobody waits for it any more")]
    Closed,
    /// As many commands wait as there is room for.
    #[error("{ROOM} commands wait for the server already")]
    Crowded,
}

type Answer = Box<dyn FnOnce(Result<CommandReply, DeskError>) + Send>;

/// What a command is sent by: it is told, too, how to find out whether the command is given up.
type Courier = dyn Fn(Request, &dyn Fn() -> bool) -> Result<CommandReply, BusError> + Send + Sync;

/// Sends commands in their order, and a hold past all others.
#[derive(Debug)]
pub struct Desk {
    others: SyncSender<Order>,
    holds: SyncSender<Order>,
    line: Arc<Line>,
}

/// A command, its number, and how many holds were given before it.
struct Order {
    request: Request,
    number: u64,
    holds_before: u64,
    answer: Answer,
}

/// A command that has not been answered.
#[derive(Clone, Copy, Debug)]
struct Unanswered {
    request: Request,
    number: u64,
    is_sent: bool,
}

/// What the two lanes have in common.
#[derive(Debug, Default)]
struct Line {
    /// Holds given so far.
    holds: AtomicU64,
    /// Whether nothing but holds is sent any more.
    is_closed: AtomicBool,
    /// Locked while a command is on its way.
    on_its_way: Mutex<()>,
    /// Commands given so far.
    given: AtomicU64,
    unanswered: Mutex<Vec<Unanswered>>,
    answered: Condvar,
}

impl Desk {
    /// A desk of an instance, which joins the bus under this node name, and commands as this kind of sender.
    ///
    /// # Errors
    /// The operating system's reason for having no more threads.
    pub fn open(domain: Domain, name: &'static str, sender: Sender) -> io::Result<Self> {
        Self::sending(Arc::new(move |request, is_given_up: &dyn Fn() -> bool| {
            call(&domain, name, sender, request, is_given_up)
        }))
    }

    fn sending(send: Arc<Courier>) -> io::Result<Self> {
        let line = Arc::new(Line::default());
        let (others, orders) = mpsc::sync_channel(ROOM);
        let (holds, hold_orders) = mpsc::sync_channel(ROOM);
        let (sent_by, in_line) = (Arc::clone(&send), Arc::clone(&line));
        thread::Builder::new().name("commands".to_owned()).spawn(move || send_others(&orders, &*sent_by, &in_line))?;
        let in_line = Arc::clone(&line);
        thread::Builder::new().name("holds".to_owned()).spawn(move || send_holds(&hold_orders, &*send, &in_line))?;
        Ok(Self { others, holds, line })
    }

    /// Gives a command. `answer` is called once, on a thread of the desk's: at once where there is no room for the command, on the
    /// caller's.
    pub fn give(&self, request: Request, answer: impl FnOnce(Result<CommandReply, DeskError>) + Send + 'static) {
        let is_hold = request == Request::Hold;
        let holds_before = self.line.holds.fetch_add(u64::from(is_hold), Ordering::SeqCst);
        let number = self.line.begin(request);
        let order = Order { request, number, holds_before, answer: Box::new(answer) };
        let lane = if is_hold { &self.holds } else { &self.others };
        // The lanes last as long as their senders.
        if let Err(TrySendError::Full(order) | TrySendError::Disconnected(order)) = lane.try_send(order) {
            (order.answer)(Err(DeskError::Crowded));
            self.line.end(number);
        }
    }

    /// Gives up whatever has not been sent, but for holds. Then waits until of those commands that `is_waited_for` names all are
    /// answered, at most so long, and says which have been sent and are not.
    pub fn close(&self, patience: Duration, is_waited_for: impl Fn(Request) -> bool) -> Vec<Request> {
        self.line.is_closed.store(true, Ordering::SeqCst);
        let is_waiting = |unanswered: &mut Vec<Unanswered>| unanswered.iter().any(|one| is_waited_for(one.request));
        let waited = self.line.answered.wait_timeout_while(lock(&self.line.unanswered), patience, is_waiting);
        let (left, _) = waited.unwrap_or_else(PoisonError::into_inner);
        left.iter().filter(|one| one.is_sent && is_waited_for(one.request)).map(|one| one.request).collect()
    }
}

impl std::fmt::Debug for Order {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Order").field("request", &self.request).finish_non_exhaustive()
    }
}

impl Line {
    /// Why an order is not to be sent any more: a hold was given after it, or nobody waits for it.
    fn gives_up(&self, holds_before: u64) -> Option<DeskError> {
        let is_overtaken = self.holds.load(Ordering::SeqCst) > holds_before;
        let is_closed = self.is_closed.load(Ordering::SeqCst);
        is_overtaken.then_some(DeskError::Overtaken).or(is_closed.then_some(DeskError::Closed))
    }

    fn begin(&self, request: Request) -> u64 {
        let number = self.given.fetch_add(1, Ordering::Relaxed);
        lock(&self.unanswered).push(Unanswered { request, number, is_sent: false });
        number
    }

    fn note_sent(&self, number: u64) {
        lock(&self.unanswered).iter_mut().filter(|one| one.number == number).for_each(|one| one.is_sent = true);
    }

    fn end(&self, number: u64) {
        lock(&self.unanswered).retain(|one| one.number != number);
        self.answered.notify_all();
    }
}

fn send_others(orders: &Receiver<Order>, send: &Courier, line: &Line) {
    for Order { request, number, holds_before, answer } in orders {
        let on_its_way = lock(&line.on_its_way);
        let outcome = if let Some(error) = line.gives_up(holds_before) {
            Err(error)
        } else {
            line.note_sent(number);
            send(request, &|| line.gives_up(holds_before).is_some()).map_err(DeskError::Bus)
        };
        drop(on_its_way);
        answer(outcome);
        line.end(number);
    }
}

fn send_holds(orders: &Receiver<Order>, send: &Courier, line: &Line) {
    for Order { request, number, answer, .. } in orders {
        line.note_sent(number);
        let outcome = match line.on_its_way.try_lock() {
            Ok(_alone) => send(request, &|| false),
            Err(TryLockError::Poisoned(_)) => send(request, &|| false),
            Err(TryLockError::WouldBlock) => {
                // At once; and again when what is on its way can no longer come after it.
                let first = send(request, &|| false);
                let _alone = lock(&line.on_its_way);
                // A server that is gone meanwhile has stopped too.
                send(request, &|| false).or(first)
            }
        };
        answer(outcome.map_err(DeskError::Bus));
        line.end(number);
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Sender, channel};

    use super::*;

    /// A server that is told by the test when to take each command.
    struct Stage {
        desk: Desk,
        /// What has been sent, in order.
        sent: Receiver<Request>,
        /// Lets the next command that is no hold be answered.
        go_on: Sender<()>,
    }

    fn stage() -> Stage {
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
        Stage { desk: Desk::sending(Arc::new(send)).expect("two threads"), sent, go_on }
    }

    /// Gives a command, and what comes of it later.
    fn give(desk: &Desk, request: Request) -> Receiver<Result<CommandReply, DeskError>> {
        let (answer, answered) = channel();
        desk.give(request, move |outcome| answer.send(outcome).expect("the test listens"));
        answered
    }

    #[test]
    fn commands_are_sent_one_at_a_time_in_their_order() {
        let Stage { desk, sent, go_on } = stage();
        let answers = [Request::Pause, Request::Resume, Request::Release].map(|request| give(&desk, request));
        for request in [Request::Pause, Request::Resume, Request::Release] {
            assert_eq!(sent.recv(), Ok(request));
            assert!(sent.try_recv().is_err(), "the next one waits for the answer of this one");
            go_on.send(()).expect("it waits");
        }
        assert!(answers.iter().all(|answer| answer.recv().expect("an answer").is_ok()));
    }

    #[test]
    fn a_hold_is_sent_at_once_and_once_more_after_what_was_on_its_way_and_what_waited_is_given_up() {
        let Stage { desk, sent, go_on } = stage();
        let release = give(&desk, Request::Release);
        assert_eq!(sent.recv(), Ok(Request::Release));
        let resume = give(&desk, Request::Resume);
        let hold = give(&desk, Request::Hold);
        assert_eq!(sent.recv(), Ok(Request::Hold));
        assert!(hold.try_recv().is_err(), "the release may still come after it");
        go_on.send(()).expect("the release waits");
        assert_eq!(release.recv().expect("an answer").expect("a reply").run_id, 1, "it was told to give up");
        assert!(matches!(resume.recv(), Ok(Err(DeskError::Overtaken))));
        assert_eq!(sent.recv(), Ok(Request::Hold));
        assert!(matches!(hold.recv(), Ok(Ok(_))));
        assert_eq!(desk.close(Duration::from_mins(1), |_| true), []);
        assert!(sent.try_recv().is_err());
    }

    #[test]
    fn what_is_given_after_a_hold_is_sent_after_it() {
        let Stage { desk, sent, go_on } = stage();
        give(&desk, Request::Hold).recv().expect("an answer").expect("a reply");
        let release = give(&desk, Request::Release);
        go_on.send(()).expect("it waits");
        assert_eq!(release.recv().expect("an answer").expect("a reply").run_id, 0);
        assert_eq!([sent.recv(), sent.recv()], [Ok(Request::Hold), Ok(Request::Release)]);
    }

    #[test]
    fn more_commands_than_there_is_room_for_are_told_so_and_a_hold_has_room_of_its_own() {
        let Stage { desk, sent, go_on } = stage();
        let first = give(&desk, Request::Pause);
        assert_eq!(sent.recv(), Ok(Request::Pause));
        let waiting: Vec<_> = (0..ROOM).map(|_| give(&desk, Request::Resume)).collect();
        assert!(matches!(give(&desk, Request::Resume).recv(), Ok(Err(DeskError::Crowded))));
        let hold = give(&desk, Request::Hold);
        go_on.send(()).expect("the first one waits");
        assert!(first.recv().expect("an answer").is_ok() && hold.recv().expect("an answer").is_ok());
        assert!(waiting.iter().all(|answer| matches!(answer.recv(), Ok(Err(DeskError::Overtaken)))));
    }

    #[test]
    fn a_desk_that_closes_waits_for_its_holds_and_gives_up_the_rest() {
        let Stage { desk, sent, go_on } = stage();
        let pause = give(&desk, Request::Pause);
        assert_eq!(sent.recv(), Ok(Request::Pause));
        let hold = give(&desk, Request::Hold);
        let release = give(&desk, Request::Release);
        let is_hold = |request| request == Request::Hold;
        assert_eq!(sent.recv(), Ok(Request::Hold));
        assert_eq!(desk.close(Duration::ZERO, is_hold), [Request::Hold], "it has no answer before that of the pause");
        assert_eq!(desk.close(Duration::ZERO, |_| true), [Request::Pause, Request::Hold]);
        go_on.send(()).expect("the pause waits");
        assert_eq!(desk.close(Duration::from_mins(1), |_| true), []);
        assert!(pause.recv().expect("an answer").is_ok() && hold.recv().expect("an answer").is_ok());
        assert!(matches!(release.recv(), Ok(Err(DeskError::Closed))));
    }
}
