//! Client of an instance for any number of threads. The libraries for C and Python are layers over it.

#![allow(unsafe_code, reason = "frames are lent across threads")]

use core::mem::ManuallyDrop;
use core::ptr::NonNull;
use core::sync::atomic::Ordering::{Acquire, Relaxed, SeqCst};
use core::sync::atomic::{AtomicBool, AtomicU64};
use std::os::fd::RawFd;
use std::rc::Rc;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::alert::Alert;
use crate::client::{AlertSubscriber, CommandClient, Description, DescriptionReader, StatusReader};
use crate::command::{CommandReply, Request};
use crate::confined::Confined;
use crate::continuity::Continuity;
use crate::domain::Domain;
use crate::error::BusError;
use crate::forks::Process;
use crate::frame::{FrameHeader, HandleState};
use crate::service::{MAX_BORROWED_FRAMES, Member, Role};
use crate::source_state::SourceState;
use crate::status::Status;
use crate::subscriber::{Frame, FrameSubscriber};
use crate::wake_descriptor::WakeDescriptor;
use crate::wake_page::WakePage;
use crate::wake_word;

/// Period in which a call looks for a server, a description or a status, while it waits for one.
const LOOK_PERIOD: Duration = Duration::from_millis(10);
/// Longest time for which a call that waits for alerts does not notice that the dragon was closed.
const ALERT_SLICE: Duration = Duration::from_millis(20);

/// A client of one instance: its frames, description, status and alerts, and commands to its server.
///
/// Any thread may use it, also while others wait. Each frame goes to one of the threads that read. [`Dragon::close`] from
/// any thread ends every wait. A dragon outlives its server: the frames of the next server follow with
/// [`Continuity::Restarted`].
///
/// A forked child inherits the dragon without a membership: every call fails with [`BusError::Inherited`], and dropping it
/// has no effect.
#[derive(Debug)]
pub struct Dragon {
    shared: Arc<Shared>,
}

/// State that a dragon shares with the frames that it has lent.
#[derive(Debug)]
struct Shared {
    domain: Domain,
    name: String,
    process: Process,
    is_closed: Arc<AtomicBool>,
    wake: Arc<WakePage>,
    descriptor: Mutex<Option<WakeDescriptor>>,
    /// Slots whose frame was released. The next read drops the sample.
    returned: [AtomicBool; MAX_BORROWED_FRAMES],
    lost: AtomicU64,
    // Never dropped in a forked child.
    readers: ManuallyDrop<Confined<Readers>>,
    alerts: ManuallyDrop<Confined<Option<AlertSubscriber>>>,
    commands: ManuallyDrop<Confined<Option<CommandClient>>>,
}

/// The ports of one member, which are read without waiting. Samples share the member's state, so they are behind the same
/// lock.
#[derive(Debug)]
struct Readers {
    lent: [Option<Frame>; MAX_BORROWED_FRAMES],
    /// `None` after the dragon was closed.
    ports: Option<ReaderPorts>,
}

#[derive(Debug)]
struct ReaderPorts {
    frames: FrameSubscriber,
    descriptions: DescriptionReader,
    description: Option<Description>,
    statuses: StatusReader,
    status: Option<Box<Status>>,
}

impl Dragon {
    /// Opens an instance under a node name that `iox2 node list` shows. Waits for a server at most `timeout`; 0 does not
    /// wait.
    ///
    /// # Errors
    /// [`BusError::NoServer`] where no server appears in time; else as [`FrameSubscriber::open`].
    pub fn open(domain: &Domain, name: &str, timeout: Duration) -> Result<Self, BusError> {
        let ports = look(timeout, || ReaderPorts::open(domain, name).map(Some))?.expect("an attempt opens or fails");
        Ok(Self {
            shared: Arc::new(Shared {
                domain: domain.clone(),
                name: name.to_owned(),
                process: Process::this(),
                is_closed: Arc::default(),
                wake: Arc::clone(ports.frames.wake_page()),
                descriptor: Mutex::default(),
                returned: Default::default(),
                lost: AtomicU64::new(0),
                readers: ManuallyDrop::new(Confined::new(Readers { lent: Default::default(), ports: Some(ports) })),
                alerts: ManuallyDrop::new(Confined::new(None)),
                commands: ManuallyDrop::new(Confined::new(None)),
            }),
        })
    }

