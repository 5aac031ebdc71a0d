//! The guard's thread: reads the newest frame, proves the travel ahead and sends grants.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use bench_dragon_geometry::clearance::PairClearance;
use bench_dragon_geometry::dragon::Meter;
use bench_dragon_ipc::{
    Alert, BusError, CommandClient, Domain, FrameHeader, Request, Sender as CommandSender, StatusReader,
};
use crossbeam::channel::{self, Receiver, RecvTimeoutError, Sender, TryRecvError};
use crossbeam::queue::ArrayQueue;

use crate::config::Config;
use crate::safety::guard::{Asked, ClearanceCheck, FinalRest, Guard, STEPS_AT_A_TIME};
use crate::safety::monitor::fault_alert;

/// Period at which the thread reads the status if no frame arrives.
const LOOK_PERIOD: Duration = Duration::from_millis(20);
/// Longest wait for the server's reply, before the guard reads the newest frame again.
const REPLY_TIMEOUT: Duration = Duration::from_secs(2);

/// The guard of one run. Dropping it ends its thread, so no more grants are sent.
pub(super) struct GuardThread {
    newest: Arc<ArrayQueue<FrameHeader>>,
    check: ClearanceCheck,
    has_fault: Arc<AtomicBool>,
    news: Receiver<GuardNews>,
    wake: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

pub(super) enum GuardNews {
    /// The head rests at a travel from which no further travel can ever be granted.
    FinalRest(FinalRest),
    /// The bus has failed, and the guard has ended.
    Failed(BusError),
    /// The guard has ended after a fault. It has held the show, or failed to do so with this error.
    GaveUp(Option<BusError>),
}

/// Most news that wait for the owner, which takes them after every frame.
const MOST_NEWS: usize = 8;

impl GuardThread {
    /// Starts the guard of a run.
    pub(super) fn start(domain: &Domain, config: Config, run_id: u64) -> io::Result<Self> {
        let check = ClearanceCheck::new(Arc::clone(config.formation()));
        let newest = Arc::new(ArrayQueue::new(1));
        let has_fault = Arc::new(AtomicBool::new(false));
        let (wake, woken) = channel::bounded(1);
        let (sender, news) = channel::bounded(MOST_NEWS);
        let (domain, frames, stop) = (domain.clone(), Arc::clone(&newest), Arc::clone(&has_fault));
        let guard = move || {
            let formation = config.formation().metered(&Meter::of(STEPS_AT_A_TIME));
            let guard = Guard::new(&formation, &config, run_id);
            let ended = match GuardWorker::open(&domain, frames, stop, woken) {
                Ok(worker) => worker.keep(guard, &sender),
                // The server has just ended, so there is nothing to guard.
                Err(error) if error.is_absent() => Ok(()),
                Err(error) => Err(GuardNews::Failed(error)),
            };
            // The send fails if the owner has dropped the guard; then no report is needed.
            let _ = ended.map_err(|news| sender.send(news));
        };
        let thread = thread::Builder::new().name("guard".to_owned()).spawn(guard)?;
        Ok(Self { newest, check, has_fault, news, wake: Some(wake), thread: Some(thread) })
    }

    /// Passes a frame, and the nearest pair that was measured in it, to the guard. The thread reads only the newest frame.
    ///
    /// Returns an alert if a fault begins with this frame: the frame differs from the guard's proof. The guard then grants no
    /// more, and holds the show.
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
        // The send fails if the thread is already woken or has ended. Both are fine.
        let _ = self.wake.as_ref().map(|wake| wake.try_send(()));
    }
}

impl Drop for GuardThread {
    fn drop(&mut self) {
        self.wake = None;
        // Dropping the receiver keeps the thread from waiting until its news are taken.
        self.news = channel::never();
        // After the join, the thread's ports are closed. The thread does not panic, and a panic could not be reported here.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// The ports and channels of the thread.
struct GuardWorker {
    commands: CommandClient,
    status: StatusReader,
    frames: Arc<ArrayQueue<FrameHeader>>,
    has_fault: Arc<AtomicBool>,
    woken: Receiver<()>,
    /// The target of a refused seek that needs a grant, by the last status.
    asked: Option<Asked>,
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
        Ok(Self { commands, status, frames, has_fault, woken, asked: None })
    }

    /// Guards until the owner drops the guard, or until an error or a fault, which is returned.
    fn keep(mut self, mut guard: Guard<'_>, sender: &Sender<GuardNews>) -> Result<(), GuardNews> {
        let mut newest = None;
        let mut reported_m = None;
        while self.woken.recv_timeout(LOOK_PERIOD) != Err(RecvTimeoutError::Disconnected) {
            newest = self.frames.pop().or(newest);
            let Some(header) = newest else { continue };
            self.grant(&mut guard, header)?;
            let rest_m = guard.is_final(&header).then_some(header.course_m);
            if rest_m.is_some() && rest_m != reported_m {
                // The send fails if the owner has dropped the guard; then no report is needed.
                let _ = sender.send(GuardNews::FinalRest(guard.final_rest(&header)));
            }
            reported_m = rest_m;
        }
        Ok(())
    }

    /// Sends grants until the server has enough travel or has ended.
    fn grant(&mut self, guard: &mut Guard<'_>, mut header: FrameHeader) -> Result<(), GuardNews> {
        while !self.has_fault.load(Ordering::Relaxed) {
            if self.woken.try_recv() == Err(TryRecvError::Disconnected) {
                return Ok(());
            }
            if let Some(status) = self.status.poll().map_err(GuardNews::Failed)? {
                self.asked = Asked::of(&status).filter(|_| status.run_id == header.run_id);
            }
            let Some(grant) = guard.advance(&header, self.asked) else { return Ok(()) };
            match self.commands.ask(grant, REPLY_TIMEOUT).map(|reply| reply.outcome()) {
                Ok(outcome) if guard.note_reply(grant, outcome) => {}
                // The source takes no grants, or the server has restarted or ended.
                Ok(_) | Err(BusError::NoServer { .. } | BusError::NoAnswer { .. }) => return Ok(()),
                Err(error) => return Err(GuardNews::Failed(error)),
            }
            header = self.frames.pop().unwrap_or(header);
        }
        Err(GuardNews::GaveUp(self.commands.call(Request::Hold, REPLY_TIMEOUT).err()))
    }
}
