//! The newest frame of the bus, at each release of a rate that is the bridge's own.

use std::time::Duration;

use bench_dragon::bridge::{Snapshot, freshness};
use bench_dragon::clock::{monotonic_ns, sleep_until};
use bench_dragon::server::schedule::Schedule;
use bench_dragon::stop::StopFlag;
use bench_dragon_ipc::{BusError, Domain, FrameSubscriber};

use crate::command::follow::{WAIT_PERIOD, open_when_there};

/// The oldest frame that is told as fresh: the slowest server sends one a second.
const FRESH_FOR: Duration = Duration::from_millis(1_500);

/// Polls the bus at a fixed rate, so that the server wakes nobody. A server that is gone leaves its last frame to be told
/// again, as stale; that of the next one follows by itself.
#[derive(Debug)]
pub(super) struct Feed<'a> {
    stop: &'a StopFlag,
    frames: FrameSubscriber,
    schedule: Schedule,
    epoch_ns: u64,
    snapshot: Option<Snapshot>,
}

/// An instant at which to send.
#[derive(Debug)]
pub(super) struct Release<'a> {
    /// When it is, in nanoseconds of `CLOCK_MONOTONIC`.
    pub(super) now_ns: u64,
    /// What to send.
    pub(super) snapshot: &'a Snapshot,
}

impl<'a> Feed<'a> {
    /// Waits for a server, and counts releases from the moment at which there is one. `None` where a signal came first.
    pub(super) fn open(
        domain: &Domain,
        name: &str,
        rate_hz: u32,
        stop: &'a StopFlag,
    ) -> Result<Option<Self>, BusError> {
        let epoch_ns = monotonic_ns();
        let opened = open_when_there(domain.instance(), stop, || FrameSubscriber::open(domain, name))?;
        Ok(opened.map(|frames| Self {
            stop,
            frames,
            schedule: Schedule::new(monotonic_ns(), rate_hz),
            epoch_ns,
            snapshot: None,
        }))
    }

    /// When the bridge started, in nanoseconds of `CLOCK_MONOTONIC`.
    pub(super) fn epoch_ns(&self) -> u64 {
        self.epoch_ns
    }

    /// Waits for the next release at which there is something to send. `None` after a signal.
    pub(super) fn next(&mut self) -> Result<Option<Release<'_>>, BusError> {
        loop {
            if !self.sleep_until(self.schedule.due_ns()) {
                return Ok(None);
            }
            match (self.frames.latest()?, &mut self.snapshot) {
                (Some(frame), Some(snapshot)) => snapshot.replace(&frame),
                (Some(frame), none) => *none = Some(Snapshot::of(&frame)),
                (None, _) => {}
            }
            let now_ns = monotonic_ns();
            self.schedule.advance(now_ns);
            if let Some(snapshot) = &mut self.snapshot {
                snapshot.freshness = freshness(snapshot.header.published_ns, now_ns, FRESH_FOR);
                break;
            }
        }
        Ok(self.snapshot.as_ref().map(|snapshot| Release { now_ns: monotonic_ns(), snapshot }))
    }

    /// Releases that have passed while the bridge was busy.
    pub(super) fn missed(&self) -> u64 {
        self.schedule.overruns()
    }

    /// Sleeps until an instant, in pieces. Returns false after a signal.
    fn sleep_until(&self, deadline_ns: u64) -> bool {
        let piece_ns = WAIT_PERIOD.as_nanos() as u64;
        while !self.stop.is_set() {
            let now_ns = monotonic_ns();
            if now_ns >= deadline_ns {
                return true;
            }
            sleep_until(deadline_ns.min(now_ns + piece_ns));
        }
        false
    }
}
