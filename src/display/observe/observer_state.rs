//! The state of an observer: all data that it has read so far.

use std::sync::Arc;
use std::time::Duration;

use bench_dragon_ipc::guard::GuardLock;
use bench_dragon_ipc::source::{ShowLock, SourceLock};
use bench_dragon_ipc::{
    Alert, AlertKind, BusError, CommandEvent, Continuity, Description, Domain, Frame, FrameHeader, FrameSubscriber,
    ReaderReport, ReplayStatus, RunStart, ShowState, Status,
};

use super::clearance_memory::ClearanceMemory;
use super::contact::PastContact;
use super::current_run::CurrentRun;
use super::frame_statistics::FrameCounter;
use super::guard_situation::GuardSituation;
use super::members::Members;
use super::observer::Ports;
use super::planned_clearance::ClearancePlanner;
use super::recent_overruns::OverrunLog;
use super::snapshot::{FrameCopy, Snapshot, SourcePresence};
use crate::config::Config;
use crate::system::clock::monotonic_ns;

/// Period at which the observer checks whether the source's process exists, in nanoseconds.
const SOURCE_PERIOD_NS: u64 = 100_000_000;
/// Greatest number of frames read at a time, so that a reader that falls behind still shows snapshots.
const MOST_FRAMES: usize = 1_000;

/// The last snapshot, and the data that the next snapshots need.
#[derive(Debug, Default)]
pub struct ObserverState {
    /// The snapshot without its parts that depend on the run and the status. [`ObserverState::snapshot`] adds these.
    seen: Snapshot,
    /// The newest frame in shared memory, until it is copied.
    newest: Option<Frame>,
    run: Option<CurrentRun>,
    description: Option<Description>,
    /// The run whose description this version cannot read.
    unreadable_run: Option<u64>,
    /// The newest status. It may belong to another run than the newest frame.
    status: Option<Arc<Status>>,
    /// The run and the speed of the last order, in metres per show second.
    ordered: Option<(u64, f64)>,
    /// The run that began last, and its start.
    start: Option<(u64, RunStart)>,
    /// The newest status of a replay. It may belong to another run than the newest frame.
    replay: Option<ReplayStatus>,
    counter: FrameCounter,
    overruns: OverrunLog,
    source_asked_ns: u64,
    /// The guard's process at the last judgement.
    judged_guard_pid: Option<u32>,
    /// Whether to compute the planned clearance of each run.
    plans: bool,
    /// Whether to forecast contacts, on a thread of each run.
    forecasts: bool,
    /// Keeps the measured clearance beyond the end of this observer.
    memory: Option<ClearanceMemory>,
}

/// What the locks of an instance show of its source.
#[derive(Clone, Copy, Debug, Default)]
pub struct SourceFacts {
    /// Whether the process of a source exists.
    pub has_source: bool,
    /// Process id of the guard; `None` without one, or in another PID namespace.
    pub guard_pid: Option<u32>,
    /// Whether the `show` was killed, its server has ended, and no source has started since.
    pub has_lost_show: bool,
    /// Whether a `show` supervises the server.
    pub is_supervised: bool,
}

impl SourceFacts {
    fn of(domain: &Domain) -> Self {
        let has_source = SourceLock::holder(domain).is_some();
        Self {
            has_source,
            guard_pid: GuardLock::holder(domain),
            has_lost_show: !has_source && ShowLock::is_abandoned(domain),
            is_supervised: ShowLock::holder(domain).is_some(),
        }
    }
}

impl ObserverState {
    pub(super) fn new(instance: &str, now_ns: u64, plans: bool, memory: Option<ClearanceMemory>) -> Self {
        let seen = Snapshot { instance: instance.to_owned(), ..Snapshot::default() };
        Self { seen, counter: FrameCounter::new(now_ns), plans, forecasts: true, memory, ..Self::default() }
    }

    /// The state of an observer that starts no threads, on a bus that it reads since an instant with these members.
    pub fn without_threads(instance: &str, now_ns: u64, members: Members) -> Self {
        let mut state = Self { forecasts: false, ..Self::new(instance, now_ns, false, None) };
        state.can_read(Some(now_ns));
        state.meet(members);
        state
    }

    /// Counts a frame.
    pub fn count_frame(&mut self, header: &FrameHeader, continuity: Continuity, now_ns: u64) {
        self.counter.count(header, continuity, now_ns);
    }

