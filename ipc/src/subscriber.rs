//! Reading frames.

use core::time::Duration;
use std::sync::Arc;
use std::thread;

use iceoryx2::port::listener::{Listener, ListenerWaitError};
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::sample::Sample;

use crate::bench::BenchState;
use crate::continuity::{Continuity, ContinuityTracker};
use crate::domain::Domain;
use crate::error::BusError;
use crate::frame::{FrameHeader, HandleState};
use crate::membership::Membership;
use crate::report_publisher::ReportPublisher;
use crate::service::{FRAMES, Member, Role, Service};

/// Shorter waits are none: the socket behind a listener takes a timeout of 0 microseconds for no timeout at all.
pub(crate) const LEAST_WAIT: Duration = Duration::from_micros(1);

/// How often a reader looks for a source that is gone.
const LOOK_PERIOD: Duration = Duration::from_millis(20);

/// A reader that always finds another frame reports when it should have so many times.
const OVERDUE_PERIODS: u64 = 2;

/// Reads the frames of an instance, oldest first.
///
/// Who waits: nobody but the caller of [`FrameSubscriber::wait`]. A reader that does not keep up loses its own oldest
/// frames, counts them, and never delays the server or another reader. A subscriber outlives a server: the frames of
/// the next one follow with [`Continuity::Restarted`].
///
/// A subscriber tells how it fares, in a [`ReaderReport`](crate::ReaderReport) about once a second, for whoever watches over the
/// readers. It does so inside [`FrameSubscriber::receive`] where no frame is there to be read, so that none waits for a report;
/// only a reader that always finds another one, and so is late anyway, reports before it hands that out. A report takes about
/// ten microseconds and one allocation, nothing else of reading allocates; to tell the time it looks at the frames instead of a
/// clock. Where a report cannot be sent, nothing else is any different.
///
/// One thread uses a subscriber at a time.
#[derive(Debug)]
pub struct FrameSubscriber {
    // Dropped in this order: ports before the node that they belong to, and first the one that sends a last report.
    reports: ReportPublisher,
    subscriber: Subscriber<Service, [HandleState], FrameHeader>,
    listener: Option<Listener<Service>>,
    member: Member,
    tracker: ContinuityTracker,
}

