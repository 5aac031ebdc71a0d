//! Those who watch the show: an observer with its lamps, and a bridge.

use std::rc::Rc;

use bench_dragon::bridge::Freshness;
use bench_dragon::display::observe::{Lamp, LampLevel, Members, SourceFacts};
use bench_dragon_ipc::{Alert, ReaderReport};

use super::{Event, MS_NS, World};
use crate::frame::BusFrame;
use crate::observer::{Bridge, ObserverProcess, lamp, members};
use crate::promises::Promise;
use crate::scenario::SECOND_NS;

/// Period of the observer's snapshots, and of the bridge.
pub(super) const OBSERVE_NS: u64 = 250 * MS_NS;
pub(super) const BRIDGE_NS: u64 = 90 * MS_NS;
/// Longest silence of a reader whose lamp is good: the limit of the lamps, a period of the reports, and looks.
const LONGEST_READER_SILENCE_NS: u64 = 4800 * MS_NS;
/// Longest silence of a server whose lamp is good, beside its periods.
const LONGEST_SERVER_SILENCE_NS: u64 = 1100 * MS_NS;
/// Longest silence of a timecode whose lamp is good.
const LONGEST_TIMECODE_SILENCE_NS: u64 = 2000 * MS_NS;
/// Distance of two frames after which the server stood still.
const BREAK_NS: u64 = 700 * MS_NS;
/// Longest time until the status has what a server knows, beside its periods.
const STATUS_NS: u64 = 200 * MS_NS;
/// Time without a fault after which no lamp is red.
const CALM_NS: u64 = 10 * SECOND_NS;
/// Least age of a stale frame, and greatest age of a fresh one beside its periods.
const STALE_NS: u64 = 300 * MS_NS;

/// The observer, the bridge, and what is known of the parts that they watch.
#[derive(Debug)]
pub(super) struct Watch {
    pub(super) observer: ObserverProcess,
    bridge: Bridge,
    /// Alerts that the observer has not read.
    pub(super) alerts: Vec<Alert>,
    /// Instants at which a monitor and a recorder last read frames.
    pub(super) monitored_ns: u64,
    pub(super) recorded_ns: u64,
    /// Instant at which a guard was last there.
    guarded_ns: u64,
    pub(super) heard_timecode_ns: u64,
    /// Instant at which the newest frame was published, and that since which frames have followed each other without a break.
    published_ns: u64,
    unbroken_since_ns: u64,
    /// Instant up to which a fault may have disturbed a process.
    disturbed_ns: u64,
}

impl Default for Watch {
    fn default() -> Self {
        Self {
            observer: ObserverProcess::new(Members::default(), 0),
            bridge: Bridge::default(),
            alerts: Vec::new(),
            monitored_ns: 0,
            recorded_ns: 0,
            guarded_ns: 0,
            heard_timecode_ns: 0,
            published_ns: 0,
            unbroken_since_ns: 0,
            disturbed_ns: 0,
        }
    }
}

impl Watch {
    pub(super) fn disturb(&mut self, until_ns: u64) {
        self.disturbed_ns = self.disturbed_ns.max(until_ns);
    }

    pub(super) fn deliver(&mut self, frame: &Rc<BusFrame>, now_ns: u64) {
        let header = &frame.header;
        if header.published_ns.saturating_sub(self.published_ns) > BREAK_NS {
            self.unbroken_since_ns = now_ns;
        }
        self.published_ns = header.published_ns;
        self.observer.deliver(frame, now_ns);
        self.bridge.deliver(frame);
    }

    pub(super) fn take_report(&mut self, report: Option<ReaderReport>) {
        if let Some(report) = report {
            self.observer.take_report(report);
        }
    }
}

