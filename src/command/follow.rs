//! Waiting for a server that is not there yet, and following its frames until a signal comes.

use std::thread;
use std::time::Duration;

use bench_dragon_ipc::{BusError, Frame, FrameSubscriber, Instance};

use crate::command::output::complain;
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

/// How often a missing server is looked for.
const LOOK_PERIOD: Duration = Duration::from_millis(20);
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
                thread::sleep(LOOK_PERIOD);
            }
            Err(error) => return Err(error),
        }
    }
    Ok(None)
}

/// Gives frame after frame; after a signal, those that were published before it. So a reader that gets every frame loses
/// none at its end, and one that is slower than the server ends as well.
#[derive(Debug)]
pub(crate) struct Following<'a> {
    stop: &'a StopFlag,
    stopped_ns: Option<u64>,
}

/// What a reader is given.
#[derive(Debug)]
pub(crate) enum Next {
    /// The oldest frame that has not been read yet.
    Frame(Frame),
    /// None has come for a while.
    Nothing,
    /// There will be no more.
    End,
}

impl<'a> Following<'a> {
    /// Follows until this flag is set.
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
