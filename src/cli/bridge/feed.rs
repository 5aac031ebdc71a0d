//! The feed of a bridge: the newest frame of the bus at each due instant of the bridge's own rate.

use std::hint;
use std::sync::Arc;
use std::time::Duration;

use bench_dragon_ipc::{
    BusError, Description, DescriptionReader, Domain, Frame, FrameHeader, FrameSubscriber, StatusReader,
};

use crate::bridge::{Freshness, LatestFrame, SourcePace, StaleAfter};
use crate::cli::bus_readers::{WAIT_PERIOD, open_when_there};
use crate::config::{NamedLayout, PlannedCues};
use crate::source::server::schedule::Schedule;
use crate::system::clock::{monotonic_ns, sleep_until};
use crate::system::stop::StopFlag;

/// Statuses that are read per frame sent: the present source's, and one that the last source may have left.
const MAX_STATUSES: usize = 4;

/// Settings of a feed.
#[derive(Clone, Copy, Debug)]
pub(super) struct FeedSettings {
    /// Frames that the bridge sends per second.
    pub(super) rate_hz: u32,
    /// The age from which a frame is stale.
    pub(super) stale_after: StaleAfter,
    /// How long the feed looks for a frame before and after its due instant in a busy loop; `None` if it takes the newest frame.
    pub(super) spin: Option<Duration>,
}

/// Polls the bus at a fixed rate, so that the server need not wake the bridge. After a server has ended, the feed repeats its
/// last frame as stale. It goes on with the next server's frames.
pub(super) struct Feed<'a> {
    stop: &'a StopFlag,
    frames: FrameSubscriber,
    status: StatusReader,
    dragons: NamedDragons,
    pace: SourcePace,
    schedule: Schedule,
    settings: FeedSettings,
    latest: Option<LatestFrame>,
    /// Whether the last frame has been sent as stale.
    has_left: bool,
}

/// The frame to send at a due instant of the bridge.
pub(super) struct DueFrame<'a> {
    pub(super) now_ns: u64,
    pub(super) latest: &'a LatestFrame,
    /// The names of its dragons.
    pub(super) dragons: &'a NamedLayout,
    /// The cues of its run.
    pub(super) cues: &'a Arc<PlannedCues>,
    /// Whether the bridge ends after it.
    pub(super) is_last: bool,
}

impl<'a> Feed<'a> {
    /// Waits for a server, and counts its periods from the instant at which it is found. `None` if a signal arrives first.
    pub(super) fn open(
        domain: &Domain,
        name: &str,
        settings: FeedSettings,
        stop: &'a StopFlag,
    ) -> Result<Option<Self>, BusError> {
        let open = || Ok((StatusReader::open(domain, name)?, FrameSubscriber::open(domain, name)?));
        let opened = open_when_there(domain.instance(), stop, open)?;
        Ok(opened.map(|(status, frames)| Self {
            stop,
            frames,
            status,
            dragons: NamedDragons::new(domain, name),
            pace: SourcePace::default(),
            schedule: Schedule::new(monotonic_ns(), settings.rate_hz),
            settings,
            latest: None,
            has_left: false,
        }))
    }

