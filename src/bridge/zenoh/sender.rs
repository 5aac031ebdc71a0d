//! Frames, alerts and the description of this host's bus to others.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use bench_dragon_ipc::{
    AlertSubscriber, BusError, Description, DescriptionReader, Domain, Frame, FrameSubscriber, IntoBytes as _,
    StatusReader, frame_bytes,
};
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait as _};

use super::key_prefix::KeyPrefix;
use super::query_server::{QueryServer, QueryState};
use super::report::{SenderSummary, Silence, ZenohReport};
use super::sent_runs::{FrameDisposition, SentRuns, Share, Thinning};
use super::session::{BridgeError, BridgeSession, Change, PeerPresence};
use super::wire::{ALERT_ENCODING, DESCRIPTION_ENCODING, Described, FRAME_ENCODING, encode_described};
use crate::source::described_rate_hz;
use crate::source::replay::FASTEST_HZ;
use crate::system::clock::monotonic_ns;

/// How long to wait for a frame before the rest is looked after.
const WAIT_PERIOD: Duration = Duration::from_millis(50);
/// How long the description of a run may come after its first frame; the bus keeps the frames meanwhile.
const DESCRIPTION_PATIENCE: Duration = Duration::from_millis(200);
const LOOK_PERIOD: Duration = Duration::from_millis(1);
/// A source that has said nothing for so long is gone: it publishes its status ten times a second, whatever it does.
const SOURCE_PATIENCE: Duration = Duration::from_secs(2);
/// Statuses that are read at a time: one a source.
const MAX_STATUSES: usize = 4;
/// Alerts that are passed on between two frames.
const MAX_ALERTS_A_FRAME: usize = 16;

/// What is sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SenderSettings {
    /// What all keys begin with.
    pub prefix: KeyPrefix,
    /// How many of the frames.
    pub share: Share,
    /// Whether the other side may command the server.
    pub allows_commands: bool,
}

/// Everything of the bus that a sending bridge reads.
#[derive(Debug)]
pub struct SenderPorts {
    frames: FrameSubscriber,
    alerts: AlertSubscriber,
    descriptions: DescriptionReader,
    status: StatusReader,
}

impl SenderPorts {
    /// Opens the frames last, so that from their first one on everything else is there.
    ///
    /// # Errors
    /// As [`FrameSubscriber::open`].
    pub fn open(domain: &Domain) -> Result<Self, BusError> {
        Ok(Self {
            alerts: AlertSubscriber::open(domain, "bridge-alerts")?,
            descriptions: DescriptionReader::open(domain, "bridge-description")?,
            status: StatusReader::open(domain, "bridge-status")?,
            frames: FrameSubscriber::open(domain, "bridge-zenoh")?,
        })
    }
}

/// A sending bridge.
///
/// Everything is sent so that it is dropped where there is no room: a way that is cut or too narrow makes the bridge lose
/// frames, never wait, and a frame that is a second late is of no use to anyone. Alerts, descriptions and commands have
/// queues of their own before that of the frames. Nothing is gathered into batches (`express`): a frame that waits for the
/// next one is late.
#[derive(Debug)]
pub struct SendingBridge {
    ports: SenderPorts,
    settings: SenderSettings,
    runs: SentRuns,
    /// A description that has come, and since when it waits for the status, which has the run's rate.
    news: Option<(Description, Instant)>,
    /// A run and its rate, as the last status has them.
    rate: Option<(u64, u32)>,
    presence: PeerPresence,
    source: Option<LivelinessToken>,
    last_sign: Instant,
    /// Whether it has reported that no source is there.
    was_silent: bool,
    reports: Vec<ZenohReport>,
    summary: SenderSummary,
    state: Arc<QueryState>,
    // Ends before the session does.
    query_server: QueryServer,
    publishers: Publishers,
    session: BridgeSession,
}

#[derive(Debug)]
struct Publishers {
    frames: Publisher<'static>,
    alerts: Publisher<'static>,
    description: Publisher<'static>,
}

