//! Reader of frames.

use core::time::Duration;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Instant;

use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::sample::Sample;

use super::continuity::{Continuity, ContinuityTracker};
use super::frame_schedule::FrameSchedule;
use super::report_publisher::ReportPublisher;
use super::source_state::{SourceState, SourceWatch, monotonic_ns};
use crate::domain::{BusError, Domain, Membership};
use crate::service::{FRAMES, Member, Role, Service};
use crate::wake::{self, DueWindow, Polled, WakePage};
use crate::wire::{BenchState, FrameHeader, HandleState};

/// Age of the last report, in report periods, from which a reader that always finds another frame sends a report before
/// it returns that frame.
const OVERDUE_PERIODS: u64 = 2;

/// Reads the frames of an instance, oldest first.
///
/// Only the caller of [`FrameSubscriber::wait`] waits, and the server wakes all waiting readers in one system call. A reader
/// that is too slow loses its own oldest frames, counts them, and never delays the server or another reader. A subscriber
/// outlives a server: the frames of the next server follow with [`Continuity::Restarted`].
///
/// A subscriber sends a [`ReaderReport`](crate::ReaderReport) about once a second, for programs that supervise the
/// readers. [`FrameSubscriber::receive`] sends it when no frame is unread, so that no frame waits for a report. Only a
/// reader that always finds another frame, and so is late already, sends it before it returns the frame. A report takes
/// about ten microseconds and one allocation; reading itself does not allocate. The times in the frames serve as its
/// clock. A report that cannot be sent has no effect on reading.
///
/// One thread uses a subscriber, the one that opened it; [`Show`](crate::Show) is for several threads.
#[derive(Debug)]
pub struct FrameSubscriber {
    // Dropped in this order: first the port that sends the last report, and all ports before their node.
    reports: ReportPublisher,
    subscriber: Subscriber<Service, [HandleState], FrameHeader>,
    member: Rc<Member>,
    wake: Arc<WakePage>,
    tracker: ContinuityTracker,
    source: SourceWatch,
    schedule: FrameSchedule,
}

