//! Frames from another host onto a bus of this one, as a source like the server.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bench_dragon_ipc::service::frame_memory;
use bench_dragon_ipc::{BusError, Domain, HandleState, SourceLock};

use super::command_relay::{CommandRelay, MAX_ASKED};
use super::inbox::{Arrival, Inbox, Subscriptions, ask_for_description, subscribe};
use super::key_prefix::KeyPrefix;
use super::known_runs::{Description, KnownRuns, RunDecision};
use super::received_run::{ReceivedRun, Taken};
use super::report::{ReceiverSummary, Silence, ZenohReport};
use super::session::{BridgeError, BridgeSession, SessionError};
use super::wire::{Described, decode_alert, decode_frame};
use crate::output::histogram::LatencyHistogram;
use crate::source::take_instance;
use crate::system::clock::monotonic_ns;

/// How long nothing may happen before commands and signals are looked for.
const LOOK_PERIOD: Duration = Duration::from_millis(5);
/// How often the description of a run that is not known is asked for.
const ASK_PERIOD_NS: u64 = 200_000_000;
/// How long frames may fail to come before it is said; where they are sent more seldom, three times their period.
const SILENCE_NS: u64 = 2_000_000_000;
/// Frames, descriptions and alerts, of each kind, that are taken before commands and signals are looked for again.
const MAX_A_TURN: usize = 256;

/// A frame that has not as many benches as its run is described with.
#[derive(Clone, Copy, Debug)]
struct OtherDragon;

/// A receiving bridge.
#[derive(Debug)]
pub struct ReceivingBridge {
    domain: Domain,
    prefix: KeyPrefix,
    inbox: Arc<Inbox>,
    relay: CommandRelay,
    // After the relay, whose commands are its services'.
    run: Option<ReceivedRun>,
    others: KnownRuns,
    /// Where the last frame was put.
    handles: Vec<HandleState>,
    silent: Option<Silence>,
    last_frame_ns: u64,
    asked_ns: u64,
    summary: ReceiverSummary,
    handling: LatencyHistogram,
    // Given up before the session that they are of.
    _subscriptions: Subscriptions,
    session: BridgeSession,
    // Given up last.
    _lock: SourceLock,
}

