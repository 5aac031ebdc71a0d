//! Publishes frames from another host on a bus of this host, as a source like the server.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bench_dragon_ipc::service::frame_memory;
use bench_dragon_ipc::source::SourceLock;
use bench_dragon_ipc::{BusError, Domain, FrameHeader, HandleState};
use zenoh::pubsub::Subscriber;

use super::command_relay::{CommandRelay, MAX_ASKED};
use super::inbox::{Arrival, Inbox, ask_for_description, subscribe};
use super::key_prefix::KeyPrefix;
use super::known_runs::{Description, KnownRuns, RunDecision};
use super::received_run::ReceivedRun;
use super::report::{ReceiverSummary, Silence, ZenohReport};
use super::session::{BridgeError, BridgeSession};
use super::wire::{Described, decode_alert, decode_frame};
use crate::output::histogram::LatencyHistogram;
use crate::source::take_instance;
use crate::system::clock::monotonic_ns;

/// Longest wait for messages before the bridge checks for commands and signals.
const LOOK_PERIOD: Duration = Duration::from_millis(5);
/// Shortest time between two requests for the description of an unknown run.
const ASK_PERIOD_NS: u64 = 200_000_000;
/// The bridge reports silence after this time without a frame, or after three periods of the frames if these are longer.
const SILENCE_NS: u64 = 2_000_000_000;
/// Most frames that the bridge takes before it checks for commands and signals again. Likewise for descriptions and alerts.
const MAX_A_TURN: usize = 256;

/// A receiving bridge.
#[derive(Debug)]
pub struct ReceivingBridge {
    domain: Domain,
    prefix: KeyPrefix,
    inbox: Arc<Inbox>,
    relay: CommandRelay,
    // Dropped after the relay, whose commands belong to this run's services.
    run: Option<ReceivedRun>,
    others: KnownRuns,
    /// Handles of the last frame. The memory is reused.
    handles: Vec<HandleState>,
    silent: Option<Silence>,
    last_frame_ns: u64,
    asked_ns: u64,
    reports: Vec<ZenohReport>,
    summary: ReceiverSummary,
    handling: LatencyHistogram,
    // Dropped before their session.
    _subscribers: [Subscriber<()>; 4],
    session: BridgeSession,
    // Dropped last.
    _lock: SourceLock,
}

impl ReceivingBridge {
    /// Takes the instance's source lock and subscribes to the other host's messages. The bridge stays on the thread that opened
    /// it.
    ///
    /// # Errors
    /// [`BusError::SourceRunning`] if a source runs on the instance, and [`BridgeError::Session`].
    pub fn open(domain: &Domain, session: BridgeSession, prefix: KeyPrefix) -> Result<Self, BridgeError> {
        let lock = take_instance(domain)?;
        let inbox = Arc::new(Inbox::of_this_thread(MAX_ASKED));
        let subscribers = subscribe(&session.zenoh, &prefix, &inbox).map_err(BridgeError::session)?;
        Ok(Self {
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
            reports: Vec::new(),
            summary: ReceiverSummary::default(),
            handling: LatencyHistogram::default(),
            _subscribers: subscribers,
            session,
            _lock: lock,
        })
    }

    /// Publishes received frames and alerts on the bus until `stop` is set.
    ///
    /// # Errors
    /// The bus cannot publish, or `report` fails.
    pub fn run<Failed: From<BridgeError>>(
        mut self,
        stop: &AtomicBool,
        mut report: impl FnMut(ZenohReport) -> Result<(), Failed>,
    ) -> Result<ReceiverSummary, Failed> {
        while !stop.load(Ordering::Relaxed) {
            self.inbox.wait(LOOK_PERIOD);
            let taken = self.take_messages();
            self.reports.drain(..).try_for_each(&mut report)?;
            taken?;
        }
        Ok(self.finish())
    }

    fn take_messages(&mut self) -> Result<(), BridgeError> {
        if self.inbox.take_news_of_source() {
            self.ask_for_description(monotonic_ns());
        }
        for _ in 0..MAX_A_TURN {
            let Some((described, toml)) = self.inbox.descriptions.pop() else { break };
            self.take_description(described, toml);
        }
        for _ in 0..MAX_A_TURN {
            let Some(arrival) = self.inbox.frames.pop() else { break };
            self.take_frame(&arrival)?;
        }
        self.take_alerts()?;
        self.run.iter().for_each(ReceivedRun::deliver_to_late_joiners);
        self.serve_clients();
        self.look_for_silence();
        Ok(())
    }

    fn take_description(&mut self, described: Described, toml: String) {
        if !self.others.hears(monotonic_ns()) {
            self.summary.too_fast += 1;
        } else if let Some(run) = self.run.as_mut().filter(|run| run.remote_run_id() == described.run_id) {
            run.describe(described);
        } else if self.others.describe(described, toml) {
            let Described { run_id, every, .. } = described;
            self.reports.push(ZenohReport::Found { remote_run_id: run_id, every });
        }
    }

    fn take_frame(&mut self, arrival: &Arrival) -> Result<(), BridgeError> {
        let Some(header) = decode_frame(arrival.form, &arrival.payload.to_bytes(), &mut self.handles) else {
            self.summary.malformed += 1;
            return Ok(());
        };
        if self.run.as_ref().is_none_or(|run| run.remote_run_id() != header.run_id) {
            self.begin(&header);
        }
        let Some(run) = self.run.as_mut().filter(|run| run.remote_run_id() == header.run_id) else { return Ok(()) };
        if run.take(&header, &self.handles, arrival.arrived_ns, &mut self.summary)? {
            let now_ns = monotonic_ns();
            self.handling.record(now_ns - arrival.arrived_ns);
            self.last_frame_ns = now_ns;
            if self.silent.take().is_some() {
                self.reports.push(ZenohReport::Resumed { run_id: run.run_id(), lost: run.remote.lost });
            }
        }
        Ok(())
    }