impl FrameSubscriber {
    /// Opens the frames of a domain, under a node name that `iox2 node list` shows.
    ///
    /// # Errors
    /// [`BusError::NoServer`] where nothing has been published yet; the others as [`Member::frames`].
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        let member = Member::join(domain, name, Role::Client)?;
        let subscriber = member.frames()?.subscriber_builder().create().map_err(|error| {
            use iceoryx2::port::subscriber::SubscriberCreateError as Create;
            match error {
                Create::ExceedsMaxSupportedSubscribers => BusError::TooManyClients { service: FRAMES },
                error => BusError::failed(FRAMES, error),
            }
        })?;
        let reports = ReportPublisher::open(&member, name, subscriber.id().value());
        Ok(Self { reports, subscriber, listener: None, member, tracker: ContinuityTracker::default() })
    }

    /// The oldest frame that has not been read yet, or `None` where all are read. Never waits.
    ///
    /// # Errors
    /// [`BusError::Failed`] where the publisher's memory cannot be mapped or more than
    /// [`MAX_BORROWED_FRAMES`](crate::service::MAX_BORROWED_FRAMES) frames are held, and
    /// [`BusError::VersionMismatch`] for a frame whose number of handles is not its header's.
    pub fn receive(&mut self) -> Result<Option<Frame>, BusError> {
        let Some(sample) = self.subscriber.receive().map_err(|error| BusError::failed(FRAMES, error))? else {
            self.report(1);
            return Ok(None);
        };
        if sample.payload().len() != sample.user_header().bench_count as usize + 1 {
            return Err(BusError::VersionMismatch { service: FRAMES });
        }
        self.report(OVERDUE_PERIODS);
        let continuity = self.tracker.track(sample.user_header());
        self.reports.count(sample.user_header(), self.tracker.lost());
        Ok(Some(Frame { sample, _membership: self.member.membership(), continuity }))
    }

    /// Reports what has been read before, where the last report is so many periods old.
    fn report(&mut self, periods: u64) {
        if self.reports.is_due(periods) {
            self.reports.send();
        }
    }

    /// The newest frame; those before it are dropped unread and do not count as lost. Never waits.
    ///
    /// # Errors
    /// As [`FrameSubscriber::receive`].
    pub fn latest(&mut self) -> Result<Option<Frame>, BusError> {
        let mut latest = None;
        while let Some(frame) = self.receive()? {
            latest = Some(frame);
        }
        Ok(latest)
    }

    /// The oldest frame that has not been read yet, waiting for it at most `timeout`. A signal ends the wait early.
    ///
    /// The first call makes a listener, which costs the server a system call a frame; a reader that only polls does
    /// not. While no source runs, a wait may end early with nothing.
    ///
    /// # Errors
    /// As [`FrameSubscriber::receive`].
    pub fn wait(&mut self, timeout: Duration) -> Result<Option<Frame>, BusError> {
        if let Some(frame) = self.receive()? {
            return Ok(Some(frame));
        }
        if timeout < LEAST_WAIT {
            return Ok(None);
        }
        if self.listener.is_none() {
            match self.listen() {
                // A frame that was sent before there was a listener wakes nobody.
                Ok(()) => {
                    if let Some(frame) = self.receive()? {
                        return Ok(Some(frame));
                    }
                }
                // The source is gone, and what it left is kept by readers that only poll: nobody would wake this one.
                Err(error) if error.is_absent() => {
                    thread::sleep(timeout.min(LOOK_PERIOD));
                    return self.receive();
                }
                Err(error) => return Err(error),
            }
        }
        let listener = self.listener.as_ref().expect("made where it was missing");
        match listener.timed_wait(|_| (), timeout) {
            Ok(_) | Err(ListenerWaitError::InterruptSignal) => self.receive(),
            Err(error) => Err(BusError::failed(FRAMES, error)),
        }
    }

    fn listen(&mut self) -> Result<(), BusError> {
        let events = self.member.frame_events()?;
        self.listener = Some(events.listener_builder().create().map_err(|error| BusError::failed(FRAMES, error))?);
        Ok(())
    }

    /// Frames that were published between the first one read and the last, and that this reader never got.
    pub fn lost(&self) -> u64 {
        self.tracker.lost()
    }

    /// Tells how many bytes the reader has written by now of what it read, for its next report.
    pub fn set_bytes_written(&mut self, bytes: u64) {
        self.reports.set_bytes_written(bytes);
    }

    /// Sets how many seconds of wall time the reader's disk lasts, for its next report.
    pub fn set_room(&mut self, room_s: f64) {
        self.reports.set_room(room_s);
    }
}

/// A frame, borrowed from shared memory: nothing is copied, and nobody writes to it while it is held.
///
/// A reader may hold [`MAX_BORROWED_FRAMES`](crate::service::MAX_BORROWED_FRAMES) at a time.
#[derive(Debug)]
pub struct Frame {
    // Dropped in this order: a sample keeps its node, and a node must not outlast the membership.
    sample: Sample<Service, [HandleState], FrameHeader>,
    _membership: Arc<Membership>,
    continuity: Continuity,
}

impl Frame {
    /// What the frame says about the whole dragon.
    pub fn header(&self) -> &FrameHeader {
        self.sample.user_header()
    }

    /// The handles, head first, one more than there are benches.
    pub fn handles(&self) -> &[HandleState] {
        self.sample.payload()
    }

    /// The benches, head first.
    pub fn benches(&self) -> impl ExactSizeIterator<Item = BenchState> {
        BenchState::all(self.handles())
    }

    /// How the frame stands to the one received before it.
    pub fn continuity(&self) -> Continuity {
        self.continuity
    }
}