impl SendingBridge {
    /// Begins to answer the other side's questions.
    ///
    /// # Errors
    /// [`BridgeError::Session`].
    pub fn open(
        domain: &Domain,
        session: BridgeSession,
        ports: SenderPorts,
        settings: SenderSettings,
    ) -> Result<Self, BridgeError> {
        let (state, prefix) = (Arc::new(QueryState::default()), &settings.prefix);
        let query_server = QueryServer::start(&session.zenoh, prefix, domain, &state, settings.allows_commands);
        let publishers = Publishers::declare(&session.zenoh, prefix).map_err(BridgeError::session)?;
        Ok(Self {
            query_server: query_server.map_err(BridgeError::session)?,
            ports,
            settings,
            runs: SentRuns::default(),
            news: None,
            rate: None,
            presence: PeerPresence::none(monotonic_ns()),
            source: None,
            last_sign: Instant::now(),
            was_silent: false,
            reports: Vec::new(),
            summary: SenderSummary::default(),
            state,
            publishers,
            session,
        })
    }

    /// Sends what the bus has, until `stop` is set.
    ///
    /// # Errors
    /// Where the bus cannot be read, the session is closed, or `report` fails.
    pub fn run<Failed: From<BridgeError>>(
        mut self,
        stop: &AtomicBool,
        mut report: impl FnMut(ZenohReport) -> Result<(), Failed>,
    ) -> Result<SenderSummary, Failed> {
        while !stop.load(Ordering::Relaxed) {
            let sent = self.send_what_has_come();
            self.reports.drain(..).try_for_each(&mut report)?;
            sent?;
        }
        Ok(self.finish())
    }

    fn send_what_has_come(&mut self) -> Result<(), BridgeError> {
        let frame = self.ports.frames.wait(WAIT_PERIOD)?;
        self.look_for_peers();
        if let Some(frame) = &frame {
            self.send_frame(frame)?;
        }
        self.send_alerts()?;
        self.take_description()?;
        self.look_for_source(frame.is_some())
    }

    fn finish(self) -> SenderSummary {
        let Self { ports, query_server, state, summary, .. } = self;
        // What it has at hand counts as well.
        drop(query_server);
        let lost = summary.lost + ports.frames.lost();
        let [commands, refused] = [&state.commands, &state.refused].map(|count| count.load(Ordering::Relaxed));
        SenderSummary { lost, commands, refused, ..summary }
    }

    fn send_frame(&mut self, frame: &Frame) -> Result<(), BridgeError> {
        let header = frame.header();
        self.wait_for_run(header.run_id)?;
        if !self.runs.knows(header.run_id) && self.runs.do_without_description(header.run_id) {
            tracing::warn!("the source of run {} publishes no description: nobody can follow it", header.run_id);
        }
        match self.runs.disposition(header) {
            FrameDisposition::Sent => {
                let bytes = frame_bytes(header, frame.handles());
                self.publishers.frames.put(bytes).wait().map_err(BridgeError::session)?;
                let count = if self.presence.is_there() { &mut self.summary.frames } else { &mut self.summary.unheard };
                *count += 1;
            }
            FrameDisposition::LeftOut => {}
            FrameDisposition::Past => self.summary.lost += 1,
        }
        Ok(())
    }

    /// Waits for the description of a run, but not for long.
    fn wait_for_run(&mut self, run_id: u64) -> Result<(), BridgeError> {
        let deadline = Instant::now() + DESCRIPTION_PATIENCE;
        while !self.runs.knows(run_id) && !self.take_description()? {
            let is_described = self.news.as_ref().is_some_and(|(description, _)| description.run_id == run_id);
            if !is_described && Instant::now() >= deadline {
                break;
            }
            thread::sleep(LOOK_PERIOD);
        }
        Ok(())
    }

