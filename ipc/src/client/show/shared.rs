//! State that a client shares with the frames that it has lent.

#![allow(unsafe_code, reason = "ports are dropped in one process only")]

use core::mem::ManuallyDrop;
use core::sync::atomic::Ordering::SeqCst;
use core::sync::atomic::{AtomicBool, AtomicU64};
use std::rc::Rc;
use std::sync::{Arc, Mutex};

use super::confined::Confined;
use crate::client::command_client::PendingReply;
use crate::client::{
    AlertSubscriber, CommandClient, CommandEventReader, Description, DescriptionReader, Frame, FrameSubscriber,
    StatusReader,
};
use crate::domain::{BusError, Domain, Process};
use crate::service::{MAX_ACTIVE_REQUESTS, MAX_BORROWED_FRAMES, Member, Role};
use crate::wake::{WakeDescriptor, WakePage};
use crate::wire::Status;

/// State that a client shares with the frames that it has lent.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) domain: Domain,
    pub(super) name: String,
    pub(super) process: Process,
    pub(super) is_closed: Arc<AtomicBool>,
    pub(super) wake: Arc<WakePage>,
    pub(super) descriptor: Mutex<Option<WakeDescriptor>>,
    /// Slots whose frame was released. The next read drops the sample.
    pub(super) returned: [AtomicBool; MAX_BORROWED_FRAMES],
    pub(super) lost: AtomicU64,
    // Never dropped in a forked child.
    pub(super) readers: ManuallyDrop<Confined<Readers>>,
    pub(super) alerts: ManuallyDrop<Confined<Option<AlertSubscriber>>>,
    pub(super) events: ManuallyDrop<Confined<Option<CommandEventReader>>>,
    pub(super) commands: ManuallyDrop<Confined<Commands>>,
}

/// The client of commands, and the commands whose reply has not arrived, which share its state.
#[derive(Debug, Default)]
pub(super) struct Commands {
    pub(super) pending: [Option<PendingReply>; MAX_ACTIVE_REQUESTS],
    pub(super) client: Option<CommandClient>,
}

impl Commands {
    pub(super) fn close(&mut self) {
        *self = Self::default();
    }
}

/// The ports of one member, which are read without waiting. Samples share the member's state, so they are behind the same
/// lock.
#[derive(Debug)]
pub(super) struct Readers {
    pub(super) lent: [Option<Frame>; MAX_BORROWED_FRAMES],
    /// `None` after the client was closed.
    pub(super) ports: Option<ReaderPorts>,
}

#[derive(Debug)]
pub(super) struct ReaderPorts {
    pub(super) frames: FrameSubscriber,
    pub(super) descriptions: DescriptionReader,
    pub(super) description: Option<Description>,
    pub(super) statuses: StatusReader,
    pub(super) status: Option<Box<Status>>,
}

impl ReaderPorts {
    pub(super) fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        let member = Rc::new(Member::join(domain, name, Role::Client)?);
        Ok(Self {
            frames: FrameSubscriber::of(&member, domain, name)?,
            descriptions: DescriptionReader::of(&member)?,
            description: None,
            statuses: StatusReader::of(&member)?,
            status: None,
        })
    }

    /// Connects to the latest values of the next source, so that they can be read after its end even if nobody has read them
    /// before.
    pub(super) fn connect(&self) {
        self.descriptions.connect();
        self.statuses.connect();
    }
}

impl Shared {
    pub(super) fn new(domain: &Domain, name: &str, ports: ReaderPorts) -> Self {
        Self {
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
            events: ManuallyDrop::new(Confined::new(None)),
            commands: ManuallyDrop::new(Confined::new(Commands::default())),
        }
    }

    /// Marks a frame as released. Waits for no reader, unless the client is closed.
    pub(super) fn take_back(&self, slot: usize) {
        self.returned[slot].store(true, SeqCst);
        // After the closing, nobody reads any more.
        if self.is_closed.load(SeqCst) && self.process.is_this() {
            self.drop_returned(&mut self.readers.lock());
        }
    }

    /// Drops the samples of released frames.
    pub(super) fn drop_returned(&self, readers: &mut Readers) {
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
                ManuallyDrop::drop(&mut self.events);
                ManuallyDrop::drop(&mut self.readers);
            }
        }
    }
}
