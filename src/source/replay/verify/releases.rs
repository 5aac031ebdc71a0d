//! When the ticks of a run were due, and the releases that its server missed.

use bench_dragon_ipc::{CommandEvent, FrameHeader};

use super::difference::Difference;
use super::run_check::Stop;
use crate::source::server::schedule::Schedule;

/// When the ticks were due.
#[derive(Clone, Copy, Debug)]
pub(super) struct Releases {
    rate_hz: u32,
    /// When release 0 was due, with those that were missed before the first frame left out.
    epoch_ns: Option<u64>,
    /// The last frame's release.
    last: Option<u64>,
    /// Releases missed before the first frame; `None` where the recording does not say.
    missed_before: Option<u64>,
    /// Releases missed since the first frame.
    missed: u64,
}

impl Releases {
    /// No frame yet, of a server with this rate.
    pub(super) fn at(rate_hz: u32) -> Self {
        Self { rate_hz, epoch_ns: None, last: None, missed_before: None, missed: 0 }
    }

    /// Whether no frame has been taken.
    pub(super) fn is_empty(&self) -> bool {
        self.last.is_none()
    }

    /// Releases missed so far, as far as that is known.
    pub(super) fn overruns(&self) -> u64 {
        self.missed_before.unwrap_or(0).saturating_add(self.missed)
    }

    /// Takes a frame behind so many missing ones. Returns how many releases were missed before it.
    pub(super) fn take(&mut self, header: &FrameHeader, missing: u64) -> Result<u64, Stop> {
        let wrong = |simulated: String| {
            let recorded = header.scheduled_ns.to_string();
            Stop::Differs(Difference::in_words(header, "scheduled_ns", recorded, simulated))
        };
        let Some(last) = self.last else {
            // The first frame's release counts as the one of its tick: missed ones before it are added.
            let epoch_ns = Schedule::from_epoch_ns(header.tick, self.rate_hz)
                .and_then(|elapsed_ns| header.scheduled_ns.checked_sub(elapsed_ns));
            self.epoch_ns = Some(epoch_ns.ok_or_else(|| wrong("a later instant".to_owned()))?);
            self.last = Some(header.tick);
            self.missed_before = (missing == 0).then_some(0);
            return Ok(0);
        };
        let epoch_ns = self.epoch_ns.expect("known since the first frame");
        let (release, off_ns) = Schedule::nearest_release(epoch_ns, self.rate_hz, header.scheduled_ns)
            .ok_or_else(|| wrong("a later instant".to_owned()))?;
        // Where the first frame's release is not known for certain, rounding may fall otherwise.
        let tolerance_ns = u64::from(self.missed_before != Some(0));
        if off_ns > tolerance_ns {
            return Err(wrong(format!("a release, the nearest of which is {off_ns} ns away")));
        }
        let missed = release.checked_sub(last).and_then(|ahead| ahead.checked_sub(missing.saturating_add(1)));
        let missed = missed.ok_or_else(|| wrong("a later release".to_owned()))?;
        self.last = Some(release);
        self.missed += missed;
        Ok(missed)
    }

    /// Checks that an event counts as many missed releases as the frames show.
    pub(super) fn agree_with(&mut self, event: &CommandEvent, header: Option<&FrameHeader>) -> Result<(), Stop> {
        let before = self.missed_before.or_else(|| event.overruns.checked_sub(self.missed));
        if before.is_some_and(|before| before + self.missed == event.overruns) {
            // An event before the first frame that counts none proves nothing of those after it.
            let is_behind_first = header.is_some();
            self.missed_before = if is_behind_first { before } else { self.missed_before };
            return Ok(());
        }
        let of_event = FrameHeader { tick: event.tick, sim_time_ns: event.sim_time_ns, ..FrameHeader::default() };
        let shown = self.overruns();
        let field = format!("overruns of command event {}", event.number);
        let (recorded, simulated) = (event.overruns.to_string(), format!("{shown} by the frames"));
        Err(Stop::Differs(Difference::in_words(header.unwrap_or(&of_event), &field, recorded, simulated)))
    }
}