impl FrameSubscriber {
    /// Opens the frames of a domain, under a node name that `iox2 node list` shows.
    ///
    /// # Errors
    /// [`BusError::NoServer`] where no source has published yet; else as [`Member::join`] and [`Member::frames`].
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        Self::of(&Rc::new(Member::join(domain, name, Role::Client)?), domain, name)
    }

    /// Opens the frames of a domain as one of several ports of a member.
    pub(crate) fn of(member: &Rc<Member>, domain: &Domain, name: &str) -> Result<Self, BusError> {
        let subscriber = member.subscribe(FRAMES, &member.frames()?)?;
        let wake = Arc::new(member.wake_page()?);
        let reports = ReportPublisher::open(member, name, subscriber.id().value());
        member.reserve_memory()?;
        let (tracker, source) = (ContinuityTracker::default(), SourceWatch::new(domain));
        let schedule = FrameSchedule::default();
        Ok(Self { reports, subscriber, member: Rc::clone(member), wake, tracker, source, schedule })
    }

    /// Returns the oldest unread frame, or `None` if all are read. Never waits.
    ///
    /// # Errors
    /// [`BusError::Failed`] where the publisher's memory cannot be mapped, or where
    /// [`MAX_BORROWED_FRAMES`](crate::service::MAX_BORROWED_FRAMES) frames are already held.
    /// [`BusError::VersionMismatch`] for a frame whose handles contradict its header.
    pub fn receive(&mut self) -> Result<Option<Frame>, BusError> {
        let Some(sample) = self.subscriber.receive().map_err(|error| BusError::failed(FRAMES, error))? else {
            self.report(1);
            return Ok(None);
        };
        if !sample.user_header().has_handles(sample.payload().len()) {
            return Err(BusError::VersionMismatch { service: FRAMES });
        }
        self.report(OVERDUE_PERIODS);
        let continuity = self.tracker.track(sample.user_header());
        self.reports.count(sample.user_header(), self.tracker.lost());
        self.source.note(sample.user_header());
        self.schedule.note(sample.user_header());
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
        let mut latest = self.receive()?;
        while latest.is_some() && self.has_unread()? {
            // Released before the next frame is received, so that one frame is held at a time.
            drop(latest);
            latest = self.receive()?;
        }
        Ok(latest)
    }

    fn has_unread(&self) -> Result<bool, BusError> {
        self.subscriber.has_samples().map_err(|error| BusError::failed(FRAMES, error))
    }

    /// Returns the oldest unread frame. Waits for one at most `timeout` and then returns `None`. A signal ends the wait
    /// early.
    ///
    /// The wait lasts through a restart of the source. One system call of the source wakes all readers that wait; a source
    /// whose readers are awake makes none.
    ///
    /// # Errors
    /// As [`FrameSubscriber::receive`].
    pub fn wait(&mut self, timeout: Duration) -> Result<Option<Frame>, BusError> {
        let wake = Arc::clone(&self.wake);
        wake::wait(&*wake, timeout, || self.receive())
    }

    /// Does the same as [`FrameSubscriber::wait`], but knows from the frames that it has read when the next one is due. It sleeps by
    /// the clock until `spin` before that instant, then looks for the frame in a busy loop, at most until `spin` after it. So the
    /// frame is read without a wake-up of the kernel, and the source makes no system call for this reader. A frame that does not
    /// come in that time is waited for as by [`FrameSubscriber::wait`].
    ///
    /// It takes up to `spin` twice in each period of one processor; 100 µs is right for most machines. A reader whose processor is
    /// too busy for that, so that it misses eight frames one after the other, is woken for the next hundred frames.
    ///
    /// # Errors
    /// As [`FrameSubscriber::receive`].
    pub fn wait_until_due(&mut self, timeout: Duration, spin: Duration) -> Result<Option<Frame>, BusError> {
        let begun = Instant::now();
        if let Some(due_ns) = self.schedule.next_due_ns() {
            let (wake, window) = (Arc::clone(&self.wake), DueWindow { due_ns, spin, timeout });
            let Polled { found, is_punctual, is_interrupted } =
                wake::poll_when_due(&*wake, monotonic_ns, window, || self.receive())?;
            self.schedule.settle(is_punctual);
            if found.is_some() || is_interrupted {
                return Ok(found);
            }
        }
        self.wait(timeout.saturating_sub(begun.elapsed()))
    }

    /// The schedule of the source.
    pub(crate) fn schedule(&mut self) -> &mut FrameSchedule {
        &mut self.schedule
    }

    /// The page of the instance's wake word.
    pub(crate) fn wake_page(&self) -> &Arc<WakePage> {
        &self.wake
    }

    /// Returns whether the source publishes, and if not, why. Frames that this reader has not read yet do not count, so
    /// call it after [`FrameSubscriber::wait`] has returned `None`. `limit` is the age from which the newest frame that
    /// was read is too old: several periods of the source.
    pub fn source_state(&self, limit: Duration) -> SourceState {
        self.source.state(limit)
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

    /// Marks the reader's last report: the reader ends because its disk is full.
    pub fn set_disk_full(&mut self) {
        self.reports.set_disk_full();
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
    /// Values of the frame that concern the whole show, and its dragons.
    pub fn header(&self) -> &FrameHeader {
        self.sample.user_header()
    }

    /// The handles, dragon after dragon, each head first; for each dragon one more than its benches.
    pub fn handles(&self) -> &[HandleState] {
        self.sample.payload()
    }

    /// The benches, dragon after dragon, each head first. Those of one dragon: [`DragonMotion::benches`](crate::DragonMotion::benches).
    pub fn benches(&self) -> impl ExactSizeIterator<Item = BenchState> {
        self.header().benches(self.handles())
    }

    /// Relation of the frame to the previously received one.
    pub fn continuity(&self) -> Continuity {
        self.continuity
    }
}
