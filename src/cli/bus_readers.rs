//! Readers of the bus for the subcommands: its frames until a signal, the descriptions of its runs, its record of commands.

use std::thread;
use std::time::{Duration, Instant};

use anyhow::bail;
use bench_dragon_ipc::source::SourceLock;
use bench_dragon_ipc::{
    BusError, CommandEvent, CommandEventReader, Continuity, Description, DescriptionReader, Domain, EventKind, Frame,
    FrameSubscriber, Instance, StatusReader,
};
use serde::Serialize;

use crate::cli::flags::BusArgs;
use crate::cli::print::print_to_stderr;
use crate::output::wait_for_reader;
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

/// Period at which a subcommand looks for a missing server.
const SERVER_LOOK_PERIOD: Duration = Duration::from_millis(20);
/// Longest wait for a frame before a reader checks the stop flag again.
pub(crate) const WAIT_PERIOD: Duration = Duration::from_millis(100);
/// Period at which a polling reader looks for frames. At the highest rates the bus buffers two milliseconds of frames.
const POLL_PERIOD: Duration = Duration::from_millis(1);

/// Opens a port of an instance. Waits as long as no source publishes there. `None` if a signal arrives first.
pub(crate) fn open_when_there<Port>(
    instance: &Instance,
    stop: &StopFlag,
    mut open: impl FnMut() -> Result<Port, BusError>,
) -> Result<Option<Port>, BusError> {
    let mut is_reported = false;
    while !stop.is_set() {
        match open() {
            Ok(port) => return Ok(Some(port)),
            Err(error) if error.is_absent() => {
                if !is_reported {
                    print_to_stderr(&format!("waiting for a server on instance {instance}"));
                    is_reported = true;
                }
                thread::sleep(SERVER_LOOK_PERIOD);
            }
            Err(error) => return Err(error),
        }
    }
    Ok(None)
}

/// Opens the frames of a server, and the stop flag that signals set, for a subcommand that only produces output. Waits for a
/// server. `None` if a signal arrives first.
pub(crate) fn open_frames(bus: &BusArgs, name: &str) -> anyhow::Result<Option<(FrameSubscriber, StopFlag)>> {
    let domain = bus.domain()?;
    let stop = StopFlag::on_signals()?;
    wait_for_reader(Some(&stop));
    let frames = open_when_there(domain.instance(), &stop, || FrameSubscriber::open(&domain, name))?;
    Ok(frames.map(|frames| (frames, stop)))
}

/// Counts of the frames that a measuring subcommand has read.
#[derive(Default, Serialize)]
pub(crate) struct FrameCounts {
    pub(crate) frames: u64,
    /// Frames lost between the first and the last frame that was read.
    pub(crate) lost: u64,
    /// Number of changes to another run.
    pub(crate) restarts: u64,
}

impl FrameCounts {
    pub(crate) fn count(&mut self, frame: &Frame) {
        self.frames += 1;
        match frame.continuity() {
            Continuity::Lost(frames) => self.lost += frames,
            Continuity::Restarted => self.restarts += 1,
            Continuity::First | Continuity::Next => {}
        }
    }
}

/// Ports of a reader of all runs of an instance.
pub(crate) struct RunPorts {
    pub(crate) frames: FrameSubscriber,
    pub(crate) descriptions: Descriptions,
    pub(crate) commands: Option<CommandTrail>,
}

impl RunPorts {
    /// Opens the ports, the frames last. So all other ports, including those of `open_others`, are open at the first frame.
    pub(crate) fn open<Others>(
        domain: &Domain,
        name: &str,
        stop: &StopFlag,
        open_others: impl FnOnce() -> Result<Others, BusError>,
    ) -> Result<(Self, Others), BusError> {
        let descriptions = Descriptions::open(domain, &format!("{name}-description"), stop)?;
        let others = open_others()?;
        let commands = CommandTrail::open(domain, name)?;
        let frames = FrameSubscriber::open(domain, name)?;
        // A source that was starting at the first attempt has created its record by now.
        let commands = commands.map_or_else(|| CommandTrail::open(domain, name), |commands| Ok(Some(commands)))?;
        Ok((Self { frames, descriptions, commands }, others))
    }
}

