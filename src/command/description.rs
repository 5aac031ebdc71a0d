//! The description that belongs to a frame.

use std::thread;
use std::time::{Duration, Instant};

use anyhow::bail;
use bench_dragon_ipc::{BusError, Description, DescriptionReader, Domain};

use crate::system::stop::StopFlag;

/// How long a run's description may come after its first frame.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long to wait for one before there are frames: a source hands it to late joiners ten times a second, unless it is
/// gone and has left its services to others.
const OPENING_PATIENCE: Duration = Duration::from_millis(500);
const LOOK_PERIOD: Duration = Duration::from_millis(1);

/// The descriptions of the runs on an instance.
#[derive(Debug)]
pub(crate) struct Descriptions {
    reader: DescriptionReader,
    latest: Option<Description>,
}

impl Descriptions {
    /// Opens them, and returns once there is one: at a high rate, a reader that would wait for it at its first frame would
    /// lose those that come in the meantime.
    ///
    /// # Errors
    /// As [`DescriptionReader::open`] and [`DescriptionReader::poll`].
    pub(crate) fn open(domain: &Domain, name: &str, stop: &StopFlag) -> Result<Self, BusError> {
        let mut descriptions = Self { reader: DescriptionReader::open(domain, name)?, latest: None };
        let deadline = Instant::now() + OPENING_PATIENCE;
        while !descriptions.renew()? && Instant::now() < deadline && !stop.is_set() {
            thread::sleep(LOOK_PERIOD);
        }
        Ok(descriptions)
    }

    /// Waits for the description of a run; frames stay in the reader's buffer meanwhile. `None` where a signal came first.
    ///
    /// # Errors
    /// Where there is none after five seconds, though there are frames.
    pub(crate) fn of(&mut self, run_id: u64, stop: &StopFlag) -> anyhow::Result<Option<&Description>> {
        let deadline = Instant::now() + PATIENCE;
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
            thread::sleep(LOOK_PERIOD);
        }
        Ok(self.latest.as_ref())
    }

    /// Takes the next description, where there is one.
    fn renew(&mut self) -> Result<bool, BusError> {
        let next = self.reader.poll()?;
        let is_there = next.is_some();
        self.latest = next.or(self.latest.take());
        Ok(is_there)
    }
}
