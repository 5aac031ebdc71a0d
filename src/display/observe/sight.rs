//! What an observer knows so far.

use std::sync::Arc;
use std::time::Duration;

use bench_dragon_geometry::clearance::PairClearance;
use bench_dragon_ipc::{BusError, Description, Domain, Frame, FrameSubscriber, ShowState, SourceLock, Status};

use super::alert_log::AlertLog;
use super::command_history::CommandHistory;
use super::guard_situation::GuardSituation;
use super::link::Link;
use super::outlook::Outlook;
use super::ports::Ports;
use super::reader_log::ReaderLog;
use super::scene::{Scene, Still};
use super::traffic::TrafficCount;
use super::watched_run::WatchedRun;
use crate::config::Config;
use crate::system::clock::monotonic_ns;

/// How often it is asked whether the source's process is there, in nanoseconds.
const SOURCE_PERIOD_NS: u64 = 100_000_000;
/// Frames that are taken at a time at most, so that a reader that falls behind still shows something.
const MOST_FRAMES: usize = 1_000;

/// All that has been seen.
#[derive(Debug)]
pub(super) struct Sight {
    link: Link,
    /// The newest frame, in shared memory, until it has been copied.
    newest: Option<Frame>,
    still: Option<Arc<Still>>,
    run: Option<WatchedRun>,
    description: Option<Description>,
    /// The run whose description this version cannot read.
    unreadable_run: Option<u64>,
    nearest: Option<PairClearance>,
    outlook: Outlook,
    status: Option<Arc<Status>>,
    traffic: TrafficCount,
    alerts: Arc<AlertLog>,
    readers: Arc<ReaderLog>,
    commands: Arc<CommandHistory>,
    /// Since when the bus is read, in nanoseconds of `CLOCK_MONOTONIC`.
    reading_since_ns: Option<u64>,
    source_is_there: bool,
    source_asked_ns: u64,
    /// Whether the clearance over each run is planned.
    plans: bool,
}

impl Sight {
    pub(super) fn new(now_ns: u64, plans: bool) -> Self {
        Self {
            link: Link::Waiting,
            newest: None,
            still: None,
            run: None,
            description: None,
            unreadable_run: None,
            nearest: None,
            outlook: Outlook::Unknown,
            status: None,
            traffic: TrafficCount::new(now_ns),
            alerts: Arc::default(),
            readers: Arc::default(),
            commands: Arc::default(),
            reading_since_ns: None,
            source_is_there: false,
            source_asked_ns: 0,
            plans,
        }
    }

    /// Waits for a frame, and counts it and all that are there by then.
    pub(super) fn take_frames(&mut self, frames: &mut FrameSubscriber, wait: Duration) -> Result<(), BusError> {
        let mut next = frames.wait(wait)?;
        for _ in 0..MOST_FRAMES {
            let Some(frame) = next else { break };
            self.traffic.count(frame.header(), frame.continuity(), monotonic_ns());
            self.newest = Some(frame);
            next = frames.receive()?;
        }
        Ok(())
    }

    /// Takes everything else that has come, and works out what follows from the newest frame.
    pub(super) fn renew(&mut self, ports: &Ports) -> Result<(), BusError> {
        while let Some(alert) = ports.alerts.receive()? {
            Arc::make_mut(&mut self.alerts).push(alert);
        }
        if let Some(reports) = &ports.reports {
            while let Some(report) = reports.receive()? {
                Arc::make_mut(&mut self.readers).push(report);
            }
        }
        if let Some(commands) = &ports.commands {
            while let Some(event) = commands.receive()? {
                Arc::make_mut(&mut self.commands).push(event);
            }
        }
        if let Some(status) = ports.statuses.poll()? {
            self.status = Some(Arc::new(status));
        }
        if let Some(description) = ports.descriptions.poll()? {
            self.description = Some(description);
        }
        if let Some(frame) = self.newest.take() {
            let still = Still { header: *frame.header(), handles: frame.handles().to_vec() };
            drop(frame);
            self.see(still);
        }
        self.look_ahead();
        Ok(())
    }

    /// Takes the newest frame.
    fn see(&mut self, still: Still) {
        self.still = Some(Arc::new(still));
        self.follow_run();
        self.nearest = self.current_run().and_then(|(run, still)| run.measure(&still.header, &still.handles));
    }

    /// Asks what lies ahead, also where the head stands: the search goes on.
    fn look_ahead(&mut self) {
        let (nearest, status) = (self.nearest, self.current_status());
        let outlook = self.current_run().map(|(run, still)| run.look_ahead(&still.header, nearest, status.as_deref()));
        self.outlook = outlook.unwrap_or_default();
    }

    /// Judges whether the source is there.
    pub(super) fn judge(&mut self, domain: &Domain, now_ns: u64) {
        if now_ns.saturating_sub(self.source_asked_ns) >= SOURCE_PERIOD_NS {
            self.source_asked_ns = now_ns;
            self.source_is_there = SourceLock::holder(domain).is_some();
        }
        let Some(still) = &self.still else { return };
        let age_ns = now_ns.saturating_sub(still.header.published_ns);
        if !matches!(self.link, Link::Failed { .. }) {
            let rate_hz = self.status.as_ref().map_or(0, |status| status.rate_hz);
            self.link = match Link::judge(age_ns, rate_hz, self.source_is_there) {
                _ if self.has_ended() => Link::Ended { age_ns },
                link => link,
            };
        }
    }