/// Returns frame after frame; after a signal, only frames that were published before the signal. So a reader that keeps up
/// loses no frame at its end, and a reader that is slower than the server ends, too.
pub(crate) struct FrameReading<'a> {
    stop: &'a StopFlag,
    /// How long it looks for a frame before and after its due instant; `None` if the server wakes it.
    spin: Option<Duration>,
    stopped_ns: Option<u64>,
}

pub(crate) enum Next {
    /// The oldest frame that has not been read yet.
    Frame(Frame),
    /// No frame has arrived within the wait.
    Nothing,
    /// All frames have been read after a signal.
    End,
}

impl<'a> FrameReading<'a> {
    pub(crate) fn until(stop: &'a StopFlag) -> Self {
        Self { stop, spin: None, stopped_ns: None }
    }

    /// Sleeps by the clock until a frame is due, if `spin` is given.
    pub(crate) fn by_clock(self, spin: Option<Duration>) -> Self {
        Self { spin, ..self }
    }

    /// Waits up to [`WAIT_PERIOD`] for the next frame. The server wakes all readers that wait in one system call.
    pub(crate) fn wait(&mut self, frames: &mut FrameSubscriber) -> Result<Next, BusError> {
        let spin = self.spin;
        self.next(frames, |frames| match spin {
            Some(spin) => frames.wait_until_due(WAIT_PERIOD, spin),
            None => frames.wait(WAIT_PERIOD),
        })
    }

    /// Polls for the next frame, up to [`POLL_PERIOD`] late. The server does not wake this reader, so the reader costs the
    /// server nothing.
    pub(crate) fn poll(&mut self, frames: &mut FrameSubscriber) -> Result<Next, BusError> {
        self.next(frames, |frames| {
            let frame = frames.receive()?;
            if frame.is_none() {
                thread::sleep(POLL_PERIOD);
            }
            Ok(frame)
        })
    }

    fn next(
        &mut self,
        frames: &mut FrameSubscriber,
        read: impl FnOnce(&mut FrameSubscriber) -> Result<Option<Frame>, BusError>,
    ) -> Result<Next, BusError> {
        if self.stopped_ns.is_none() && self.stop.is_set() {
            self.stopped_ns = Some(monotonic_ns());
        }
        let Some(stopped_ns) = self.stopped_ns else {
            return Ok(read(frames)?.map_or(Next::Nothing, Next::Frame));
        };
        let unread = frames.receive()?.filter(|frame| frame.header().published_ns <= stopped_ns);
        Ok(unread.map_or(Next::End, Next::Frame))
    }
}

/// Longest wait for a run's description after its first frame.
const DESCRIPTION_TIMEOUT: Duration = Duration::from_secs(5);
/// Longest wait for a description before the first frame. A source sends its description to late joiners ten times a second.
/// A source that has ended does not, although other processes keep its services open.
const FIRST_DESCRIPTION_TIMEOUT: Duration = Duration::from_millis(500);
const DESCRIPTION_LOOK_PERIOD: Duration = Duration::from_millis(1);

/// The descriptions of the runs on an instance.
pub(crate) struct Descriptions {
    reader: DescriptionReader,
    latest: Option<Description>,
}

impl Descriptions {
    /// Opens the descriptions and waits for the first one, up to [`FIRST_DESCRIPTION_TIMEOUT`]. A reader that waited at its
    /// first frame instead would lose frames at a high rate.
    pub(crate) fn open(domain: &Domain, name: &str, stop: &StopFlag) -> Result<Self, BusError> {
        let mut descriptions = Self { reader: DescriptionReader::open(domain, name)?, latest: None };
        let deadline = Instant::now() + FIRST_DESCRIPTION_TIMEOUT;
        while !descriptions.renew()? && Instant::now() < deadline && !stop.is_set() {
            thread::sleep(DESCRIPTION_LOOK_PERIOD);
        }
        Ok(descriptions)
    }

