//! Client of an instance for any number of threads. The libraries for C and Python are layers over it.

use core::sync::atomic::Ordering::{Acquire, Relaxed, SeqCst};
use std::io;
use std::os::fd::{OwnedFd, RawFd};
use std::sync::{Arc, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::client::command_client::{accepted, await_reply};
use crate::client::source_state::monotonic_ns;
use crate::client::{
    AlertSubscriber, CommandClient, CommandEventReader, Continuity, Description, Frame, FrameSubscriber, SourceState,
};
use crate::domain::{BusError, Domain, DomainError, SourceLock};
use crate::service::{Member, Role};
use crate::wake::{self, DueWindow, Polled, WakeDescriptor};
use crate::wire::{Alert, CommandEvent, CommandReply, Request, Status};

mod confined;
mod lent_frame;
mod shared;

pub use lent_frame::LentFrame;
use shared::{Commands, ReaderPorts, Readers, Shared};

/// Greatest length of a client's name in bytes: the limit of iceoryx2.
const MAX_NAME_LEN: usize = 128;
/// Period in which a call looks for a server, a description or a status, while it waits for one.
const LOOK_PERIOD: Duration = Duration::from_millis(10);
/// Least wait of the first reading of command events. A server delivers the earlier ones within a tenth of a second.
const FIRST_EVENTS: Duration = Duration::from_millis(500);
/// Longest time for which a call that waits for alerts does not notice that the client was closed.
const ALERT_SLICE: Duration = Duration::from_millis(20);

/// A client of one instance: its frames, description, status and alerts, and commands to its server.
///
/// Any thread may use it, also while others wait. Each frame goes to one of the threads that read. [`Show::close`] from
/// any thread ends every wait. A client outlives its server: the frames of the next server follow with
/// [`Continuity::Restarted`].
///
/// A forked child inherits the client without a membership: every call fails with [`BusError::Inherited`], and dropping it
/// has no effect.
#[derive(Debug)]
pub struct Show {
    shared: Arc<Shared>,
}

impl Show {
    /// Opens an instance under a node name that `iox2 node list` shows. Waits for a server at most `timeout`; 0 does not
    /// wait.
    ///
    /// # Errors
    /// [`BusError::NoServer`] where no server runs in time, [`BusError::InvalidName`] for a name that is not 1 to 128
    /// printable ASCII characters; else as [`FrameSubscriber::open`].
    pub fn open(domain: &Domain, name: &str, timeout: Duration) -> Result<Self, BusError> {
        if !(1..=MAX_NAME_LEN).contains(&name.len()) || !name.bytes().all(|byte| (b' '..=b'~').contains(&byte)) {
            return Err(BusError::InvalidName { name: name.to_owned() });
        }
        let open = || match domain.check_directory() {
            // Without this, other clients that hold the services of a server that has ended would look like a server.
            Ok(()) if SourceLock::is_held(domain) => ReaderPorts::open(domain, name).map(Some),
            Ok(()) | Err(DomainError::Missing { .. }) => {
                Err(BusError::NoServer { instance: domain.instance().to_string() })
            }
            Err(error) => Err(error.into()),
        };
        if !SourceLock::is_held(domain) && domain.check_directory().is_ok() {
            // Joining removes what killed processes have left. The attempts that follow report every error.
            drop(Member::join(domain, name, Role::Client));
        }
        let ports = look(timeout, open)?.expect("an attempt opens or fails");
        Ok(Self { shared: Arc::new(Shared::new(domain, name, ports)) })
    }

    /// Returns the oldest unread frame, or `None` if all are read. Never waits.
    ///
    /// # Errors
    /// [`BusError::TooManyFrames`] where [`MAX_BORROWED_FRAMES`](crate::service::MAX_BORROWED_FRAMES) frames
    /// are held; else as [`FrameSubscriber::receive`].
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
    /// As [`Show::receive`].
    pub fn latest(&self) -> Result<Option<LentFrame>, BusError> {
        self.empty_descriptor();
        self.lend(FrameSubscriber::latest)
    }

    /// Returns the oldest unread frame. Waits for one at most `timeout` and then returns `None`. A signal ends the wait
    /// early.
    ///
    /// # Errors
    /// As [`Show::receive`]. [`BusError::Closed`] as soon as another thread closes the client.
    pub fn wait(&self, timeout: Duration) -> Result<Option<LentFrame>, BusError> {
        wake::wait(&*self.shared.wake, timeout, || self.receive())
    }

    /// Does the same as [`Show::wait`], but sleeps by the clock until `spin` before the next frame is due; see
    /// [`FrameSubscriber::wait_until_due`].
    ///
    /// # Errors
    /// As [`Show::wait`].
    pub fn wait_until_due(&self, timeout: Duration, spin: Duration) -> Result<Option<LentFrame>, BusError> {
        let begun = Instant::now();
        if let Some(due_ns) = self.with_ports(|ports| Ok(ports.frames.schedule().next_due_ns()))? {
            let window = DueWindow { due_ns, spin, timeout };
            let Polled { found, is_punctual, is_interrupted } =
                wake::poll_when_due(&*self.shared.wake, monotonic_ns, window, || self.receive())?;
            self.with_ports(|ports| {
                ports.frames.schedule().settle(is_punctual);
                Ok(())
            })?;
            if found.is_some() || is_interrupted {
                return Ok(found);
            }
        }
        self.wait(timeout.saturating_sub(begun.elapsed()))
    }

    /// Number of frames that the client has lost; see [`FrameSubscriber::lost`].
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
    /// As [`DescriptionReader::poll`](crate::DescriptionReader::poll).
    /// [`BusError::NoServer`] where none has arrived and no server runs.
    pub fn description(&self, timeout: Duration) -> Result<Option<Description>, BusError> {
        self.latest_value(timeout, |ports| {
            while let Some(description) = ports.descriptions.poll()? {
                ports.description = Some(description);
            }
            Ok(ports.description.clone())
        })
    }

    /// Returns the latest status. Waits for the first one at most `timeout`. The last status of a server that has ended or
    /// was killed is returned until the next server publishes its own, also if it is read for the first time then. A server
    /// sends it to new readers within a tenth of a second: one that is killed before leaves none.
    ///
    /// # Errors
    /// As [`Show::description`].
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

    /// Returns the oldest unread event of a command to the server, accepted or refused. Waits for one at most `timeout`; a
    /// server publishes events ten times a second. The first call also receives up to
    /// [`COMMAND_EVENT_BUFFER`](crate::service::COMMAND_EVENT_BUFFER) earlier events of the run, and waits for these at least
    /// half a second, if there are none yet.
    ///
    /// # Errors
    /// [`BusError::NoServer`] where the first call finds no server in time; else as [`CommandEventReader::receive`].
    pub fn command_event(&self, timeout: Duration) -> Result<Option<CommandEvent>, BusError> {
        self.check()?;
        let is_first = self.shared.events.lock().is_none();
        look(if is_first { timeout.max(FIRST_EVENTS) } else { timeout }, || {
            let Shared { domain, name, .. } = &*self.shared;
            self.check()?;
            let mut events = self.shared.events.lock();
            // Again behind the lock, so that nothing is opened after the closing.
            self.check()?;
            let port = match &mut *events {
                Some(port) => port,
                none => none.insert(CommandEventReader::open(domain, name)?),
            };
            port.receive()
        })
    }

    /// Sends a command and waits until the server has accepted it, at most `timeout`. Returns the server's reply. Commands of
    /// several threads do not wait for each other, up to [`MAX_ACTIVE_REQUESTS`](crate::service::MAX_ACTIVE_REQUESTS) at a time.
    ///
    /// # Errors
    /// As [`CommandClient::call`]: [`BusError::Refused`] where the server refuses the command.
    pub fn call(&self, request: Request, timeout: Duration) -> Result<CommandReply, BusError> {
        self.call_unless(request, timeout, || false)
    }

    /// Does the same as [`Show::call`], but also stops waiting as soon as `is_given_up` returns `true`. The command may
    /// still be executed.
    ///
    /// # Errors
    /// As [`Show::call`].
    pub fn call_unless(
        &self,
        request: Request,
        timeout: Duration,
        is_given_up: impl Fn() -> bool,
    ) -> Result<CommandReply, BusError> {
        let mut slot = None;
        if let Some(reply) = await_reply(timeout, is_given_up, || self.poll_command(request, &mut slot))? {
            return accepted(request, reply);
        }
        self.forget_command(slot);
        Err(BusError::NoAnswer { instance: self.instance(), waited: timeout })
    }

    /// Sends a command as soon as a slot is free, then looks for its reply. Never waits.
    fn poll_command(&self, request: Request, slot: &mut Option<usize>) -> Result<Option<CommandReply>, BusError> {
        let Shared { domain, name, .. } = &*self.shared;
        self.check()?;
        let mut commands = self.shared.commands.lock();
        // Again behind the lock, so that nothing is opened after the closing.
        self.check()?;
        let Commands { client, pending } = &mut *commands;
        if client.is_none() {
            *client = Some(CommandClient::open(domain, name)?);
        }
        if slot.is_none() {
            *slot = pending.iter().position(Option::is_none);
            let Some(free) = *slot else { return Ok(None) };
            let client = client.as_ref().expect("the client was opened above");
            pending[free] = Some(client.send(request)?);
        }
        let sent = &mut pending[slot.expect("the command was sent")];
        let reply = sent.as_mut().ok_or_else(|| self.closed())?.poll();
        if !matches!(reply, Ok(None)) {
            *sent = None;
        }
        reply
    }

    /// Drops a command whose reply nobody waits for any more.
    fn forget_command(&self, slot: Option<usize>) {
        if let Some(slot) = slot {
            self.shared.commands.lock().pending[slot] = None;
        }
    }

    /// A file descriptor that is readable when a frame may be unread, for `poll`, `epoll` and event loops. It also becomes
    /// readable when the client is closed. Call [`Show::receive`] until it returns `None`: that makes the descriptor
    /// unreadable again. It belongs to the client, and ends with it.
    ///
    /// The first call starts a thread that sleeps until frames arrive. The server is not affected.
    ///
    /// # Errors
    /// [`BusError::Failed`] where the descriptor or the thread cannot be created.
    pub fn descriptor(&self) -> Result<RawFd, BusError> {
        self.with_descriptor(|descriptor| Ok(descriptor.raw_fd()))
    }

    /// A copy of [`Show::descriptor`] that belongs to the caller, and stays open when another thread closes the client.
    ///
    /// # Errors
    /// As [`Show::descriptor`].
    pub fn descriptor_copy(&self) -> Result<OwnedFd, BusError> {
        self.with_descriptor(WakeDescriptor::copy)
    }

    /// Opens the descriptor, unless it is open, and uses it before another thread can close it.
    fn with_descriptor<T>(&self, take: impl FnOnce(&WakeDescriptor) -> io::Result<T>) -> Result<T, BusError> {
        let failed = |error| BusError::failed("the descriptor", error);
        let mut descriptor = self.shared.descriptor.lock().unwrap_or_else(PoisonError::into_inner);
        self.check()?;
        let descriptor = match &mut *descriptor {
            Some(descriptor) => descriptor,
            none => none.insert(WakeDescriptor::open(&self.shared.wake, &self.shared.is_closed).map_err(failed)?),
        };
        take(descriptor).map_err(failed)
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
        shared.wake.raise_for_all();
        drop(shared.descriptor.lock().unwrap_or_else(PoisonError::into_inner).take());
        shared.commands.lock().close();
        shared.alerts.lock().take();
        shared.events.lock().take();
        let mut readers = shared.readers.lock();
        shared.drop_returned(&mut readers);
        readers.ports = None;
    }

    fn open_alerts(&self) -> Result<(), BusError> {
        let Shared { domain, name, .. } = &*self.shared;
        self.check()?;
        let mut alerts = self.shared.alerts.lock();
        // Again behind the lock, so that nothing is opened after the closing.
        self.check()?;
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
        let ports = ports.as_mut().ok_or_else(|| self.closed())?;
        let Some(slot) = lent.iter().position(Option::is_none) else { return Err(BusError::TooManyFrames) };
        let read = read(&mut ports.frames);
        self.shared.lost.store(ports.frames.lost(), Relaxed);
        let read = read?;
        // A first frame too may be of another source than the one that ran when the client was opened.
        let begins = |frame: &Frame| matches!(frame.continuity(), Continuity::First | Continuity::Restarted);
        if read.as_ref().is_some_and(begins) {
            ports.connect();
        }
        Ok(read.map(|frame| LentFrame::of(lent[slot].insert(frame), slot, Arc::clone(&self.shared))))
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

impl Drop for Show {
    fn drop(&mut self) {
        self.close();
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