    /// Whether the run of the newest frame has ended in order: that frame says so, or the last status.
    fn has_ended(&self) -> bool {
        let frame = self.still.as_ref().and_then(|still| still.header.show_state());
        let status = self.current_status().and_then(|status| status.show_state());
        [frame, status].contains(&Some(ShowState::Ended))
    }

    /// The status, where it is of the run that the newest frame is of.
    fn current_status(&self) -> Option<Arc<Status>> {
        let run_id = self.still.as_ref()?.header.run_id;
        self.status.clone().filter(|status| status.run_id == run_id)
    }

    /// Takes note that the bus is read from now on.
    pub(super) fn begin_reading(&mut self, now_ns: u64) {
        self.reading_since_ns = Some(now_ns);
    }

    /// Takes note that the bus cannot be read.
    pub(super) fn fail(&mut self, error: &BusError) {
        self.reading_since_ns = None;
        self.link = Link::Failed { reason: error.to_string() };
        self.newest = None;
    }

    /// Takes note that the bus can be read, or could be if it were there.
    pub(super) fn can_read(&mut self) {
        if matches!(self.link, Link::Failed { .. }) {
            self.link = Link::Waiting;
        }
    }

    /// Everything, as it is now.
    pub(super) fn scene(&mut self, now_ns: u64) -> Scene {
        let (status, nearest) = (self.current_status(), self.nearest);
        let guard = self.current_run().zip(status.as_deref()).map(|((run, still), status)| {
            GuardSituation::of(status, &still.header, nearest, run.run.config.margin_m())
        });
        let current = self.current_run().map(|(run, still)| {
            (Arc::clone(&run.run), run.least, Arc::clone(&run.chart), run.plan(), run.clock(&still.header))
        });
        let (run, least, chart, plan, clock) = match current {
            Some((run, least, chart, plan, clock)) => (Some(run), least, Some(chart), plan, Some(clock)),
            None => (None, None, None, None, None),
        };
        Scene {
            seen_ns: now_ns,
            link: self.link.clone(),
            has_source: self.source_is_there,
            reading_since_ns: self.reading_since_ns,
            frame: self.still.clone(),
            run,
            nearest: self.nearest,
            least,
            outlook: self.outlook,
            chart,
            plan,
            clock,
            status,
            guard: guard.unwrap_or_default(),
            traffic: self.traffic.traffic(now_ns).clone(),
            alerts: Arc::clone(&self.alerts),
            readers: Arc::clone(&self.readers),
            commands: Arc::clone(&self.commands),
        }
    }

    /// Begins with the run that the newest frame is of, once its description is there.
    fn follow_run(&mut self) {
        let Some(header) = self.still.as_ref().map(|still| still.header) else { return };
        if self.current_run().is_some() || self.unreadable_run == Some(header.run_id) {
            return;
        }
        let description = self.description.as_ref().filter(|description| description.run_id == header.run_id);
        match description.map(|description| Config::from_toml(&description.toml)) {
            Some(Ok(config)) => match WatchedRun::begin(config, &header, self.run.take(), self.plans) {
                Ok(run) => self.run = Some(run),
                Err(error) => {
                    tracing::warn!("the run is shown without what lies ahead: cannot start a thread: {error}");
                    self.unreadable_run = Some(header.run_id);
                }
            },
            // A source of another version describes what this one may not know: then the frames are shown without it.
            Some(Err(_)) => self.unreadable_run = Some(header.run_id),
            None => {}
        }
    }

    /// The run that the newest frame is of, and that frame.
    fn current_run(&mut self) -> Option<(&mut WatchedRun, &Still)> {
        let (run, still) = (self.run.as_mut()?, self.still.as_ref()?);
        (run.run.run_id == still.header.run_id).then_some((run, still))
    }
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::FrameHeader;

    use super::*;
    use crate::config::Overrides;

    fn see(sight: &mut Sight, run_id: u64, toml: &str) -> Scene {
        sight.description = Some(Description { run_id, toml: toml.to_owned() });
        sight.see(Still { header: FrameHeader { run_id, ..FrameHeader::default() }, handles: Vec::new() });
        sight.look_ahead();
        sight.scene(7)
    }

    #[test]
    fn of_a_run_that_cannot_be_read_nothing_is_said_but_its_frames() {
        let mut sight = Sight::new(0, false);
        let toml = Config::load(None, Overrides::default()).expect("the paper's").to_toml();
        let known = see(&mut sight, 1, &toml);
        assert!(known.run.is_some() && known.chart.is_some(), "{known:?}");
        assert_ne!(known.outlook, Outlook::Unknown);
        let unknown = see(&mut sight, 2, "[carousel]\nhorses = 7\n");
        assert_eq!(unknown.frame.map(|still| still.header.run_id), Some(2));
        assert_eq!((unknown.outlook, unknown.least, unknown.chart), (Outlook::Unknown, None, None));
        assert_eq!((unknown.run.map(|run| run.run_id), sight.unreadable_run), (None, Some(2)));
        assert_eq!(see(&mut sight, 3, &toml).run.map(|run| run.run_id), Some(3));
    }
}