    /// Waits for a frame, then reads and counts all available frames.
    pub(super) fn take_frames(&mut self, frames: &mut FrameSubscriber, wait: Duration) -> Result<(), BusError> {
        let mut next = frames.wait(wait)?;
        for _ in 0..MOST_FRAMES {
            let Some(frame) = next else { break };
            self.count_frame(frame.header(), frame.continuity(), monotonic_ns());
            self.newest = Some(frame);
            next = frames.receive()?;
        }
        Ok(())
    }

    /// Reads all other services, and derives the values of the newest frame.
    pub(super) fn renew(&mut self, ports: &Ports) -> Result<(), BusError> {
        if let Some(reports) = &ports.reports {
            while let Some(report) = reports.receive()? {
                self.take_report(report);
            }
        }
        if let Some(commands) = &ports.commands {
            while let Some(event) = commands.receive()? {
                self.take_event(event);
            }
        }
        if let Some(status) = ports.statuses.poll()? {
            self.take_status(status, monotonic_ns());
        }
        if let Some(replay) = &ports.replay
            && let Some(status) = replay.poll()?
        {
            self.replay = Some(status);
        }
        if let Some(description) = ports.descriptions.poll()? {
            self.take_description(description);
        }
        if let Some(frame) = self.newest.take() {
            let copy = FrameCopy { header: *frame.header(), handles: frame.handles().to_vec() };
            drop(frame);
            self.take_frame(copy, monotonic_ns());
        }
        // After frame and status, from which the age of a past alert follows.
        while let Some(alert) = ports.alerts.receive()? {
            self.take_alert(alert, monotonic_ns());
        }
        self.look_ahead();
        if let (Some(memory), Some(run)) = (&mut self.memory, &self.run) {
            memory.keep(run.run.run_id, &run.chart, run.least, monotonic_ns());
        }
        Ok(())
    }

    /// Takes the next report of a reader.
    pub fn take_report(&mut self, report: ReaderReport) {
        Arc::make_mut(&mut self.seen.readers).push(report);
    }

    /// Takes the next event of the record of commands.
    pub fn take_event(&mut self, event: CommandEvent) {
        self.ordered = event.ordered_mps().map(|speed_mps| (event.run_id, speed_mps)).or(self.ordered);
        self.start = event.run_start().map(|start| (event.run_id, start)).or(self.start);
        Arc::make_mut(&mut self.seen.commands).push(event);
    }

    /// Takes the newest status.
    pub fn take_status(&mut self, status: Status, now_ns: u64) {
        self.overruns.note(&status, now_ns);
        self.status = Some(Arc::new(status));
    }

    /// Takes the newest description.
    pub fn take_description(&mut self, description: Description) {
        self.description = Some(description);
    }

    /// Takes the next alert, after the frame and the status from which its age follows.
    pub fn take_alert(&mut self, alert: Alert, now_ns: u64) {
        self.note_contact(&alert, now_ns);
        Arc::make_mut(&mut self.seen.alerts).push(alert);
    }

    /// Takes the newest frame.
    pub fn take_frame(&mut self, frame: FrameCopy, now_ns: u64) {
        self.seen.frame = Some(Arc::new(frame));
        self.begin_run();
        self.seen.nearest = self.current_run().and_then(|(run, frame)| run.measure(&frame.header, &frame.handles));
        let touching = self.seen.nearest.filter(|pair| pair.clearance_m <= 0.0);
        if let (Some(pair), Some(header)) = (touching, self.seen.header()) {
            let (benches, time_s) = (pair.benches.map(|bench| bench as u64), header.show_time_s());
            self.seen.past_contact = Some(PastContact { benches, time_s, seen_ns: now_ns });
        }
    }

    /// Keeps a contact that a monitor reports. It finds contacts between two snapshots, and those before this observer joined.
    fn note_contact(&mut self, alert: &Alert, now_ns: u64) {
        if let (Some(AlertKind::Contact), Some(pair)) = (alert.alert_kind(), alert.pair()) {
            let Some(seen_ns) = self.instant_of(alert, now_ns) else { return };
            let (benches, time_s) = (pair.map(u64::from), alert.show_time_ns as f64 / 1e9);
            let is_newer = self.seen.past_contact.is_none_or(|past| past.seen_ns <= seen_ns);
            self.seen.past_contact =
                Some(PastContact { benches, time_s, seen_ns }).filter(|_| is_newer).or(self.seen.past_contact);
        }
    }

