//! Frames from another host onto a bus of this one, as a source like the server.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::error::BridgeError;
use super::inbox::{Arrival, Inbox};
use super::keys::KeyPrefix;
use super::line::{ReceiverSummary, Silence, ZenohLine};
use super::link::Link;
use super::link_error::LinkError;
use super::rate_limit::RateLimit;
use super::received_run::{ReceivedRun, Taken};
use super::relay::{MAX_ASKED, Relay};
use super::subscriptions::{Subscriptions, ask_for_description, subscribe};
use super::wire::{Described, decode_alert, decode_frame};
use crate::clock::monotonic_ns;
use crate::histogram::LatencyHistogram;
use bench_dragon_ipc::{Domain, HandleState, SourceLock};

/// How long nothing may happen before commands and signals are looked for.
const LOOK_PERIOD: Duration = Duration::from_millis(5);
/// How often the description of a run that is not known is asked for.
const ASK_PERIOD_NS: u64 = 200_000_000;
/// How long frames may fail to come before it is said; where they are sent more seldom, three times their period.
const SILENCE_NS: u64 = 2_000_000_000;
/// Frames that are taken before commands and signals are looked for again.
const MAX_FRAMES_A_TURN: usize = 256;
/// Descriptions that are kept: of the run that is, and of those that may follow.
const MAX_DESCRIPTIONS: usize = 4;
/// Runs that are remembered to be over, so that two sources under one key do not take turns.
const MAX_PAST_RUNS: usize = 64;

/// A receiving bridge.
#[derive(Debug)]
pub struct Receiver {
    domain: Domain,
    prefix: KeyPrefix,
    inbox: Arc<Inbox>,
    relay: Relay,
    // After the relay, whose commands are its services'.
    run: Option<ReceivedRun>,
    descriptions: Vec<(Described, String)>,
    past_runs: Vec<u64>,
    /// New runs: each takes services of its own.
    run_limit: RateLimit,
    /// Where the last frame was put.
    handles: Vec<HandleState>,
    silent: Option<Silence>,
    last_frame_ns: u64,
    asked_ns: u64,
    summary: ReceiverSummary,
    handling: LatencyHistogram,
    // Given up before the session that they are of.
    _subscriptions: Subscriptions,
    link: Link,
    // Given up last.
    _lock: SourceLock,
}

impl Receiver {
    /// Takes the instance and begins to listen to the other side. It stays on the thread that it was opened on.
    ///
    /// # Errors
    /// [`BusError::SourceRunning`](bench_dragon_ipc::BusError::SourceRunning) where a source runs on the instance,
    /// [`LinkError::Session`].
    pub fn open(domain: &Domain, link: Link, prefix: KeyPrefix) -> Result<Self, BridgeError> {
        let lock = SourceLock::take(domain)?;
        for path in lock.cleared() {
            tracing::warn!("removed {}, which a killed server had left half made", path.display());
        }
        let inbox = Arc::new(Inbox::of_this_thread(MAX_ASKED));
        let subscriptions = subscribe(&link.session, &prefix, &inbox).map_err(LinkError::session)?;
        let receiver = Self {
            domain: domain.clone(),
            relay: Relay::new(&prefix),
            prefix,
            inbox,
            run: None,
            descriptions: Vec::new(),
            past_runs: Vec::new(),
            run_limit: RateLimit::new(1, 4),
            handles: Vec::new(),
            silent: None,
            last_frame_ns: monotonic_ns(),
            asked_ns: 0,
            summary: ReceiverSummary::default(),
            handling: LatencyHistogram::new(),
            _subscriptions: subscriptions,
            link,
            _lock: lock,
        };
        Ok(receiver)
    }

    /// Puts on the bus what comes, until `stop` is set.
    ///
    /// # Errors
    /// Where the bus takes no more, or `tell` fails.
    pub fn run<Failed: From<BridgeError>>(
        mut self,
        stop: &AtomicBool,
        mut tell: impl FnMut(ZenohLine) -> Result<(), Failed>,
    ) -> Result<ReceiverSummary, Failed> {
        while !stop.load(Ordering::Relaxed) {
            self.inbox.wait(LOOK_PERIOD);
            if self.inbox.take_news_of_source() {
                self.ask_for_description(monotonic_ns());
            }
            while let Some((described, toml)) = self.inbox.descriptions.pop() {
                if let Some(line) = self.take_description(described, toml) {
                    tell(line)?;
                }
            }
            for _ in 0..MAX_FRAMES_A_TURN {
                let Some(arrival) = self.inbox.frames.pop() else { break };
                if let Some(line) = self.take_frame(&arrival)? {
                    tell(line)?;
                }
            }
            self.take_alerts()?;
            self.serve_clients();
            if let Some(line) = self.look_for_silence() {
                tell(line)?;
            }
        }
        Ok(self.finish())
    }

    /// The next description. Returns what is to be told of it.
    fn take_description(&mut self, described: Described, toml: String) -> Option<ZenohLine> {
        if let Some(run) = self.run.as_mut().filter(|run| run.remote_run_id() == described.run_id) {
            run.describe(described);
            return None;
        }
        let known = self.descriptions.iter().position(|(known, _)| known.run_id == described.run_id);
        if let Some(index) = known {
            self.descriptions[index] = (described, toml);
            return None;
        }
        if self.past_runs.contains(&described.run_id) {
            return None;
        }
        if self.descriptions.len() == MAX_DESCRIPTIONS {
            self.descriptions.remove(0);
        }
        self.descriptions.push((described, toml));
        Some(ZenohLine::Found { remote_run_id: described.run_id, every: described.every })
    }