    /// Returns the oldest unread frame, or `None` if all are read. Never waits.
    ///
    /// # Errors
    /// [`BusError::TooManyFrames`] where [`MAX_BORROWED_FRAMES`] frames are held; else as [`FrameSubscriber::receive`].
    /// Like every call: [`BusError::Closed`] and [`BusError::Inherited`].
    pub fn receive(&self) -> Result<Option<LentFrame>, BusError> {
        let frame = self.lend(FrameSubscriber::receive)?;
        if frame.is_none() && self.empty_descriptor() {
            // A frame that arrived before the descriptor was emptied would not make it readable again.
            return self.lend(FrameSubscriber::receive);
        }
        Ok(frame)
    }

    /// Returns the newest unread frame, or `None` if all are read. Older frames are dropped unread and do not count as
    /// lost. Never waits.
    ///
    /// # Errors
    /// As [`Dragon::receive`].
    pub fn latest(&self) -> Result<Option<LentFrame>, BusError> {
        self.empty_descriptor();
        self.lend(FrameSubscriber::latest)
    }

    /// Returns the oldest unread frame. Waits for one at most `timeout` and then returns `None`. A signal ends the wait
    /// early.
    ///
    /// # Errors
    /// As [`Dragon::receive`]. [`BusError::Closed`] as soon as another thread closes the dragon.
    pub fn wait(&self, timeout: Duration) -> Result<Option<LentFrame>, BusError> {
        wake_word::wait(&*self.shared.wake, timeout, || self.receive())
    }

    /// Number of frames that the dragon has lost; see [`FrameSubscriber::lost`].
    pub fn lost(&self) -> u64 {
        self.shared.lost.load(Relaxed)
    }

    /// Whether the source publishes, and if not, why; see [`FrameSubscriber::source_state`].
    ///
    /// # Errors
    /// [`BusError::Closed`] and [`BusError::Inherited`].
    pub fn source_state(&self, limit: Duration) -> Result<SourceState, BusError> {
        self.with_ports(|ports| Ok(ports.frames.source_state(limit)))
    }

    /// Returns the description of the latest run. Waits for the first one at most `timeout`: a server sends it to new
    /// readers within a tenth of a second. The description of a server that has ended is returned until the next server
    /// publishes its own.
    ///
    /// # Errors
    /// As [`DescriptionReader::poll`]; [`BusError::NoServer`] where none has arrived and no server runs.
    pub fn description(&self, timeout: Duration) -> Result<Option<Description>, BusError> {
        self.latest_value(timeout, |ports| {
            while let Some(description) = ports.descriptions.poll()? {
                ports.description = Some(description);
            }
            Ok(ports.description.clone())
        })
    }

    /// Returns the latest status. Waits for the first one at most `timeout`. The last status of a server that has ended or
    /// was killed is returned until the next server publishes its own.
    ///
    /// # Errors
    /// As [`Dragon::description`].
    pub fn status(&self, timeout: Duration) -> Result<Option<Status>, BusError> {
        self.latest_value(timeout, |ports| {
            while let Some(status) = ports.statuses.poll()? {
                ports.status = Some(Box::new(status));
            }
            Ok(ports.status.as_deref().copied())
        })
    }

    /// Returns the oldest unread alert. Waits for one at most `timeout`. Alerts are received from the first call on. A
    /// signal ends the wait early.
    ///
    /// # Errors
    /// [`BusError::NoServer`] where the first call finds no server in time; else as [`AlertSubscriber::receive`].
    pub fn alert(&self, timeout: Duration) -> Result<Option<Alert>, BusError> {
        let begun = Instant::now();
        let left = || timeout.saturating_sub(begun.elapsed());
        look(timeout, || self.open_alerts().map(Some))?;
        loop {
            let slice = left().min(ALERT_SLICE);
            let sliced = Instant::now();
            self.check()?;
            let alerts = self.shared.alerts.lock();
            let port = alerts.as_ref().ok_or_else(|| self.closed())?;
            let alert = port.wait(slice)?;
            if alert.is_some() || left().is_zero() || sliced.elapsed() < slice {
                return Ok(alert);
            }
            drop(alerts);
        }
    }