impl ReceivingBridge {
    /// Takes the instance and begins to listen to the other side. It stays on the thread that it was opened on.
    ///
    /// # Errors
    /// [`BusError::SourceRunning`] where a source runs on the instance,
    /// [`SessionError::Session`].
    pub fn open(domain: &Domain, session: BridgeSession, prefix: KeyPrefix) -> Result<Self, BridgeError> {
        let lock = take_instance(domain)?;
        let inbox = Arc::new(Inbox::of_this_thread(MAX_ASKED));
        let subscriptions = subscribe(&session.zenoh, &prefix, &inbox).map_err(SessionError::session)?;
        let receiver = Self {
            domain: domain.clone(),
            relay: CommandRelay::new(&prefix),
            prefix,
            inbox,
            run: None,
            others: KnownRuns::new(),
            handles: Vec::new(),
            silent: None,
            last_frame_ns: monotonic_ns(),
            asked_ns: 0,
            summary: ReceiverSummary::default(),
            handling: LatencyHistogram::default(),
            _subscriptions: subscriptions,
            session,
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
        mut tell: impl FnMut(ZenohReport) -> Result<(), Failed>,
    ) -> Result<ReceiverSummary, Failed> {
        while !stop.load(Ordering::Relaxed) {
            self.inbox.wait(LOOK_PERIOD);
            if self.inbox.take_news_of_source() {
                self.ask_for_description(monotonic_ns());
            }
            for _ in 0..MAX_A_TURN {
                let Some((described, toml)) = self.inbox.descriptions.pop() else { break };
                if let Some(line) = self.take_description(described, toml) {
                    tell(line)?;
                }
            }
            for _ in 0..MAX_A_TURN {
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

    /// The next description. Returns what is to be reported of it.
    fn take_description(&mut self, described: Described, toml: String) -> Option<ZenohReport> {
        if !self.others.hears(monotonic_ns()) {
            self.summary.too_fast += 1;
            return None;
        }
        if let Some(run) = self.run.as_mut().filter(|run| run.remote_run_id() == described.run_id) {
            run.describe(described);
            return None;
        }
        let is_new = self.others.describe(described, toml);
        is_new.then_some(ZenohReport::Found { remote_run_id: described.run_id, every: described.every })
    }

    fn take_frame(&mut self, arrival: &Arrival) -> Result<Option<ZenohReport>, BridgeError> {
        let Ok(header) = decode_frame(&arrival.payload.to_bytes(), &mut self.handles) else {
            self.summary.malformed += 1;
            return Ok(None);
        };
        let mut begun = None;
        if self.run.as_ref().is_none_or(|run| run.remote_run_id() != header.run_id) {
            let Ok(line) = self.begin(header.run_id, header.bench_count) else {
                self.summary.malformed += 1;
                return Ok(None);
            };
            begun = line;
        }
        let Some(run) = self.run.as_mut().filter(|run| run.remote_run_id() == header.run_id) else {
            self.summary.foreign += 1;
            return Ok(begun);
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
        let resumed =
            self.silent.take().map(|_| ZenohReport::Resumed { run_id: run.run_id(), lost: run.remote.lost() });
        Ok(begun.or(resumed))
    }

    /// Begins to receive a run, where its description is there and it is not one that is over. What the bus has no room for
    /// is reported, and counts as over.
    ///
    /// # Errors
    /// [`OtherDragon`] where a frame is not of as many benches as its run is described with.
    fn begin(&mut self, remote_run_id: u64, bench_count: u32) -> Result<Option<ZenohReport>, OtherDragon> {
        let now_ns = monotonic_ns();
        match self.others.decide(remote_run_id, bench_count, now_ns) {
            RunDecision::Next(described, toml) => {
                let begun = self.replace_run(described, toml, bench_count as usize);
                Ok(Some(begun.unwrap_or_else(|error| {
                    self.others.end(remote_run_id);
                    ZenohReport::Refused { remote_run_id, reason: error.to_string() }
                })))
            }
            RunDecision::Unknown => {
                self.ask_for_description(now_ns);
                Ok(None)
            }
            RunDecision::Barred => Ok(None),
            RunDecision::OtherDragon => Err(OtherDragon),
        }
    }

    /// The services of a run go before those of the next one come, or are taken over from readers that keep them open. Where
    /// the next one cannot begin, the one before begins again with its next frame, if it had to end at all.
    fn replace_run(&mut self, described: Described, toml: String, bench_count: usize) -> Result<ZenohReport, BusError> {
        let freed = self.run.as_ref().map_or(0, |run| frame_memory(run.bench_count));
        require_room(frame_memory(bench_count).saturating_sub(freed))?;
        let before = self.end_run();
        let run = match ReceivedRun::begin(&self.domain, described, toml, bench_count) {
            Ok(run) => run,
            Err(error) => {
                if let Some((described, toml)) = before {
                    self.others.describe(described, toml);
                }
                return Err(error);
            }
        };
        if let Some((before, _)) = before {
            self.others.end(before.run_id);
        }
        let line = ZenohReport::Receiving { run_id: run.run_id(), remote_run_id: described.run_id };
        self.summary.runs += 1;
        self.silent = None;
        self.run = Some(run);
        Ok(line)
    }

    /// Ends the run that is received. Returns what it was described as.
    fn end_run(&mut self) -> Option<Description> {
        let run = self.run.take()?;
        self.relay.give_up(run.position());
        let ended = run.finish();
        self.summary.frames += ended.frames;
        self.summary.lost += ended.lost;
        self.summary.alerts += ended.alerts;
        Some(ended.description)
    }

    fn ask_for_description(&mut self, now_ns: u64) {
        if now_ns - self.asked_ns < ASK_PERIOD_NS {
            return;
        }
        self.asked_ns = now_ns;
        if let Err(error) = ask_for_description(&self.session.zenoh, &self.prefix, &self.inbox) {
            tracing::warn!("the description is not asked for: {error}");
        }
    }

    fn take_alerts(&mut self) -> Result<(), BridgeError> {
        for _ in 0..MAX_A_TURN {
            let Some(payload) = self.inbox.alerts.pop() else { break };
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
            self.relay.pass_on(command, &self.session.zenoh, &self.inbox, run.position(), run.seen(now_ns), now_ns);
        }
        self.relay.give_back(&self.inbox, &run.remote, run.position(), now_ns);
    }

    /// Says once that frames have stopped, and once more where more is known of why.
    fn look_for_silence(&mut self) -> Option<ZenohReport> {
        let quiet_ns = monotonic_ns().saturating_sub(self.last_frame_ns);
        let silence_ns = self.run.as_ref().map_or(0, |run| run.period_ns().saturating_mul(3)).max(SILENCE_NS);
        if quiet_ns <= silence_ns || self.silent.is_some_and(|reason| reason != Silence::LinkOrSource) {
            return None;
        }
        let reason = if self.inbox.has_source() {
            Silence::LinkOrSource
        } else if self.session.is_connected() {
            Silence::NoSource
        } else {
            Silence::NoConnection
        };
        if self.silent == Some(reason) {
            return None;
        }
        self.silent = Some(reason);
        Some(ZenohReport::Silent { run_id: self.run.as_ref().map(ReceivedRun::run_id), reason })
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

/// Fails where so much shared memory is not free. Nothing is written for it, as a source does before it begins: whoever
/// reaches this bridge may have it asked, again and again, and memory that is taken even for a moment others miss.
fn require_room(needed: u64) -> Result<(), BusError> {
    let space = rustix::fs::statvfs("/dev/shm");
    // Where there is no bound, it says that there are no blocks at all.
    let bounded = space.ok().filter(|space| space.f_blocks > 0);
    let free = bounded.map_or(u64::MAX, |space| space.f_bavail.saturating_mul(space.f_frsize));
    if needed <= free { Ok(()) } else { Err(BusError::SharedMemoryFull { needed }) }
}