    /// Waits until a frame is due to be sent. After a signal, the last frame follows once more, as stale: receivers must
    /// not go on with its speeds. Then `None`.
    pub(super) fn next(&mut self) -> Result<Option<DueFrame<'_>>, BusError> {
        let now_ns = loop {
            if !self.sleep_until(self.schedule.due_ns()) {
                return Ok(self.farewell());
            }
            let now_ns = self.look()?;
            self.schedule.advance(now_ns);
            if self.latest.is_some() {
                break now_ns;
            }
        };
        let (dragons, cues) = (&self.dragons.names, &self.dragons.cues);
        Ok(self.latest.as_ref().map(|latest| DueFrame { now_ns, latest, dragons, cues, is_last: false }))
    }

    /// Waits until an instant, and takes the newest frame. `None` after a signal.
    pub(super) fn newest_at(&mut self, deadline_ns: u64) -> Result<Option<(u64, Option<&LatestFrame>)>, BusError> {
        if !self.sleep_until(deadline_ns) {
            return Ok(None);
        }
        let now_ns = self.look()?;
        Ok(Some((now_ns, self.latest.as_ref())))
    }

    /// Takes the newest frame from the bus, or the one that is due next. Returns the present.
    fn look(&mut self) -> Result<u64, BusError> {
        for _ in 0..MAX_STATUSES {
            let Some(status) = self.status.poll()? else { break };
            self.pace.note_rate(status.run_id, status.rate_hz);
        }
        self.take_newest()?;
        if let Some(spin) = self.settings.spin {
            self.take_due(spin.as_nanos() as u64)?;
        }
        let now_ns = monotonic_ns();
        if let Some(latest) = &mut self.latest {
            latest.freshness = self.pace.freshness(&latest.header, now_ns, self.settings.stale_after);
        }
        Ok(now_ns)
    }

    /// Takes the newest frame from the bus. Returns whether there is one that has not been read yet.
    fn take_newest(&mut self) -> Result<bool, BusError> {
        let newest = self.frames.latest()?;
        newest.map_or(Ok(false), |frame| self.take(&frame).map(|()| true))
    }

    fn take(&mut self, frame: &Frame) -> Result<(), BusError> {
        if self.dragons.are_of(frame.header())? {
            let latest = self.latest.get_or_insert_default();
            self.pace.note_frame(&latest.header, frame.header());
            latest.replace(frame);
        }
        Ok(())
    }

    /// Sleeps by the clock until the next frame is due, and takes it. If the source publishes it later, the source wakes the bridge.
    /// Does nothing if the frame is overdue already, or due only after the bridge's next period.
    fn take_due(&mut self, spin_ns: u64) -> Result<(), BusError> {
        let Some(latest) = &self.latest else { return Ok(()) };
        let Some(period) = self.pace.period_of(&latest.header) else { return Ok(()) };
        let due_ns = latest.header.scheduled_ns.saturating_add(period.as_nanos() as u64);
        let (now_ns, own_ns) = (monotonic_ns(), 1_000_000_000 / u64::from(self.settings.rate_hz));
        let is_next = (now_ns..now_ns + own_ns).contains(&due_ns.saturating_add(spin_ns));
        if !is_next || !self.sleep_until(due_ns.saturating_sub(spin_ns)) {
            return Ok(());
        }
        while !self.take_newest()? {
            if monotonic_ns() > due_ns + spin_ns {
                let late = self.frames.wait(period.min(Duration::from_nanos(own_ns)))?;
                return late.map_or(Ok(()), |frame| self.take(&frame));
            }
            hint::spin_loop();
        }
        Ok(())
    }

    fn farewell(&mut self) -> Option<DueFrame<'_>> {
        let now_ns = monotonic_ns();
        if std::mem::replace(&mut self.has_left, true) {
            return None;
        }
        let latest = self.latest.as_mut()?;
        latest.freshness = Freshness::Stale { age_ns: now_ns.saturating_sub(latest.header.published_ns) };
        Some(DueFrame { now_ns, latest, dragons: &self.dragons.names, cues: &self.dragons.cues, is_last: true })
    }

    /// Periods that the bridge missed because it was busy.
    pub(super) fn missed(&self) -> u64 {
        self.schedule.overruns()
    }

    /// Sleeps until an instant, in short pieces. Returns false after a signal.
    fn sleep_until(&self, deadline_ns: u64) -> bool {
        let piece_ns = WAIT_PERIOD.as_nanos() as u64;
        while !self.stop.is_set() {
            let now_ns = monotonic_ns();
            if now_ns >= deadline_ns {
                return true;
            }
            sleep_until(deadline_ns.min(now_ns + piece_ns));
        }
        false
    }
}

/// The names of the dragons of the present run. The description of a run arrives a little later than its first frames.
struct NamedDragons {
    domain: Domain,
    name: String,
    /// Opened for the first frame that needs names.
    descriptions: Option<DescriptionReader>,
    latest: Option<Description>,
    /// The run of the names.
    run_id: Option<u64>,
    names: NamedLayout,
    cues: Arc<PlannedCues>,
}

impl NamedDragons {
    fn new(domain: &Domain, name: &str) -> Self {
        let (domain, name) = (domain.clone(), format!("{name}-description"));
        Self {
            domain,
            name,
            descriptions: None,
            latest: None,
            run_id: None,
            names: NamedLayout::default(),
            cues: Arc::default(),
        }
    }

    /// Takes the names of the dragons of a frame. Returns whether they are known: without them, its poses have no addresses.
    fn are_of(&mut self, header: &FrameHeader) -> Result<bool, BusError> {
        if self.run_id == Some(header.run_id) {
            return Ok(true);
        }
        let (mut names, mut cues) = (NamedLayout::default(), Arc::default());
        if header.is_plan == 1 {
            let descriptions = match &mut self.descriptions {
                Some(descriptions) => descriptions,
                none => none.insert(DescriptionReader::open(&self.domain, &self.name)?),
            };
            while let Some(description) = descriptions.poll()? {
                self.latest = Some(description);
            }
            let Some(description) = self.latest.as_ref().filter(|latest| latest.run_id == header.run_id) else {
                return Ok(false);
            };
            names = NamedLayout::of_toml(&description.toml);
            cues = Arc::new(PlannedCues::of_toml(&description.toml));
        }
        (self.run_id, self.names, self.cues) = (Some(header.run_id), names, cues);
        Ok(true)
    }
}