    /// Sends a command and waits for its reply at most `timeout`.
    ///
    /// # Errors
    /// As [`CommandClient::call`].
    pub fn call(&self, request: Request, timeout: Duration) -> Result<CommandReply, BusError> {
        self.check()?;
        let Shared { domain, name, .. } = &*self.shared;
        let mut client = self.shared.commands.lock();
        if client.is_none() {
            *client = Some(CommandClient::open(domain, name)?);
        }
        self.check()?;
        let client = client.as_ref().expect("the client was opened above");
        let outcome = client.call_unless(request, timeout, || self.shared.is_closed.load(Acquire));
        if outcome.is_err() { self.check().and(outcome) } else { outcome }
    }

    /// A file descriptor that is readable when a frame may be unread, for `poll`, `epoll` and event loops. It also becomes
    /// readable when the dragon is closed. Call [`Dragon::receive`] until it returns `None`: that makes the descriptor
    /// unreadable again. It belongs to the dragon, and ends with it.
    ///
    /// The first call starts a thread that sleeps until frames arrive. The server is not affected.
    ///
    /// # Errors
    /// [`BusError::Failed`] where the descriptor or the thread cannot be created.
    pub fn descriptor(&self) -> Result<RawFd, BusError> {
        self.check()?;
        let mut descriptor = self.shared.descriptor.lock().unwrap_or_else(PoisonError::into_inner);
        if descriptor.is_none() {
            let opened = WakeDescriptor::open(&self.shared.wake, &self.shared.is_closed);
            *descriptor = Some(opened.map_err(|error| BusError::failed("the descriptor", error))?);
        }
        Ok(descriptor.as_ref().expect("the descriptor was opened above").raw_fd())
    }

    /// Leaves the instance, and ends every wait of other threads with [`BusError::Closed`]. Every later call fails with it
    /// too. Held frames stay valid, and the process remains a member until the last one is released. A second call, and a
    /// call in a forked child, have no effect.
    pub fn close(&self) {
        let shared = &self.shared;
        if !shared.process.is_this() || shared.is_closed.swap(true, SeqCst) {
            return;
        }
        // A thread that waits with the descriptor is woken by it.
        shared.wake.raise();
        drop(shared.descriptor.lock().unwrap_or_else(PoisonError::into_inner).take());
        shared.commands.lock().take();
        shared.alerts.lock().take();
        let mut readers = shared.readers.lock();
        shared.drop_returned(&mut readers);
        readers.ports = None;
    }

    fn open_alerts(&self) -> Result<(), BusError> {
        self.check()?;
        let Shared { domain, name, .. } = &*self.shared;
        let mut alerts = self.shared.alerts.lock();
        if alerts.is_none() {
            *alerts = Some(AlertSubscriber::open(domain, name)?);
        }
        Ok(())
    }

    /// Lends the frame that `read` finds.
    fn lend(
        &self,
        read: impl FnOnce(&mut FrameSubscriber) -> Result<Option<Frame>, BusError>,
    ) -> Result<Option<LentFrame>, BusError> {
        self.check()?;
        let mut readers = self.shared.readers.lock();
        self.shared.drop_returned(&mut readers);
        let Readers { lent, ports } = &mut *readers;
        let frames = &mut ports.as_mut().ok_or_else(|| self.closed())?.frames;
        let Some(slot) = lent.iter().position(Option::is_none) else { return Err(BusError::TooManyFrames) };
        let read = read(frames);
        self.shared.lost.store(frames.lost(), Relaxed);
        Ok(read?.map(|frame| LentFrame::of(lent[slot].insert(frame), slot, Arc::clone(&self.shared))))
    }

    /// Waits for a value that no event announces.
    fn latest_value<Value>(
        &self,
        timeout: Duration,
        read: impl Fn(&mut ReaderPorts) -> Result<Option<Value>, BusError>,
    ) -> Result<Option<Value>, BusError> {
        let value = look(timeout, || self.with_ports(&read))?;
        match value {
            None if self.source_state(timeout)? == SourceState::Lost => Err(self.no_server()),
            value => Ok(value),
        }
    }

    fn with_ports<Value>(
        &self,
        read: impl FnOnce(&mut ReaderPorts) -> Result<Value, BusError>,
    ) -> Result<Value, BusError> {
        self.check()?;
        let mut readers = self.shared.readers.lock();
        read(readers.ports.as_mut().ok_or_else(|| self.closed())?)
    }

    /// Makes the descriptor unreadable. Returns whether there is one.
    fn empty_descriptor(&self) -> bool {
        let descriptor = self.shared.descriptor.lock().unwrap_or_else(PoisonError::into_inner);
        descriptor.as_ref().map(WakeDescriptor::empty).is_some()
    }