    /// Returns about when an alert was raised, in nanoseconds of `CLOCK_MONOTONIC`: now, less the periods of the ticks since then.
    /// `None` for an alert of an earlier run, of which only late joiners still hear.
    fn instant_of(&self, alert: &Alert, now_ns: u64) -> Option<u64> {
        let Some(header) = self.seen.header() else { return Some(now_ns) };
        let rate_hz = self.current_status().map_or(0, |status| status.rate_hz);
        let period_ns = 1_000_000_000_u64.checked_div(rate_hz.into()).unwrap_or(0);
        let age_ns = header.tick.saturating_sub(alert.tick).saturating_mul(period_ns);
        (header.run_id == alert.run_id).then(|| now_ns.saturating_sub(age_ns))
    }

    /// Updates the forecast. It changes while the head stands too, since the search continues.
    fn look_ahead(&mut self) {
        let (nearest, status) = (self.seen.nearest, self.current_status());
        let (ordered, start) = (self.ordered, self.start);
        let forecast = self.current_run().map(|(run, frame)| {
            let run_id = frame.header.run_id;
            let ordered_mps = ordered.filter(|(of_run, _)| *of_run == run_id).map(|(_, speed_mps)| speed_mps);
            let until_s = start.filter(|(of_run, _)| *of_run == run_id).and_then(|(_, start)| start.until_s);
            run.order(ordered_mps, until_s);
            run.look_ahead(&frame.header, nearest, status.as_deref())
        });
        (self.seen.forecast, self.seen.possible_contact) = forecast.unwrap_or_default();
    }

    /// Looks at the locks of the instance, if that is due, and judges the presence of its source.
    pub(super) fn look_at_source(&mut self, domain: &Domain, now_ns: u64) {
        if now_ns.saturating_sub(self.source_asked_ns) >= SOURCE_PERIOD_NS {
            self.source_asked_ns = now_ns;
            self.note_source(SourceFacts::of(domain));
        }
        self.judge(now_ns);
    }

    /// Notes what the locks show of the source.
    pub fn note_source(&mut self, facts: SourceFacts) {
        let SourceFacts { has_source, guard_pid, has_lost_show, is_supervised } = facts;
        (self.seen.has_source, self.seen.guard_pid) = (has_source, guard_pid);
        (self.seen.has_lost_show, self.seen.is_supervised) = (has_lost_show, is_supervised);
    }

    /// Judges the presence of the source at an instant.
    pub fn judge(&mut self, now_ns: u64) {
        self.judge_presence(now_ns);
        let is_live = self.seen.presence == SourcePresence::Live;
        if !is_live || self.judged_guard_pid != self.seen.guard_pid {
            self.seen.guarded_since_ns = now_ns;
        }
        self.judged_guard_pid = self.seen.guard_pid;
    }

    fn judge_presence(&mut self, now_ns: u64) {
        let Some(header) = self.seen.header() else { return };
        let age_ns = now_ns.saturating_sub(header.published_ns);
        if !matches!(self.seen.presence, SourcePresence::Failed { .. }) {
            let rate_hz = self.status.as_ref().map_or(0, |status| status.rate_hz);
            self.seen.presence = match SourcePresence::judge(age_ns, rate_hz, self.seen.has_source) {
                _ if self.has_ended() => SourcePresence::Ended { age_ns },
                presence => presence,
            };
        }
    }

    /// Whether the run of the newest frame has ended in order, according to that frame or the last status.
    fn has_ended(&self) -> bool {
        let frame = self.seen.header().and_then(FrameHeader::show_state);
        let status = self.current_status().and_then(|status| status.show_state());
        [frame, status].contains(&Some(ShowState::Ended))
    }

    /// The newest status, if it belongs to the run of the newest frame.
    fn current_status(&self) -> Option<Arc<Status>> {
        let run_id = self.seen.header()?.run_id;
        self.status.clone().filter(|status| status.run_id == run_id)
    }

    /// Records that the bus cannot be read.
    pub(super) fn fail(&mut self, error: &BusError) {
        self.seen.reading_since_ns = None;
        self.seen.presence = SourcePresence::Failed { reason: error.to_string() };
        self.newest = None;
    }

    /// Records that the bus is read since an instant, or with `None`, that it does not exist.
    pub(super) fn can_read(&mut self, since_ns: Option<u64>) {
        self.seen.reading_since_ns = since_ns;
        if matches!(self.seen.presence, SourcePresence::Failed { .. }) {
            self.seen.presence = SourcePresence::Waiting;
        }
    }

    /// Records the processes on the bus at the moment at which it was opened.
    pub(super) fn meet(&mut self, members: Members) {
        self.seen.members = Arc::new(members);
    }

