//! The guard's thread: looks at the newest frame, proves the travel ahead and sends grants.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use bench_dragon_geometry::clearance::PairClearance;
use bench_dragon_geometry::dragon::Meter;
use bench_dragon_ipc::{
    Alert, BusError, CommandClient, Domain, FrameHeader, Refusal, Request, Sender as CommandSender, StatusReader,
};
use crossbeam::channel::{self, Receiver, RecvTimeoutError, Sender, TryRecvError};
use crossbeam::queue::ArrayQueue;

use crate::config::Config;
use crate::safety::guard::{ClearanceCheck, FinalRest, Guard, STEPS_AT_A_TIME};
use crate::safety::monitor::fault_alert;

/// How often the thread looks at the status where no frame comes.
const LOOK_PERIOD: Duration = Duration::from_millis(20);
/// How long a server may take to answer before the guard looks at the present again.
const REPLY_TIMEOUT: Duration = Duration::from_secs(2);

/// The guard of one run. Its thread ends with it, and with that its grants.
pub(super) struct GuardThread {
    newest: Arc<ArrayQueue<FrameHeader>>,
    check: ClearanceCheck,
    has_fault: Arc<AtomicBool>,
    news: Receiver<GuardNews>,
    wake: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

pub(super) enum GuardNews {
    /// The head rests where no further travel can ever be granted.
    FinalRest(FinalRest),
    /// The bus has failed; the guard has ended.
    Failed(BusError),
    /// The guard has ended after a fault, and has held the show unless that failed.
    GaveUp(Option<BusError>),
}

/// News that wait for the owner, which takes them with every frame.
const MOST_NEWS: usize = 8;

impl GuardThread {
    /// Starts to guard a run.
    pub(super) fn start(domain: &Domain, config: Config, run_id: u64) -> io::Result<Self> {
        let check = ClearanceCheck::new(Arc::clone(config.dragon()));
        let newest = Arc::new(ArrayQueue::new(1));
        let has_fault = Arc::new(AtomicBool::new(false));
        let (wake, woken) = channel::bounded(1);
        let (sender, news) = channel::bounded(MOST_NEWS);
        let (domain, frames, stop) = (domain.clone(), Arc::clone(&newest), Arc::clone(&has_fault));
        let guard = move || {
            let dragon = config.dragon().metered(&Meter::of(STEPS_AT_A_TIME));
            let guard = Guard::new(&dragon, &config, run_id);
            let ended = match GuardWorker::open(&domain, frames, stop, woken) {
                Ok(worker) => worker.keep(guard, &sender),
                // The server has just ended: there is nothing to guard.
                Err(error) if error.is_absent() => Ok(()),
                Err(error) => Err(GuardNews::Failed(error)),
            };
            // Nobody listens where the owner has gone meanwhile.
            let _ = ended.map_err(|news| sender.send(news));
        };
        let thread = thread::Builder::new().name("guard".to_owned()).spawn(guard)?;
        Ok(Self { newest, check, has_fault, news, wake: Some(wake), thread: Some(thread) })
    }

    /// Shows the guard a frame, and what was measured in it. It looks at the newest one when it comes to it.
    ///
    /// Returns the alert of a fault that begins with this frame: it is not what was proved. The guard then grants no more, and
    /// holds the show.
    pub(super) fn show(&mut self, header: &FrameHeader, nearest: Option<PairClearance>) -> Option<Alert> {
        self.newest.force_push(*header);
        self.wake();
        let begins = !self.check.agrees(header, nearest) && !self.has_fault.swap(true, Ordering::Relaxed);
        begins.then(|| {
            self.wake();
            fault_alert(header, nearest)
        })
    }

    pub(super) fn news(&self) -> Option<GuardNews> {
        self.news.try_recv().ok()
    }

    fn wake(&self) {
        // Where it is already woken, or has ended, nothing is to be done.
        let _ = self.wake.as_ref().map(|wake| wake.try_send(()));
    }
}

impl Drop for GuardThread {
    fn drop(&mut self) {
        self.wake = None;
        // The thread does not wait for news to be taken any more.
        self.news = channel::never();
        // Its ports are taken off the bus by then. It does not panic, and here nobody could be told.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// What the thread works with.
struct GuardWorker {
    commands: CommandClient,
    status: StatusReader,
    frames: Arc<ArrayQueue<FrameHeader>>,
    has_fault: Arc<AtomicBool>,
    woken: Receiver<()>,
    asked_m: Option<f64>,
    /// Whether the source has said that it takes no grants at all, as a replay does.
    takes_no_grants: bool,
}

impl GuardWorker {
    fn open(
        domain: &Domain,
        frames: Arc<ArrayQueue<FrameHeader>>,
        has_fault: Arc<AtomicBool>,
        woken: Receiver<()>,
    ) -> Result<Self, BusError> {
        let commands = CommandClient::open(domain, "guard")?.sending_as(CommandSender::Guard);
        let status = StatusReader::open(domain, "guard-status")?;
        Ok(Self { commands, status, frames, has_fault, woken, asked_m: None, takes_no_grants: false })
    }

    /// Guards until the owner is gone, or the guard has to give up, for the reason that is returned.
    fn keep(mut self, mut guard: Guard<'_>, sender: &Sender<GuardNews>) -> Result<(), GuardNews> {
        let mut newest = None;
        let mut reported_m = None;
        while self.woken.recv_timeout(LOOK_PERIOD) != Err(RecvTimeoutError::Disconnected) {
            newest = self.frames.pop().or(newest);
            let Some(header) = newest else { continue };
            self.grant(&mut guard, header)?;
            let rest_m = guard.is_final(&header).then_some(header.head_travel_m);
            if rest_m.is_some() && rest_m != reported_m {
                // Nobody listens where the owner has gone meanwhile.
                let _ = sender.send(GuardNews::FinalRest(guard.final_rest(&header)));
            }
            reported_m = rest_m;
        }
        Ok(())
    }

    /// Sends grants until the server has enough, or is gone.
    fn grant(&mut self, guard: &mut Guard<'_>, mut header: FrameHeader) -> Result<(), GuardNews> {
        while !self.has_fault.load(Ordering::Relaxed) {
            if self.takes_no_grants || self.woken.try_recv() == Err(TryRecvError::Disconnected) {
                return Ok(());
            }
            if let Some(status) = self.status.poll().map_err(GuardNews::Failed)? {
                self.asked_m = status.asked().filter(|_| status.run_id == header.run_id);
            }
            let Some(grant @ Request::Grant { from_m, to_m, is_final, .. }) = guard.follow(&header, self.asked_m)
            else {
                return Ok(());
            };
            match self.commands.call(grant, REPLY_TIMEOUT).map(|reply| reply.outcome()) {
                Ok(Ok(_)) => guard.note_granted(from_m, to_m, is_final),
                Ok(Err(Refusal::Replayed | Refusal::NotGuarded)) => self.takes_no_grants = true,
                // It has just been started again, or is gone: the next frame tells.
                Ok(Err(_)) | Err(BusError::NoServer { .. } | BusError::NoAnswer { .. }) => return Ok(()),
                Err(error) => return Err(GuardNews::Failed(error)),
            }
            header = self.frames.pop().unwrap_or(header);
        }
        Err(GuardNews::GaveUp(self.commands.call(Request::Hold, REPLY_TIMEOUT).err()))
    }
}