impl World<'_> {
    /// Another observer begins. It knows only what it finds.
    pub(super) fn begin_observer(&mut self) {
        let monitors = self.guards.iter().filter(|guard| guard.has_joined).map(|guard| ("monitor", guard.life));
        let recorder =
            self.recorder.iter().filter(|recorder| recorder.has_joined).map(|recorder| ("record", recorder.life));
        let living: Vec<(&str, u64)> = monitors.chain(recorder).collect();
        let source = self.server.as_ref().map(|server| server.life);
        self.watch.observer = ObserverProcess::new(members(source, &living), self.now_ns);
        self.watch.alerts.clear();
    }

    pub(super) fn observe(&mut self) {
        self.after(OBSERVE_NS, Event::Observe);
        let now_ns = self.now_ns;
        let reads = |stopped_until_ns: u64, has_joined: bool| has_joined && stopped_until_ns <= now_ns;
        if self.guards.iter().any(|guard| reads(guard.stopped_until_ns, guard.has_joined)) {
            self.watch.monitored_ns = now_ns;
        }
        let recorder = self.recorder.as_ref();
        if recorder.is_some_and(|one| reads(one.stopped_until_ns, one.has_joined) && one.has_buffer()) {
            self.watch.recorded_ns = now_ns;
        }
        if self.guards.iter().any(|guard| guard.has_joined) {
            self.watch.guarded_ns = now_ns;
        }
        let guard_pid = self.guards.iter().find(|guard| guard.has_joined).map(|guard| guard.life as u32);
        let facts = SourceFacts {
            has_source: self.server.is_some(),
            guard_pid: guard_pid.filter(|_| self.scenario.is_guarded()),
            has_lost_show: false,
            is_supervised: true,
        };
        let alerts = std::mem::take(&mut self.watch.alerts);
        let lamps = self.watch.observer.look(self.status.as_ref(), &alerts, facts, &self.scenario.toml, now_ns);
        self.check_blind(&lamps);
        self.check_calm(&lamps);
    }

    fn period_ns(&self) -> u64 {
        SECOND_NS / u64::from(self.scenario.config.tables().serve.rate_hz)
    }

    /// Age of the newest frame.
    fn frame_age_ns(&self) -> Option<u64> {
        self.newest.as_ref().map(|header| self.now_ns.saturating_sub(header.published_ns))
    }

    /// Whether frames arrive.
    fn is_live(&self) -> bool {
        self.frame_age_ns().is_some_and(|age_ns| age_ns <= self.period_ns() + 50 * MS_NS)
    }

    /// Checks that the lamp of a part which is silent for too long is not good.
    fn check_blind(&mut self, lamps: &[Lamp]) {
        let (now_ns, periods_ns) = (self.now_ns, 2 * self.period_ns());
        let is_silent = |heard_ns: u64, longest_ns: u64| now_ns - heard_ns > longest_ns + periods_ns;
        let is_reader_silent = |heard_ns: u64| self.is_live() && is_silent(heard_ns, LONGEST_READER_SILENCE_NS);
        let is_server_silent =
            self.frame_age_ns().is_some_and(|age_ns| age_ns > LONGEST_SERVER_SILENCE_NS + 2 * periods_ns);
        let is_monitor_silent = is_reader_silent(self.watch.monitored_ns);
        // That a guard has ended is in the server's next status.
        let has_just_ended = self.watch.guarded_ns < now_ns && !is_silent(self.watch.guarded_ns, STATUS_NS);
        let is_guard_silent = is_monitor_silent && !has_just_ended;
        // A server that stood still could not notice, and publishes its status again only after its first frame.
        let is_timecode_silent = self.is_live()
            && is_silent(self.watch.unbroken_since_ns, LONGEST_TIMECODE_SILENCE_NS)
            && self.scenario.flags.timecode
            && is_silent(self.watch.heard_timecode_ns, LONGEST_TIMECODE_SILENCE_NS);
        let checks = [
            ("server", is_server_silent),
            ("monitor", is_monitor_silent),
            ("guard", is_guard_silent),
            ("recorder", is_reader_silent(self.watch.recorded_ns)),
            ("timecode", is_timecode_silent),
        ];
        for (name, is_blind) in checks {
            let lamp = lamp(lamps, name);
            self.promises.require(Promise::LampsAreTrue, now_ns, !is_blind || lamp.level != LampLevel::Good, || {
                format!("the part is silent for too long, and its lamp is {lamp:?}")
            });
        }
    }

    /// Checks that no lamp is red in a show without faults for some time, all of whose processes run.
    fn check_calm(&mut self, lamps: &[Lamp]) {
        let has_monitor = self.guards.iter().any(|guard| guard.has_joined && !guard.is_foreign);
        let has_recorder = self.recorder.as_ref().is_some_and(|recorder| recorder.has_joined);
        let is_whole = self.is_live() && has_monitor && (has_recorder || !self.scenario.has_recorder);
        let since_ns = self.watch.disturbed_ns.max(self.watch.observer.since_ns);
        if !is_whole || self.now_ns < since_ns + CALM_NS + 4 * self.period_ns() {
            return;
        }
        for name in ["server", "source", "monitor", "guard", "recorder"] {
            let lamp = lamp(lamps, name);
            self.promises.require(Promise::LampsAreCalm, self.now_ns, lamp.level != LampLevel::Danger, || {
                format!("all parts work, and a lamp is {lamp:?}")
            });
        }
    }

    pub(super) fn send_by_bridge(&mut self) {
        self.after(BRIDGE_NS, Event::Bridge);
        let now_ns = self.now_ns;
        let Some((header, freshness)) = self.watch.bridge.send(self.status.as_ref(), now_ns) else { return };
        let age_ns = now_ns.saturating_sub(header.published_ns);
        let is_described = self.status.as_ref().is_some_and(|status| status.run_id == header.run_id);
        let limit_ns = STALE_NS.max(3 * self.period_ns()) + MS_NS;
        let is_calm = self.is_live() && now_ns > self.watch.disturbed_ns + CALM_NS;
        let is_true = match freshness {
            Freshness::Fresh => !is_described || age_ns <= limit_ns,
            Freshness::Stale { .. } => age_ns > STALE_NS && !is_calm,
        };
        self.promises.require(Promise::StaleIsTrue, now_ns, is_true, || {
            format!("a frame of {age_ns} ns is sent as {freshness:?}")
        });
    }
}