    /// All that the observer shows at an instant.
    pub fn snapshot(&mut self, now_ns: u64) -> Snapshot {
        let (status, replay) = (self.current_status(), self.replay);
        let statistics = self.counter.statistics(now_ns).clone();
        let recent_overruns = status.as_deref().map(|status| self.overruns.recent(status)).unwrap_or_default();
        let hears_source = self.status.is_some();
        let seen = self.seen.clone();
        let mut snapshot = Snapshot { seen_ns: now_ns, hears_source, statistics, recent_overruns, ..seen };
        if let Some((run, frame)) = self.current_run() {
            snapshot.run = Some(Arc::clone(&run.run));
            snapshot.least = run.least;
            snapshot.chart = Some(Arc::clone(&run.chart));
            snapshot.plan = run.planner.as_ref().map(ClearancePlanner::latest);
            snapshot.clock = Some(run.clock(&frame.header));
            let guard = status.as_deref().map(|status| {
                let margin_m = run.run.config.tables().monitor.margin_m;
                let is_near_border = || run.run.is_too_near_at(frame.header.course_m);
                GuardSituation::of(status, &frame.header, snapshot.nearest, margin_m, run.play_end(), is_near_border)
            });
            snapshot.guard = guard.unwrap_or_default();
        }
        let run_id = snapshot.header().map(|header| header.run_id);
        let replay = replay.filter(|replay| Some(replay.run_id) == run_id);
        let start = self.start.filter(|(of_run, _)| Some(*of_run) == run_id);
        // A replay of a restarted run was not restarted itself.
        let is_restarted = replay.is_none() && start.is_some_and(|(_, start)| start.is_restarted);
        Snapshot { is_restarted, status, replay, ..snapshot }
    }

    /// Begins the run of the newest frame, once its description has arrived.
    fn begin_run(&mut self) {
        let Some(header) = self.seen.header().copied() else { return };
        if self.current_run().is_some() || self.unreadable_run == Some(header.run_id) {
            return;
        }
        let description = self.description.as_ref().filter(|description| description.run_id == header.run_id);
        match description.map(|description| Config::from_toml(&description.toml)) {
            Some(Ok(config)) => {
                match CurrentRun::begin(
                    config,
                    &header,
                    self.run.take(),
                    [self.plans, self.forecasts],
                    self.memory.as_ref(),
                ) {
                    Ok(run) => self.run = Some(run),
                    Err(error) => {
                        tracing::warn!("the run is shown without a forecast: cannot start a thread: {error}");
                        self.unreadable_run = Some(header.run_id);
                    }
                }
            }
            // A source of another version may send a description that this version cannot read. Then only its frames are shown.
            Some(Err(_)) => self.unreadable_run = Some(header.run_id),
            None => {}
        }
    }

    /// The run of the newest frame, and that frame.
    fn current_run(&mut self) -> Option<(&mut CurrentRun, &FrameCopy)> {
        let (run, frame) = (self.run.as_mut()?, self.seen.frame.as_ref()?);
        (run.run.run_id == frame.header.run_id).then_some((run, frame))
    }
}

#[cfg(test)]
mod tests {
    use super::super::ShowForecast;
    use super::*;

    fn see(state: &mut ObserverState, run_id: u64, toml: &str) -> Snapshot {
        state.description = Some(Description { run_id, toml: toml.to_owned() });
        let header = FrameHeader { run_id, ..FrameHeader::default() };
        state.take_frame(FrameCopy { header, handles: Vec::new() }, 7);
        state.look_ahead();
        state.snapshot(7)
    }

    #[test]
    fn a_run_with_an_unreadable_description_has_only_its_frames() {
        let mut state = ObserverState::new("dragon", 0, false, None);
        let toml = Config::load(None, |_| ()).expect("the paper's").to_toml();
        let known = see(&mut state, 1, &toml);
        assert!(known.run.is_some() && known.chart.is_some(), "{known:?}");
        assert_ne!(known.forecast, ShowForecast::Unknown);
        let unknown = see(&mut state, 2, "[carousel]\nhorses = 7\n");
        assert_eq!(unknown.frame.map(|frame| frame.header.run_id), Some(2));
        assert_eq!((unknown.forecast, unknown.least, unknown.chart), (ShowForecast::Unknown, None, None));
        assert_eq!((unknown.run.map(|run| run.run_id), state.unreadable_run), (None, Some(2)));
        assert_eq!(see(&mut state, 3, &toml).run.map(|run| run.run_id), Some(3));
    }
}