    fn check(&self) -> Result<(), BusError> {
        if !self.shared.process.is_this() {
            return Err(BusError::Inherited { instance: self.instance() });
        }
        if self.shared.is_closed.load(Acquire) { Err(self.closed()) } else { Ok(()) }
    }

    fn closed(&self) -> BusError {
        BusError::Closed { instance: self.instance() }
    }

    fn no_server(&self) -> BusError {
        BusError::NoServer { instance: self.instance() }
    }

    fn instance(&self) -> String {
        self.shared.domain.instance().to_string()
    }
}

impl Drop for Dragon {
    fn drop(&mut self) {
        self.close();
    }
}

impl ReaderPorts {
    fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        let member = Rc::new(Member::join(domain, name, Role::Client)?);
        Ok(Self {
            frames: FrameSubscriber::of(&member, domain, name)?,
            descriptions: DescriptionReader::of(&member)?,
            description: None,
            statuses: StatusReader::of(&member)?,
            status: None,
        })
    }
}

impl Shared {
    /// Marks a frame as released. Waits for no reader, unless the dragon is closed.
    fn take_back(&self, slot: usize) {
        self.returned[slot].store(true, SeqCst);
        // After the closing, nobody reads any more.
        if self.is_closed.load(SeqCst) && self.process.is_this() {
            self.drop_returned(&mut self.readers.lock());
        }
    }

    /// Drops the samples of released frames.
    fn drop_returned(&self, readers: &mut Readers) {
        for (frame, returned) in readers.lent.iter_mut().zip(&self.returned) {
            // Only the holder of a lent frame marks its slot, and only once. So a mark never belongs to an earlier frame
            // of the slot.
            if returned.swap(false, SeqCst) {
                *frame = None;
            }
        }
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        if self.process.is_this() {
            // SAFETY: nothing uses the ports after this.
            unsafe {
                ManuallyDrop::drop(&mut self.commands);
                ManuallyDrop::drop(&mut self.alerts);
                ManuallyDrop::drop(&mut self.readers);
            }
        }
    }
}

/// A frame that a [`Dragon`] has lent, in place in shared memory. Nothing in it changes while it is held. Any thread may
/// read and release it, also after the dragon and the server have ended.
#[derive(Debug)]
pub struct LentFrame {
    header: NonNull<FrameHeader>,
    handles: NonNull<[HandleState]>,
    continuity: Continuity,
    /// Slot in which the dragon keeps the sample while this frame exists.
    slot: usize,
    shared: Arc<Shared>,
}

// SAFETY: the pointers are to memory that nothing changes, and `Shared` may be used by any thread.
unsafe impl Send for LentFrame {}
// SAFETY: as above.
unsafe impl Sync for LentFrame {}

impl LentFrame {
    fn of(frame: &Frame, slot: usize, shared: Arc<Shared>) -> Self {
        let (header, handles) = (NonNull::from(frame.header()), NonNull::from(frame.handles()));
        Self { header, handles, continuity: frame.continuity(), slot, shared }
    }

    /// Values of the frame that concern the whole dragon.
    pub fn header(&self) -> &FrameHeader {
        // SAFETY: the pointer is into the sample, which the dragon keeps until `self` is dropped.
        unsafe { self.header.as_ref() }
    }

    /// The handles, head first; one more than there are benches.
    pub fn handles(&self) -> &[HandleState] {
        // SAFETY: as in `header`.
        unsafe { self.handles.as_ref() }
    }

    /// Relation of the frame to the previously received one.
    pub fn continuity(&self) -> Continuity {
        self.continuity
    }
}

impl Drop for LentFrame {
    fn drop(&mut self) {
        self.shared.take_back(self.slot);
    }
}

/// Calls `attempt` until it returns a value, at least once, and for at most `timeout`. The error that no server runs is
/// retried too, and returned at the end.
fn look<Value>(
    timeout: Duration,
    mut attempt: impl FnMut() -> Result<Option<Value>, BusError>,
) -> Result<Option<Value>, BusError> {
    let begun = Instant::now();
    loop {
        let outcome = attempt();
        let left = timeout.saturating_sub(begun.elapsed());
        let is_nothing_yet = match &outcome {
            Ok(value) => value.is_none(),
            Err(error) => error.is_absent(),
        };
        if !is_nothing_yet || left.is_zero() {
            return outcome;
        }
        thread::sleep(left.min(LOOK_PERIOD));
    }
}
