//! Commands on their way to the server, which may take seconds: the screen does not wait for them.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, SyncSender, TrySendError};
use std::thread::{self, JoinHandle};

use bench_dragon::control;
use bench_dragon::watch::Reply;
use bench_dragon_ipc::{Domain, Request};

use super::event::Event;

/// Commands that may wait for those before them.
const ROOM: usize = 8;

/// Sends commands in their order; a hold past all others, which are given up if they have not been sent yet.
pub(super) struct Clerk {
    others: SyncSender<Order>,
    holds: SyncSender<Order>,
    held: Arc<AtomicU64>,
    lanes: [JoinHandle<()>; 2],
}

/// A command, and how many holds were asked for before it.
struct Order {
    request: Request,
    held_before: u64,
}

impl Clerk {
    /// A clerk for an instance, which sends the answers as events.
    pub(super) fn start(domain: &Domain, events: &SyncSender<Event>) -> io::Result<Self> {
        let held = Arc::new(AtomicU64::new(0));
        let lane = |name: &str| {
            let (sender, orders) = mpsc::sync_channel(ROOM);
            let (domain, events, held) = (domain.clone(), events.clone(), Arc::clone(&held));
            let carry_out = move || carry_out(&orders, &domain, &events, &held);
            Ok::<_, io::Error>((sender, thread::Builder::new().name(name.to_owned()).spawn(carry_out)?))
        };
        let ((others, sending_others), (holds, sending_holds)) = (lane("commands")?, lane("holds")?);
        Ok(Self { others, holds, held, lanes: [sending_others, sending_holds] })
    }

    /// Waits until what was asked for has been sent: a hold is carried out though its screen is gone.
    pub(super) fn finish(self) {
        let Self { others, holds, lanes, .. } = self;
        drop((others, holds));
        for lane in lanes {
            // A panic has told its reason.
            let _ = lane.join();
        }
    }

    /// Sends a command; a reply at once where it cannot be.
    pub(super) fn send(&self, request: Request) -> Option<Reply> {
        let is_hold = request == Request::Hold;
        let held_before =
            if is_hold { self.held.fetch_add(1, Ordering::SeqCst) + 1 } else { self.held.load(Ordering::SeqCst) };
        let lane = if is_hold { &self.holds } else { &self.others };
        match lane.try_send(Order { request, held_before }) {
            Ok(()) => None,
            Err(TrySendError::Full(_)) => Some(Reply::dropped(request, "too many commands wait for the server")),
            Err(TrySendError::Disconnected(_)) => Some(Reply::dropped(request, "it cannot be sent any more")),
        }
    }
}

fn carry_out(orders: &Receiver<Order>, domain: &Domain, events: &SyncSender<Event>, held: &AtomicU64) {
    for Order { request, held_before } in orders {
        let reply = if held.load(Ordering::SeqCst) > held_before && request != Request::Hold {
            Reply::dropped(request, "a hold has come after it")
        } else {
            Reply::to(request, control::call(domain, "watch-command", request, || false))
        };
        // Where nobody listens any more, the command holds all the same.
        let _ = events.send(Event::Reply(reply));
    }
}