    /// The newest description, if there is one.
    pub(crate) fn latest(&self) -> Option<&Description> {
        self.latest.as_ref()
    }

    /// Waits for the description of a run, while frames stay in the reader's buffer. `None` if a signal arrives first.
    ///
    /// # Errors
    /// The source has published no description within five seconds.
    pub(crate) fn of(&mut self, run_id: u64, stop: &StopFlag) -> anyhow::Result<Option<&Description>> {
        let deadline = Instant::now() + DESCRIPTION_TIMEOUT;
        while self.latest.as_ref().is_none_or(|description| description.run_id != run_id) {
            if self.renew()? {
                continue;
            }
            if stop.is_set() {
                return Ok(None);
            }
            if Instant::now() >= deadline {
                bail!("the source of run {run_id} publishes no description");
            }
            thread::sleep(DESCRIPTION_LOOK_PERIOD);
        }
        Ok(self.latest.as_ref())
    }

    fn renew(&mut self) -> Result<bool, BusError> {
        let next = self.reader.poll()?;
        let is_there = next.is_some();
        self.latest = next.or(self.latest.take());
        Ok(is_there)
    }
}

/// The events of the runs on an instance, oldest first.
pub(crate) struct CommandTrail {
    events: CommandEventReader,
    statuses: StatusReader,
    domain: Domain,
    last: Option<CommandEvent>,
    status: Option<(u64, u64)>,
    /// Events lost so far: events that overflowed the buffer, and a run's oldest events from before the trail was opened.
    pub(crate) lost: u64,
}

impl CommandTrail {
    /// Opens the record of an instance, before its frames. The names of the nodes begin with `name`. `None` if there is no
    /// source, or if the source keeps no record.
    pub(crate) fn open(domain: &Domain, name: &str) -> Result<Option<Self>, BusError> {
        match Self::open_all(domain, name) {
            Err(error) if error.is_absent() => Ok(None),
            opened => opened.map(Some),
        }
    }

    fn open_all(domain: &Domain, name: &str) -> Result<Self, BusError> {
        Ok(Self {
            events: CommandEventReader::open(domain, &format!("{name}-commands"))?,
            statuses: StatusReader::open(domain, &format!("{name}-status"))?,
            domain: domain.clone(),
            last: None,
            status: None,
            lost: 0,
        })
    }

    /// Returns the oldest unread event. Never waits.
    pub(crate) fn receive(&mut self) -> Result<Option<CommandEvent>, BusError> {
        let Some(event) = self.events.receive()? else { return Ok(None) };
        // The events of a run are numbered from 0.
        let expected = self.last.filter(|last| last.run_id == event.run_id).map_or(0, |last| last.number + 1);
        self.lost += event.number.saturating_sub(expected);
        self.last = Some(event);
        Ok(Some(event))
    }

    /// Whether all events of a run up to this tick are ready to be received. They are if the run has ended, or if its source
    /// has published a later status: a source publishes events before the status.
    pub(crate) fn is_complete(&mut self, run_id: u64, tick: u64) -> Result<bool, BusError> {
        while let Some(status) = self.statuses.poll()? {
            self.status = Some((status.run_id, status.tick));
        }
        let has_ended =
            self.last.is_some_and(|last| last.run_id == run_id && last.event_kind() == Some(EventKind::End));
        let is_reported = self.status.is_some_and(|(reported, to_tick)| reported != run_id || to_tick >= tick);
        Ok(has_ended || is_reported || SourceLock::holder(&self.domain).is_none())
    }
}