    /// Begins to receive the run of a frame, if the run is described and not over. Otherwise counts the frame as foreign or
    /// malformed. A run that the bus has no room for is reported, and counts as over.
    fn begin(&mut self, header: &FrameHeader) {
        let FrameHeader { run_id: remote_run_id, bench_count, .. } = *header;
        let now_ns = monotonic_ns();
        match self.others.decide(remote_run_id, bench_count, now_ns) {
            RunDecision::Next(described, toml) => {
                let Err(error) = self.replace_run(described, toml, header.handle_count()) else { return };
                self.others.end(remote_run_id);
                self.reports.push(ZenohReport::Refused { remote_run_id, reason: error.to_string() });
            }
            RunDecision::Unknown => self.ask_for_description(now_ns),
            RunDecision::Barred => {}
            RunDecision::OtherDragon => {
                self.summary.malformed += 1;
                return;
            }
        }
        self.summary.foreign += 1;
    }

    /// Replaces the received run. The services of the old run are removed before those of the new run are created; if readers
    /// keep them open, the new run takes them over. If the new run cannot begin after the old run has ended, the old run begins
    /// again with its next frame.
    fn replace_run(&mut self, described: Described, toml: String, handle_count: usize) -> Result<(), BusError> {
        let freed = self.run.as_ref().map_or(0, |run| frame_memory(run.handle_count));
        require_room(frame_memory(handle_count).saturating_sub(freed))?;
        let before = self.end_run();
        let run = match ReceivedRun::begin(&self.domain, described, toml, handle_count) {
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
        self.reports.push(ZenohReport::Receiving { run_id: run.run_id(), remote_run_id: described.run_id });
        self.summary.runs += 1;
        self.silent = None;
        self.run = Some(run);
        Ok(())
    }

    /// Ends the received run and returns its description.
    fn end_run(&mut self) -> Option<Description> {
        let run = self.run.take()?;
        self.relay.give_up(&run);
        Some(run.finish(&mut self.summary))
    }

    fn ask_for_description(&mut self, now_ns: u64) {
        if now_ns - self.asked_ns < ASK_PERIOD_NS {
            return;
        }
        self.asked_ns = now_ns;
        if let Err(error) = ask_for_description(&self.session.zenoh, &self.prefix, &self.inbox) {
            tracing::warn!("cannot request the description: {error}");
        }
    }

    fn take_alerts(&mut self) -> Result<(), BridgeError> {
        for _ in 0..MAX_A_TURN {
            let Some(payload) = self.inbox.alerts.pop() else { break };
            let Some(alert) = decode_alert(&payload.to_bytes()) else {
                self.summary.malformed += 1;
                continue;
            };
            let count = match self.run.as_mut().filter(|run| run.remote_run_id() == alert.run_id) {
                Some(run) => {
                    if run.take_alert(alert)? {
                        &mut self.summary.alerts
                    } else {
                        &mut self.summary.too_fast
                    }
                }
                None => &mut self.summary.foreign,
            };
            *count += 1;
        }
        Ok(())
    }

    fn serve_clients(&mut self) {
        let Some(run) = &mut self.run else { return };
        let now_ns = monotonic_ns();
        // Reports that the bridge is alive, with or without frames.
        run.ports.report.beat();
        while let Some(command) = run.ports.take_command() {
            self.relay.pass_on(command, &self.session.zenoh, &self.inbox, run, now_ns);
        }
        self.relay.give_back(&self.inbox, run, now_ns);
    }

    /// Reports once that frames have stopped, and again when the reason becomes more precise.
    fn look_for_silence(&mut self) {
        let quiet_ns = monotonic_ns().saturating_sub(self.last_frame_ns);
        let silence_ns = self.run.as_ref().map_or(0, |run| run.period_ns().saturating_mul(3)).max(SILENCE_NS);
        if quiet_ns <= silence_ns || self.silent.is_some_and(|reason| reason != Silence::LinkOrSource) {
            return;
        }
        let reason = match self.inbox.has_source() {
            true => Silence::LinkOrSource,
            false if self.session.is_connected() => Silence::NoSource,
            false => Silence::NoConnection,
        };
        if self.silent.replace(reason) != Some(reason) {
            self.reports.push(ZenohReport::Silent { run_id: self.run.as_ref().map(ReceivedRun::run_id), reason });
        }
    }

    fn finish(mut self) -> ReceiverSummary {
        self.end_run();
        ReceiverSummary {
            dropped: self.inbox.frames.dropped(),
            malformed: self.summary.malformed + self.inbox.malformed.load(Ordering::Relaxed),
            too_fast: self.summary.too_fast + self.inbox.alerts.dropped() + self.inbox.descriptions.dropped(),
            commands: self.relay.sent,
            handling_us: self.handling.percentiles(),
            ..self.summary
        }
    }
}

/// Returns an error unless `needed` bytes of shared memory are free. A source tests this by writing to memory; this function
/// does not. Any host that reaches this bridge can trigger the check repeatedly. Even a short test allocation would take memory
/// from other programs.
fn require_room(needed: u64) -> Result<(), BusError> {
    let space = rustix::fs::statvfs("/dev/shm");
    // A file system without a limit reports 0 blocks.
    let bounded = space.ok().filter(|space| space.f_blocks > 0);
    let free = bounded.map_or(u64::MAX, |space| space.f_bavail.saturating_mul(space.f_frsize));
    if needed <= free { Ok(()) } else { Err(BusError::SharedMemoryFull { needed }) }
}
