//! Commands on their way to the server, which may take seconds: the screen does not wait for them.

use std::convert::Infallible;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender, SyncSender, TrySendError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use bench_dragon::control;
use bench_dragon::watch::Reply;
use bench_dragon_ipc::{Domain, Request};

use super::mailbox::Mailbox;
use crate::command::output::complain;

/// Commands that may wait for those before them.
const ROOM: usize = 8;
/// After so long the one who has left is told what is waited for.
const MOMENT: Duration = Duration::from_millis(300);

/// Sends commands in their order; a hold past all others, which are given up if they have not been sent yet.
pub(super) struct Clerk {
    others: Lane,
    holds: Lane,
    desk: Arc<Desk>,
    /// Disconnected when both lanes are at their end.
    all_done: Receiver<Infallible>,
}

/// A thread that sends one command after the other.
struct Lane {
    orders: SyncSender<Order>,
    thread: JoinHandle<()>,
}

/// A command, and how many holds were asked for before it.
struct Order {
    request: Request,
    held_before: u64,
}

/// What both lanes share.
struct Desk {
    domain: Domain,
    mailbox: Arc<Mailbox>,
    held: AtomicU64,
    is_over: AtomicBool,
    /// What is under way.
    in_hand: Mutex<Vec<Request>>,
}

impl Clerk {
    /// A clerk for an instance, which puts the answers into the mailbox.
    pub(super) fn start(domain: &Domain, mailbox: &Arc<Mailbox>) -> io::Result<Self> {
        let desk = Arc::new(Desk {
            domain: domain.clone(),
            mailbox: Arc::clone(mailbox),
            held: AtomicU64::new(0),
            is_over: AtomicBool::new(false),
            in_hand: Mutex::default(),
        });
        let (until_done, all_done) = mpsc::channel();
        let others = Lane::start("commands", &desk, until_done.clone())?;
        let holds = Lane::start("holds", &desk, until_done)?;
        Ok(Self { others, holds, desk, all_done })
    }

    /// Waits until what is under way has been answered, and a hold that was asked for is, though their screen is gone; other
    /// commands that have not been sent are given up. Who waits longer than a moment is told for what.
    pub(super) fn finish(self) {
        let Self { others, holds, desk, all_done } = self;
        desk.is_over.store(true, Ordering::SeqCst);
        drop((others.orders, holds.orders));
        if all_done.recv_timeout(MOMENT) == Err(RecvTimeoutError::Timeout) {
            for request in desk.in_hand().iter() {
                complain(&format!("{}, waiting for the server's answer", Reply::sent(*request).text()));
            }
        }
        for thread in [others.thread, holds.thread] {
            // A panic has told its reason.
            let _ = thread.join();
        }
    }

    /// Sends a command; a reply at once where it cannot be.
    pub(super) fn send(&self, request: Request) -> Option<Reply> {
        let (is_hold, held) = (request == Request::Hold, &self.desk.held);
        let held_before = if is_hold { held.fetch_add(1, Ordering::SeqCst) + 1 } else { held.load(Ordering::SeqCst) };
        let lane = if is_hold { &self.holds } else { &self.others };
        match lane.orders.try_send(Order { request, held_before }) {
            Ok(()) => None,
            Err(TrySendError::Full(_)) => Some(Reply::dropped(request, "too many commands wait for the server")),
            Err(TrySendError::Disconnected(_)) => Some(Reply::dropped(request, "it cannot be sent any more")),
        }
    }
}

impl Lane {
    fn start(name: &str, desk: &Arc<Desk>, until_done: Sender<Infallible>) -> io::Result<Self> {
        let (sender, orders) = mpsc::sync_channel(ROOM);
        let desk = Arc::clone(desk);
        let carry_out = move || {
            desk.carry_out(&orders);
            drop(until_done);
        };
        Ok(Self { orders: sender, thread: thread::Builder::new().name(name.to_owned()).spawn(carry_out)? })
    }
}

impl Desk {
    fn carry_out(&self, orders: &Receiver<Order>) {
        let mut sent_after_the_end = false;
        for Order { request, held_before } in orders {
            let is_hold = request == Request::Hold;
            let is_over = self.is_over.load(Ordering::SeqCst);
            let reply = if self.held.load(Ordering::SeqCst) > held_before && !is_hold {
                Reply::dropped(request, "a hold has come after it")
            // Of the holds that wait, one is enough.
            } else if is_over && (!is_hold || sent_after_the_end) {
                Reply::dropped(request, "the watch is over")
            } else {
                sent_after_the_end = is_over;
                self.call(request, held_before)
            };
            self.mailbox.answer(reply);
        }
    }

    fn call(&self, request: Request, held_before: u64) -> Reply {
        // A seek that is not proved yet is not sent again behind a hold, nor when nobody waits for it.
        let is_given_up = || self.is_over.load(Ordering::SeqCst) || self.held.load(Ordering::SeqCst) > held_before;
        self.in_hand().push(request);
        let answer = control::call(&self.domain, "watch-command", request, is_given_up);
        self.in_hand().retain(|under_way| *under_way != request);
        Reply::to(request, answer)
    }

    /// A lane that panicked has left whole values all the same.
    fn in_hand(&self) -> MutexGuard<'_, Vec<Request>> {
        self.in_hand.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