    /// Describes to the other side what the frames that follow are of, where there is a new run and its rate is known. Returns
    /// whether it has.
    fn take_description(&mut self) -> Result<bool, BridgeError> {
        if let Some(description) = self.ports.descriptions.poll()? {
            self.news = Some((description, Instant::now()));
        }
        self.look_at_status()?;
        let Some((Description { run_id, toml }, since)) = &self.news else { return Ok(false) };
        let run_id = *run_id;
        let rate_hz = match self.rate {
            Some((of_run, rate_hz)) if of_run == run_id => rate_hz.min(FASTEST_HZ),
            _ if since.elapsed() < DESCRIPTION_PATIENCE => return Ok(false),
            _ => described_rate_hz(toml).min(FASTEST_HZ),
        };
        let thinning = Thinning::of(self.settings.share, rate_hz);
        let described = Described { run_id, every: thinning.every, rate_hz: rate_hz.into() };
        self.state.describe(described, toml);
        let put = self.publishers.description.put(toml.as_str()).attachment(encode_described(described));
        put.wait().map_err(BridgeError::session)?;
        self.news = None;
        self.runs.describe(run_id, thinning);
        self.reports.push(ZenohReport::Sending { run_id, every: described.every });
        Ok(true)
    }

    /// The status is a sign of life, and has the rate of what comes, which for a recording that is played faster is not the one
    /// that it is described with.
    fn look_at_status(&mut self) -> Result<(), BridgeError> {
        // One of the source there is, and one that the last one has left.
        for _ in 0..MAX_STATUSES {
            let Some(status) = self.ports.status.poll()? else { break };
            self.rate = Some((status.run_id, status.rate_hz));
            self.last_sign = Instant::now();
        }
        Ok(())
    }

    /// Reports that nobody is connected, and that somebody is again.
    fn look_for_peers(&mut self) {
        let Self { presence, session, summary, .. } = self;
        self.reports.extend(presence.note(monotonic_ns(), || session.is_connected()).map(|change| match change {
            Change::Alone => ZenohReport::Alone { connects: session.connects.clone() },
            Change::Connected => ZenohReport::Connected { unheard: summary.unheard },
        }));
    }

    fn send_alerts(&mut self) -> Result<(), BridgeError> {
        for _ in 0..MAX_ALERTS_A_FRAME {
            let Some(alert) = self.ports.alerts.receive()? else { break };
            self.publishers.alerts.put(alert.as_bytes()).wait().map_err(BridgeError::session)?;
            self.summary.alerts += 1;
        }
        Ok(())
    }

    /// Keeps the liveliness token for as long as a source is there.
    fn look_for_source(&mut self, has_frame: bool) -> Result<(), BridgeError> {
        self.look_at_status()?;
        let now = Instant::now();
        if has_frame {
            self.last_sign = now;
        }
        let is_there = now - self.last_sign < SOURCE_PATIENCE;
        // Whoever sees it asks for the description, which is to be there.
        let run_id = self.runs.run_id();
        if let (true, None, Some(run_id)) = (is_there, &self.source, run_id) {
            let token = self.session.zenoh.liveliness().declare_token(self.settings.prefix.source()).wait();
            self.source = Some(token.map_err(BridgeError::session)?);
            if std::mem::take(&mut self.was_silent) {
                let lost = self.summary.lost + self.ports.frames.lost();
                self.reports.push(ZenohReport::Resumed { run_id, lost });
            }
        } else if !is_there && self.source.take().is_some() {
            self.was_silent = true;
            self.reports.push(ZenohReport::Silent { run_id, reason: Silence::NoSource });
        }
        Ok(())
    }
}

impl Publishers {
    fn declare(session: &Session, prefix: &KeyPrefix) -> zenoh::Result<Self> {
        let declare = |key: String, encoding: &'static str, priority| {
            session
                .declare_publisher(key)
                .encoding(encoding)
                .congestion_control(CongestionControl::Drop)
                .priority(priority)
                .express(true)
                .wait()
        };
        Ok(Self {
            frames: declare(prefix.frames(), FRAME_ENCODING, Priority::Data)?,
            alerts: declare(prefix.alerts(), ALERT_ENCODING, Priority::InteractiveHigh)?,
            description: declare(prefix.description(), DESCRIPTION_ENCODING, Priority::InteractiveHigh)?,
        })
    }
}
