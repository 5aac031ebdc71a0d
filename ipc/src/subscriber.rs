//! Reader of frames.

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

/// Least timeout; shorter waits return at once. The socket behind a listener treats a timeout of 0 microseconds as no
/// timeout.
pub(crate) const LEAST_WAIT: Duration = Duration::from_micros(1);

/// Period in which a reader looks for a source while none runs.
const LOOK_PERIOD: Duration = Duration::from_millis(20);

/// Age of the last report, in report periods, from which a reader that always finds another frame sends a report before
/// it returns that frame.
const OVERDUE_PERIODS: u64 = 2;

/// Reads the frames of an instance, oldest first.
///
/// Only the caller of [`FrameSubscriber::wait`] waits. A reader that is too slow loses its own oldest frames, counts
/// them, and never delays the server or another reader. A subscriber outlives a server: the frames of the next server
/// follow with [`Continuity::Restarted`].
///
/// A subscriber sends a [`ReaderReport`](crate::ReaderReport) about once a second, for programs that supervise the
/// readers. [`FrameSubscriber::receive`] sends it when no frame is unread, so that no frame waits for a report. Only a
/// reader that always finds another frame, and so is late already, sends it before it returns the frame. A report takes
/// about ten microseconds and one allocation; reading itself does not allocate. The times in the frames serve as its
/// clock. A report that cannot be sent has no effect on reading.
///
/// One thread uses a subscriber at a time.
#[derive(Debug)]
pub struct FrameSubscriber {
    // Dropped in this order: first the port that sends the last report, and all ports before their node.
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
    /// [`BusError::NoServer`] where no source has published yet; else as [`Member::join`] and [`Member::frames`].
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

    /// Returns the oldest unread frame, or `None` if all are read. Never waits.
    ///
    /// # Errors
    /// [`BusError::Failed`] where the publisher's memory cannot be mapped, or where
    /// [`MAX_BORROWED_FRAMES`](crate::service::MAX_BORROWED_FRAMES) frames are already held.
    /// [`BusError::VersionMismatch`] for a frame whose number of handles contradicts its header.
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

    /// Sends the report, if the last one is at least this many periods old.
    fn report(&mut self, periods: u64) {
        if self.reports.is_due(periods) {
            self.reports.send();
        }
    }

    /// Returns the newest unread frame, or `None` if all are read. Older frames are dropped unread and do not count as
    /// lost. Never waits.
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

    /// Returns the oldest unread frame. Waits for one at most `timeout` and then returns `None`. A signal ends the wait
    /// early.
    ///
    /// The first call creates a listener, which costs the server one system call per frame; a reader that only polls
    /// costs none. While no source runs, a wait may end early with `None`.
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
                // A frame that was sent before the listener existed does not wake it.
                Ok(()) => {
                    if let Some(frame) = self.receive()? {
                        return Ok(Some(frame));
                    }
                }
                // The source is gone, and readers that only poll keep its services. Nothing would wake this reader.
                Err(error) if error.is_absent() => {
                    thread::sleep(timeout.min(LOOK_PERIOD));
                    return self.receive();
                }
                Err(error) => return Err(error),
            }
        }
        let listener = self.listener.as_ref().expect("the listener was created above");
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

    /// Number of frames lost: published between the first and the last frame that this reader has read, but not received
    /// by it.
    pub fn lost(&self) -> u64 {
        self.tracker.lost()
    }

    /// Sets the total number of bytes that the reader has written, for its next report.
    pub fn set_bytes_written(&mut self, bytes: u64) {
        self.reports.set_bytes_written(bytes);
    }

    /// Sets the wall time in seconds until the reader's disk is full, for its next report.
    pub fn set_room(&mut self, room_s: f64) {
        self.reports.set_room(room_s);
    }
}

/// A frame, borrowed from shared memory. Nothing is copied, and no process writes to it while it is held.
///
/// A reader may hold up to [`MAX_BORROWED_FRAMES`](crate::service::MAX_BORROWED_FRAMES) frames at a time.
#[derive(Debug)]
pub struct Frame {
    // Dropped in this order: a sample keeps its node alive, and a node must not outlast the membership.
    sample: Sample<Service, [HandleState], FrameHeader>,
    _membership: Arc<Membership>,
    continuity: Continuity,
}

impl Frame {
    /// Values of the frame that concern the whole dragon.
    pub fn header(&self) -> &FrameHeader {
        self.sample.user_header()
    }

    /// The handles, head first; one more than there are benches.
    pub fn handles(&self) -> &[HandleState] {
        self.sample.payload()
    }

    /// The benches, head first.
    pub fn benches(&self) -> impl ExactSizeIterator<Item = BenchState> {
        BenchState::all(self.handles())
    }

    /// Relation of the frame to the previously received one.
    pub fn continuity(&self) -> Continuity {
        self.continuity
    }
}