    fn take_frame(&mut self, arrival: &Arrival) -> Result<Option<ZenohLine>, BridgeError> {
        let Ok(header) = decode_frame(&arrival.payload.to_bytes(), &mut self.handles) else {
            self.summary.malformed += 1;
            return Ok(None);
        };
        let mut begun = None;
        if self.run.as_ref().is_none_or(|run| run.remote_run_id() != header.run_id) {
            begun = self.begin(header.run_id, header.bench_count as usize)?;
        }
        let Some(run) = self.run.as_mut().filter(|run| run.remote_run_id() == header.run_id) else {
            self.summary.foreign += 1;
            return Ok(None);
        };
        let refused = match run.take(&header, &self.handles, arrival.arrived_ns)? {
            Taken::Published => None,
            Taken::NotNew => Some(&mut self.summary.not_new),
            Taken::TooFast => Some(&mut self.summary.too_fast),
            Taken::OtherDragon => Some(&mut self.summary.malformed),
        };
        if let Some(count) = refused {
            *count += 1;
            return Ok(begun);
        }
        let now_ns = monotonic_ns();
        self.handling.record(now_ns - arrival.arrived_ns);
        self.last_frame_ns = now_ns;
        let resumed = self.silent.take().map(|_| ZenohLine::Resumed { run_id: run.run_id(), lost: run.lost() });
        Ok(begun.or(resumed))
    }

    /// Begins to receive a run, where its description is there and it is not one that is over.
    fn begin(&mut self, remote_run_id: u64, bench_count: usize) -> Result<Option<ZenohLine>, BridgeError> {
        if self.past_runs.contains(&remote_run_id) {
            return Ok(None);
        }
        let now_ns = monotonic_ns();
        let Some(index) = self.descriptions.iter().position(|(described, _)| described.run_id == remote_run_id) else {
            self.ask_for_description(now_ns);
            return Ok(None);
        };
        if !self.run_limit.allows(now_ns) {
            return Ok(None);
        }
        let (described, toml) = self.descriptions.swap_remove(index);
        self.end_run();
        let run = ReceivedRun::begin(&self.domain, described, &toml, bench_count)?;
        let line = ZenohLine::Receiving { run_id: run.run_id(), remote_run_id };
        self.summary.runs += 1;
        self.silent = None;
        self.run = Some(run);
        Ok(Some(line))
    }

    /// The services of a run go before those of the next one come, or are taken over from readers that keep them open.
    fn end_run(&mut self) {
        let Some(run) = self.run.take() else { return };
        self.relay.give_up(run.place());
        if self.past_runs.len() == MAX_PAST_RUNS {
            self.past_runs.remove(0);
        }
        self.past_runs.push(run.remote_run_id());
        let ended = run.finish();
        self.summary.frames += ended.frames;
        self.summary.lost += ended.lost;
        self.summary.alerts += ended.alerts;
    }

    fn ask_for_description(&mut self, now_ns: u64) {
        if now_ns - self.asked_ns < ASK_PERIOD_NS {
            return;
        }
        self.asked_ns = now_ns;
        if let Err(error) = ask_for_description(&self.link.session, &self.prefix, &self.inbox) {
            tracing::warn!("the description is not asked for: {error}");
        }
    }

    fn take_alerts(&mut self) -> Result<(), BridgeError> {
        while let Some(payload) = self.inbox.alerts.pop() {
            let Ok(alert) = decode_alert(&payload.to_bytes()) else {
                self.summary.malformed += 1;
                continue;
            };
            match self.run.as_mut().filter(|run| run.remote_run_id() == alert.run_id) {
                Some(run) => self.summary.too_fast += u64::from(!run.take_alert(alert)?),
                None => self.summary.foreign += 1,
            }
        }
        Ok(())
    }

    fn serve_clients(&mut self) {
        let Some(run) = &mut self.run else { return };
        let now_ns = monotonic_ns();
        run.report_alive();
        while let Some(command) = run.take_command() {
            self.relay.pass_on(command, &self.link.session, &self.inbox, run.place(), now_ns);
        }
        self.relay.give_back(&self.inbox, run.remote(), run.place(), now_ns);
    }

    /// Says once that frames have stopped, and once more where more is known of why.
    fn look_for_silence(&mut self) -> Option<ZenohLine> {
        let quiet_ns = monotonic_ns().saturating_sub(self.last_frame_ns);
        let silence_ns = self.run.as_ref().map_or(0, |run| run.period_ns().saturating_mul(3)).max(SILENCE_NS);
        if quiet_ns <= silence_ns || self.silent.is_some_and(|reason| reason != Silence::LinkOrSource) {
            return None;
        }
        let reason = if self.inbox.has_source() {
            Silence::LinkOrSource
        } else if self.link.is_connected() {
            Silence::NoSource
        } else {
            Silence::NoConnection
        };
        if self.silent == Some(reason) {
            return None;
        }
        self.silent = Some(reason);
        Some(ZenohLine::Silent { run_id: self.run.as_ref().map(ReceivedRun::run_id), reason })
    }

    fn finish(mut self) -> ReceiverSummary {
        self.end_run();
        ReceiverSummary {
            dropped: self.inbox.frames.dropped(),
            malformed: self.summary.malformed + self.inbox.malformed(),
            too_fast: self.summary.too_fast + self.inbox.alerts.dropped() + self.inbox.descriptions.dropped(),
            commands: self.relay.sent(),
            handling_us: self.handling.percentiles(),
            ..self.summary
        }
    }
}
