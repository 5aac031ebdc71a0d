//! Frames, alerts and the description of this host's bus to others.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use bench_dragon_ipc::{
    AlertSubscriber, BusError, Description, DescriptionReader, Domain, Frame, FrameSubscriber, StatusReader,
};
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait as _};

use super::clerk::{Clerk, Desk};
use super::error::BridgeError;
use super::keys::KeyPrefix;
use super::line::{SenderSummary, Silence, ZenohLine};
use super::link::Link;
use super::link_error::LinkError;
use super::thinning::{Share, Thinning};
use super::wire::{
    ALERT_ENCODING, DESCRIPTION_ENCODING, Described, FRAME_ENCODING, encode_alert, encode_described, encode_frame,
};
use crate::source::described_rate_hz;

/// How long to wait for a frame before the rest is looked after.
const WAIT_PERIOD: Duration = Duration::from_millis(50);
/// How long the description of a run may come after its first frame; the bus keeps the frames meanwhile.
const DESCRIPTION_PATIENCE: Duration = Duration::from_millis(200);
const LOOK_PERIOD: Duration = Duration::from_millis(1);
/// A source that has said nothing for so long is gone: it publishes its status ten times a second, whatever it does.
const SOURCE_PATIENCE: Duration = Duration::from_secs(2);
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
pub struct Sender {
    ports: SenderPorts,
    settings: SenderSettings,
    run: Option<SentRun>,
    source: Option<LivelinessToken>,
    last_sign: Instant,
    summary: SenderSummary,
    desk: Arc<Desk>,
    // The clerk's questions end before the session does.
    _clerk: Clerk,
    publishers: Publishers,
    link: Link,
}

#[derive(Debug)]
struct SentRun {
    run_id: u64,
    thinning: Thinning,
}

impl SentRun {
    /// All frames of a run of which nothing is known.
    fn undescribed(run_id: u64) -> Self {
        Self { run_id, thinning: Thinning::of(Share::OneOf(1), 0) }
    }
}

#[derive(Debug)]
struct Publishers {
    frames: Publisher<'static>,
    alerts: Publisher<'static>,
    description: Publisher<'static>,
}

impl Sender {
    /// Begins to answer the other side's questions.
    ///
    /// # Errors
    /// [`LinkError::Session`].
    pub fn open(
        domain: &Domain,
        link: Link,
        ports: SenderPorts,
        settings: SenderSettings,
    ) -> Result<Self, BridgeError> {
        let (desk, prefix) = (Arc::new(Desk::default()), &settings.prefix);
        let clerk = Clerk::start(&link.session, prefix, domain, &desk, settings.allows_commands);
        let publishers = Publishers::declare(&link.session, prefix).map_err(LinkError::session)?;
        Ok(Self {
            _clerk: clerk.map_err(LinkError::session)?,
            ports,
            settings,
            run: None,
            source: None,
            last_sign: Instant::now(),
            summary: SenderSummary::default(),
            desk,
            publishers,
            link,
        })
    }

    /// Sends what the bus has, until `stop` is set.
    ///
    /// # Errors
    /// Where the bus cannot be read, the session is closed, or `tell` fails.
    pub fn run<Failed: From<BridgeError>>(
        mut self,
        stop: &AtomicBool,
        mut tell: impl FnMut(ZenohLine) -> Result<(), Failed>,
    ) -> Result<SenderSummary, Failed> {
        while !stop.load(Ordering::Relaxed) {
            let frame = self.ports.frames.wait(WAIT_PERIOD).map_err(BridgeError::from)?;
            if let Some(frame) = &frame
                && let Some(line) = self.send_frame(frame)?
            {
                tell(line)?;
            }
            self.send_alerts()?;
            if let Some(line) = self.take_description()? {
                tell(line)?;
            }
            if let Some(line) = self.look_for_source(frame.is_some())? {
                tell(line)?;
            }
        }
        self.summary.lost = self.ports.frames.lost();
        Ok(SenderSummary { commands: self.desk.commands(), refused: self.desk.refused(), ..self.summary })
    }

    fn send_frame(&mut self, frame: &Frame) -> Result<Option<ZenohLine>, BridgeError> {
        let header = frame.header();
        let begun = self.wait_for_run(header.run_id)?;
        if self.run.as_ref().is_none_or(|run| run.run_id != header.run_id) {
            tracing::warn!("the source of run {} publishes no description: nobody can follow it", header.run_id);
            self.run = Some(SentRun::undescribed(header.run_id));
        }
        let run = self.run.as_mut().expect("given where it was missing");
        if run.thinning.takes(header) {
            self.publishers.frames.put(encode_frame(header, frame.handles())).wait().map_err(LinkError::session)?;
            self.summary.frames += 1;
        }
        Ok(begun)
    }

    /// Waits for the description of a run, but not for long.
    fn wait_for_run(&mut self, run_id: u64) -> Result<Option<ZenohLine>, BridgeError> {
        let mut begun = None;
        let deadline = Instant::now() + DESCRIPTION_PATIENCE;
        while self.run.as_ref().is_none_or(|run| run.run_id != run_id) && Instant::now() < deadline {
            begun = self.take_description()?;
            if begun.is_none() {
                thread::sleep(LOOK_PERIOD);
            }
        }
        Ok(begun)
    }

    /// Tells the other side what the frames that follow are of, where there is a new run.
    fn take_description(&mut self) -> Result<Option<ZenohLine>, BridgeError> {
        let Some(Description { run_id, toml }) = self.ports.descriptions.poll()? else { return Ok(None) };
        let thinning = Thinning::of(self.settings.share, described_rate_hz(&toml));
        let described = Described { run_id, every: thinning.every() };
        self.desk.describe(described, &toml);
        let put = self.publishers.description.put(toml).attachment(encode_described(described));
        put.wait().map_err(LinkError::session)?;
        self.run = Some(SentRun { run_id, thinning });
        Ok(Some(ZenohLine::Sending { run_id, every: described.every }))
    }

    fn send_alerts(&mut self) -> Result<(), BridgeError> {
        for _ in 0..MAX_ALERTS_A_FRAME {
            let Some(alert) = self.ports.alerts.receive()? else { break };
            self.publishers.alerts.put(encode_alert(&alert)).wait().map_err(LinkError::session)?;
            self.summary.alerts += 1;
        }
        Ok(())
    }

    /// Keeps the word that a source is there.
    fn look_for_source(&mut self, has_frame: bool) -> Result<Option<ZenohLine>, BridgeError> {
        let now = Instant::now();
        if has_frame || self.ports.status.poll()?.is_some() {
            self.last_sign = now;
        }
        let is_there = now - self.last_sign < SOURCE_PATIENCE;
        // Whoever sees it asks for the description, which is to be there.
        if is_there && self.source.is_none() && self.run.is_some() {
            let token = self.link.session.liveliness().declare_token(self.settings.prefix.source()).wait();
            self.source = Some(token.map_err(LinkError::session)?);
        }
        if is_there || self.source.take().is_none() {
            return Ok(None);
        }
        Ok(Some(ZenohLine::Silent { run_id: self.run.as_ref().map(|run| run.run_id), reason: Silence::NoSource }))
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
