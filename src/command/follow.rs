//! What commands read of a server: its frames until a signal, the descriptions of its runs, its record of commands.

use std::thread;
use std::time::{Duration, Instant};

use anyhow::bail;
use bench_dragon_ipc::{
    BusError, CommandEvent, CommandEventReader, Continuity, Description, DescriptionReader, Domain, EventKind, Frame,
    FrameSubscriber, Instance, SourceLock, StatusReader,
};
use serde::Serialize;

use crate::command::flags::BusArgs;
use crate::command::print::complain;
use crate::output::wait_for_reader;
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

/// How often a missing server is looked for.
const SERVER_LOOK_PERIOD: Duration = Duration::from_millis(20);
/// How long a reader waits for a frame before it looks at the stop flag again.
pub(crate) const WAIT_PERIOD: Duration = Duration::from_millis(100);
/// How often a reader that is not woken looks for frames: at the highest rates the bus keeps two milliseconds of them.
const POLL_PERIOD: Duration = Duration::from_millis(1);

/// Opens something of an instance, waiting for as long as nothing is published there. `None` where a signal came first.
pub(crate) fn open_when_there<Port>(
    instance: &Instance,
    stop: &StopFlag,
    mut open: impl FnMut() -> Result<Port, BusError>,
) -> Result<Option<Port>, BusError> {
    let mut told = false;
    while !stop.is_set() {
        match open() {
            Ok(port) => return Ok(Some(port)),
            Err(error) if error.is_absent() => {
                if !told {
                    complain(&format!("waiting for a server on instance {instance}"));
                    told = true;
                }
                thread::sleep(SERVER_LOOK_PERIOD);
            }
            Err(error) => return Err(error),
        }
    }
    Ok(None)
}

/// The frames of a server for a command whose only job is its output, and the signals that end it. Waits for a server; `None`
/// where a signal came first.
pub(crate) fn open_frames(bus: &BusArgs, name: &str) -> anyhow::Result<Option<(FrameSubscriber, StopFlag)>> {
    let domain = bus.domain()?;
    let stop = StopFlag::on_signals()?;
    wait_for_reader(Some(&stop));
    let frames = open_when_there(domain.instance(), &stop, || FrameSubscriber::open(&domain, name))?;
    Ok(frames.map(|frames| (frames, stop)))
}

/// What a command that measures has read.
#[derive(Default, Serialize)]
pub(crate) struct FrameCounts {
    pub(crate) frames: u64,
    /// Frames lost between the first and the last one read.
    pub(crate) lost: u64,
    /// How often another run followed.
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

/// What a reader of every run reads of the bus.
pub(crate) struct RunPorts {
    pub(crate) frames: FrameSubscriber,
    pub(crate) descriptions: Descriptions,
    pub(crate) commands: Option<CommandTrail>,
}

impl RunPorts {
    /// Opens the frames last, so that from their first one on everything else is there, also what `open_others` opens.
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
        // A source that was just starting has its record by now.
        let commands = commands.map_or_else(|| CommandTrail::open(domain, name), |commands| Ok(Some(commands)))?;
        Ok((Self { frames, descriptions, commands }, others))
    }
}

/// Gives frame after frame; after a signal, those that were published before it. So a reader that gets every frame loses
/// none at its end, and one that is slower than the server ends as well.
pub(crate) struct Following<'a> {
    stop: &'a StopFlag,
    stopped_ns: Option<u64>,
}

pub(crate) enum Next {
    /// The oldest frame that has not been read yet.
    Frame(Frame),
    /// None has come for a while.
    Nothing,
    /// There will be no more.
    End,
}

impl<'a> Following<'a> {
    pub(crate) fn until(stop: &'a StopFlag) -> Self {
        Self { stop, stopped_ns: None }
    }

    /// Waits for the next frame, but not for long. The server wakes this reader with a system call a frame.
    pub(crate) fn wait(&mut self, frames: &mut FrameSubscriber) -> Result<Next, BusError> {
        self.next(frames, |frames| frames.wait(WAIT_PERIOD))
    }

    /// The same for a reader to whom a millisecond makes no difference, and which is not woken: it takes what has come in
    /// the meantime, and costs the server nothing.
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

/// How long a run's description may come after its first frame.
const DESCRIPTION_TIMEOUT: Duration = Duration::from_secs(5);
/// How long to wait for one before there are frames: a source hands it to late joiners ten times a second, unless it is
/// gone and has left its services to others.
const FIRST_DESCRIPTION_TIMEOUT: Duration = Duration::from_millis(500);
const DESCRIPTION_LOOK_PERIOD: Duration = Duration::from_millis(1);

/// The descriptions of the runs on an instance.
pub(crate) struct Descriptions {
    reader: DescriptionReader,
    latest: Option<Description>,
}

impl Descriptions {
    /// Opens them, and returns once there is one: at a high rate, a reader that would wait for it at its first frame would
    /// lose those that come in the meantime.
    pub(crate) fn open(domain: &Domain, name: &str, stop: &StopFlag) -> Result<Self, BusError> {
        let mut descriptions = Self { reader: DescriptionReader::open(domain, name)?, latest: None };
        let deadline = Instant::now() + FIRST_DESCRIPTION_TIMEOUT;
        while !descriptions.renew()? && Instant::now() < deadline && !stop.is_set() {
            thread::sleep(DESCRIPTION_LOOK_PERIOD);
        }
        Ok(descriptions)
    }

    /// Waits for the description of a run; frames stay in the reader's buffer meanwhile. `None` where a signal came first.
    ///
    /// # Errors
    /// Where there is none after five seconds, though there are frames.
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
    /// Events lost so far: those that came too fast, and those of a run from long before the trail was opened.
    pub(crate) lost: u64,
}

impl CommandTrail {
    /// Opens the record of an instance, before its frames. `name` begins the names of its nodes. `None` where there is none:
    /// there is no source, or it keeps no record.
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

    /// The oldest event that has not been read yet. Never waits.
    pub(crate) fn receive(&mut self) -> Result<Option<CommandEvent>, BusError> {
        let Some(event) = self.events.receive()? else { return Ok(None) };
        // The events of a run are numbered from 0.
        let expected = self.last.filter(|last| last.run_id == event.run_id).map_or(0, |last| last.number + 1);
        self.lost += event.number.saturating_sub(expected);
        self.last = Some(event);
        Ok(Some(event))
    }

    /// Whether all events of a run's ticks up to this one are there to be received: the run has ended, or its source has
    /// published a later status, before which it publishes them.
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
