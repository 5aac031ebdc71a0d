//! The record of commands as a process reads it off the bus: every event, and how many were lost.

use bench_dragon_ipc::{BusError, CommandEvent, CommandEventReader, Domain, EventKind, SourceLock, StatusReader};

/// The events of the runs on an instance, oldest first.
#[derive(Debug)]
pub(crate) struct CommandTrail {
    events: CommandEventReader,
    statuses: StatusReader,
    domain: Domain,
    /// The newest event.
    last: Option<CommandEvent>,
    /// Run and tick of the newest status.
    status: Option<(u64, u64)>,
    lost: u64,
}

impl CommandTrail {
    /// Opens the record of an instance, before its frames. `name` begins the names of its nodes. `None` where there is none:
    /// there is no source, or it keeps no record.
    ///
    /// # Errors
    /// As [`CommandEventReader::open`] and [`StatusReader::open`], but for their absence.
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
    ///
    /// # Errors
    /// As [`CommandEventReader::receive`].
    pub(crate) fn receive(&mut self) -> Result<Option<CommandEvent>, BusError> {
        let Some(event) = self.events.receive()? else { return Ok(None) };
        // The events of a run are numbered from 0.
        let expected = self.last.filter(|last| last.run_id == event.run_id).map_or(0, |last| last.number + 1);
        self.lost += event.number.saturating_sub(expected);
        self.last = Some(event);
        Ok(Some(event))
    }

    /// Events lost so far: those that came too fast, and those of a run from long before the trail was opened.
    pub(crate) fn lost(&self) -> u64 {
        self.lost
    }

    /// Whether all events of a run's ticks up to this one are there to be received: the run has ended, or its source has
    /// published a later status, before which it publishes them.
    ///
    /// # Errors
    /// As [`StatusReader::poll`].
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
