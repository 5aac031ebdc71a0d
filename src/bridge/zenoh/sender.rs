//! Sends the frames, alerts and description of this host's bus to other hosts.

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
use super::wire::{ALERT_ENCODING, DESCRIPTION_ENCODING, Described, FRAME_ENCODING, FrameForm, encode_described};
use crate::source::described_rate_hz;
use crate::source::replay::FASTEST_HZ;
use crate::system::clock::monotonic_ns;

/// Longest wait for a frame before the bridge handles alerts, the description and the status.
const WAIT_PERIOD: Duration = Duration::from_millis(50);
/// Longest wait for a run's description after its first frame, and for its status after its description. The bus buffers the
/// frames during this wait.
const DESCRIPTION_TIMEOUT: Duration = Duration::from_millis(200);
const LOOK_PERIOD: Duration = Duration::from_millis(1);
/// A source counts as gone after this time without a frame or a status. A live source always publishes its status ten times a
/// second.
const SOURCE_TIMEOUT: Duration = Duration::from_secs(2);
/// Most statuses that are read at a time: one for each source.
const MAX_STATUSES: usize = 4;
/// Most alerts that are sent between two frames.
const MAX_ALERTS_A_FRAME: usize = 16;

/// Settings of a sending bridge.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SenderSettings {
    /// Prefix of all keys.
    pub prefix: KeyPrefix,
    /// Share of the frames that the bridge sends.
    pub share: Share,
    /// Whether the bridge passes commands from other hosts to the server.
    pub allows_commands: bool,
    /// How long the bridge looks for a frame before and after its due instant in a busy loop; `None` if the server wakes it.
    pub spin: Option<Duration>,
}

/// Ports through which a sending bridge reads the bus.
#[derive(Debug)]
pub struct SenderPorts {
    frames: FrameSubscriber,
    alerts: AlertSubscriber,
    descriptions: DescriptionReader,
    status: StatusReader,
}

impl SenderPorts {
    /// Opens the ports. The port for frames comes last, so that the other ports are open at the first frame.
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
/// zenoh drops a message if there is no room for it. So a cut or slow link makes the bridge lose frames, but never wait: a
/// frame that is a second late has no use. Alerts, descriptions and commands have their own queues, with a higher priority
/// than frames. Messages are not batched (`express`), because a frame that waits for the next one is late.
#[derive(Debug)]
pub struct SendingBridge {
    ports: SenderPorts,
    settings: SenderSettings,
    runs: SentRuns,
    /// A new description and its arrival time. It waits for the status, which contains the run's rate.
    news: Option<(Description, Instant)>,
    /// The run and the rate of the last status.
    rate: Option<(u64, u32)>,
    presence: PeerPresence,
    source: Option<LivelinessToken>,
    last_sign: Instant,
    /// Whether the bridge has reported a missing source.
    was_silent: bool,
    reports: Vec<ZenohReport>,
    summary: SenderSummary,
    state: Arc<QueryState>,
    // Dropped before the session.
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
    /// Opens a sending bridge. The bridge begins to answer queries from other hosts.
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

    /// Sends frames, alerts and descriptions until `stop` is set.
    ///
    /// # Errors
    /// The bus cannot be read, the session is closed, or `report` fails.
    pub fn run<Failed: From<BridgeError>>(
        mut self,
        stop: &AtomicBool,
        mut report: impl FnMut(ZenohReport) -> Result<(), Failed>,
    ) -> Result<SenderSummary, Failed> {
        while !stop.load(Ordering::Relaxed) {
            let sent = self.send_messages();
            self.reports.drain(..).try_for_each(&mut report)?;
            sent?;
        }
        Ok(self.finish())
    }

    fn send_messages(&mut self) -> Result<(), BridgeError> {
        let frame = match self.settings.spin {
            Some(spin) => self.ports.frames.wait_until_due(WAIT_PERIOD, spin)?,
            None => self.ports.frames.wait(WAIT_PERIOD)?,
        };
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
        // The server finishes its current query, which is then included in the counts.
        drop(query_server);
        let lost = summary.lost + ports.frames.lost();
        let [commands, refused] = [&state.commands, &state.refused].map(|count| count.load(Ordering::Relaxed));
        SenderSummary { lost, commands, refused, ..summary }
    }

    fn send_frame(&mut self, frame: &Frame) -> Result<(), BridgeError> {
        let header = frame.header();
        self.wait_for_run(header.run_id)?;
        if !self.runs.knows(header.run_id) && self.runs.do_without_description(header.run_id) {
            tracing::warn!(
                "the source of run {} publishes no description, so no other host can receive it",
                header.run_id
            );
        }
        match self.runs.disposition(header) {
            FrameDisposition::Sent => {
                let bytes = frame_bytes(header, frame.handles());
                self.publishers
                    .frames
                    .put(bytes)
                    .encoding(FrameForm::of(header).encoding())
                    .wait()
                    .map_err(BridgeError::session)?;
                let count = if self.presence.is_there() { &mut self.summary.frames } else { &mut self.summary.unheard };
                *count += 1;
            }
            FrameDisposition::LeftOut => {}
            FrameDisposition::Past => self.summary.lost += 1,
        }
        Ok(())
    }

    /// Waits until a run is known, or until the timeout has passed.
    fn wait_for_run(&mut self, run_id: u64) -> Result<(), BridgeError> {
        let deadline = Instant::now() + DESCRIPTION_TIMEOUT;
        while !self.runs.knows(run_id) && !self.take_description()? {
            let is_described = self.news.as_ref().is_some_and(|(description, _)| description.run_id == run_id);
            if !is_described && Instant::now() >= deadline {
                break;
            }
            thread::sleep(LOOK_PERIOD);
        }
        Ok(())
    }

    /// Sends the description of a new run once the run's rate is known. After a timeout it uses the rate of the description.
    /// Returns whether it has sent one.
    fn take_description(&mut self) -> Result<bool, BridgeError> {
        if let Some(description) = self.ports.descriptions.poll()? {
            self.news = Some((description, Instant::now()));
        }
        self.look_at_status()?;
        let Some((Description { run_id, toml }, since)) = &self.news else { return Ok(false) };
        let run_id = *run_id;
        let rate_hz = match self.rate {
            Some((of_run, rate_hz)) if of_run == run_id => rate_hz.min(FASTEST_HZ),
            _ if since.elapsed() < DESCRIPTION_TIMEOUT => return Ok(false),
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

    /// Reads the statuses. A status shows that the source is alive, and contains the actual rate of its frames. A recording
    /// that is replayed faster has a higher rate than its description.
    fn look_at_status(&mut self) -> Result<(), BridgeError> {
        // The port may hold a status of the current source and one of the previous source.
        for _ in 0..MAX_STATUSES {
            let Some(status) = self.ports.status.poll()? else { break };
            self.rate = Some((status.run_id, status.rate_hz));
            self.last_sign = Instant::now();
        }
        Ok(())
    }

    /// Reports when no peer is connected, and when a peer is connected again.
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

    /// Holds the liveliness token while a source exists.
    fn look_for_source(&mut self, has_frame: bool) -> Result<(), BridgeError> {
        self.look_at_status()?;
        let now = Instant::now();
        if has_frame {
            self.last_sign = now;
        }
        let is_there = now - self.last_sign < SOURCE_TIMEOUT;
        // A receiver requests the description when it sees the token, so a run must have been described.
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
