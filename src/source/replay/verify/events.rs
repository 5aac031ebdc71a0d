//! Command events of a recording, run by run.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use bench_dragon_ipc::{CommandEvent, EventKind, RunStart};

use super::VerifyError;
use crate::recording::{Parts, PartsReader, Recorded};

/// Greatest number of command events that a verification keeps in memory, 120 bytes each. A guard causes about ten a
/// second.
pub const MOST_EVENTS: usize = 1 << 20;
/// Number of frames that are skipped between two checks of `stop`.
const STRIDE: u64 = 256;

/// Reads the events of all runs and skips the frames. Returns the events by run, and the number of bytes read.
pub(super) fn events_of_runs(
    parts: &Arc<Parts>,
    stop: &AtomicBool,
    mut look: impl FnMut(u64),
) -> Result<(BTreeMap<u64, Vec<CommandEvent>>, u64), VerifyError> {
    let mut recordings = PartsReader::new(Arc::clone(parts));
    let mut runs: BTreeMap<u64, Vec<CommandEvent>> = BTreeMap::new();
    let (mut count, mut passed) = (0, 0_u64);
    let mut is_to_look = |_: &_| {
        passed += 1;
        passed.is_multiple_of(STRIDE)
    };
    while !stop.load(Ordering::Relaxed)
        && let Some(recorded) = recordings.next_wanted(&mut is_to_look)?
    {
        if let Recorded::Command(event) = recorded {
            count += 1;
            if count > MOST_EVENTS {
                return Err(VerifyError::TooManyEvents);
            }
            runs.entry(event.run_id).or_default().push(event);
        }
        look(recordings.bytes_read());
    }
    Ok((runs, recordings.bytes_read()))
}

/// The events of a run from its start up to the first missing event.
pub(super) struct RunEvents {
    pub(super) start: RunStart,
    /// Events after the start, in the order in which the server took them.
    pub(super) events: std::iter::Peekable<std::vec::IntoIter<CommandEvent>>,
    /// Tick from which on events may be missing, and the number of missing events.
    pub(super) gap: Option<(u64, u64)>,
    /// Tick of the last event, where that is not the end of the run.
    pub(super) open_end_tick: Option<u64>,
}

impl RunEvents {
    /// Sorts the events of a run. The error is the reason why they are unusable.
    pub(super) fn new(mut events: Vec<CommandEvent>) -> Result<Self, String> {
        // Other tools may join files so that events are out of order or occur twice.
        events.sort_by_key(|event| event.number);
        events.dedup_by_key(|event| event.number);
        let first = events.first().ok_or(
            "it has no record of commands: its recorder was killed in its first second, or it comes from an earlier \
             version, a replay, or a server on another host",
        )?;
        let start = match (first.number, first.run_start()) {
            (0, Some(start)) => start,
            (0, None) => {
                return Err("its record of commands does not begin with a start: it is not a run of a server".into());
            }
            (missing, _) => {
                return Err(format!(
                    "the first {missing} events of its commands are missing: the recording began too late"
                ));
            }
        };
        let whole = events.iter().zip(0..).take_while(|(event, number)| event.number == *number).count();
        let gap = events.get(whole).map(|behind| {
            let last = &events[whole - 1];
            (last.tick, behind.number - last.number - 1)
        });
        events.truncate(whole);
        if !events.is_sorted_by_key(|event| event.tick) {
            return Err("the ticks of its commands are not in order".to_owned());
        }
        let open_end_tick =
            events.last().filter(|last| last.event_kind() != Some(EventKind::End)).map(|last| last.tick);
        events.remove(0);
        Ok(Self { start, events: events.into_iter().peekable(), gap, open_end_tick })
    }
}
