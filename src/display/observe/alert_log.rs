//! The alerts that an observer has heard.

use std::collections::VecDeque;

use bench_dragon_ipc::{Alert, AlertKind};

/// How many of the latest are kept.
const KEPT: usize = 200;
/// Kinds of alerts that this version knows.
const KINDS: [AlertKind; 6] =
    [AlertKind::Near, AlertKind::Contact, AlertKind::Parted, AlertKind::Held, AlertKind::Fault, AlertKind::Restarted];

/// An alert and its number, from 0 in the order in which they came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberedAlert {
    /// The number.
    pub number: u64,
    /// The alert.
    pub alert: Alert,
}

/// The latest alerts, and how many there were of each kind.
#[derive(Clone, Debug, Default)]
pub struct AlertLog {
    latest: VecDeque<NumberedAlert>,
    total: u64,
    counts: [u64; KINDS.len()],
}

impl AlertLog {
    /// Takes the next one. Where 200 are kept already, the oldest of a near pair is dropped, so that many of these bury nothing
    /// else; without one, the oldest of all.
    pub fn push(&mut self, alert: Alert) {
        if self.latest.len() == KEPT {
            let oldest = self.latest.iter().position(|kept| kept.alert.alert_kind() == Some(AlertKind::Near));
            self.latest.remove(oldest.unwrap_or_default());
        }
        self.latest.push_back(NumberedAlert { number: self.total, alert });
        self.total += 1;
        if let Some(count) = self.counts.get_mut(alert.kind as usize) {
            *count += 1;
        }
    }

    /// Those that are kept, oldest first.
    pub fn latest(&self) -> impl DoubleEndedIterator<Item = &NumberedAlert> + ExactSizeIterator {
        self.latest.iter()
    }

    /// Those that are kept and have at least this number, oldest first.
    pub fn since(&self, number: u64) -> impl Iterator<Item = &NumberedAlert> {
        self.latest.iter().filter(move |alert| alert.number >= number)
    }

    /// How many there were.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// How many there were of each kind that this version knows.
    pub fn counts(&self) -> impl Iterator<Item = (AlertKind, u64)> {
        KINDS.into_iter().map(|kind| (kind, self.counts[kind as usize]))
    }
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::FrameHeader;

    use super::*;
    use crate::safety::monitor::run_alert;

    #[test]
    fn the_oldest_alerts_are_forgotten_but_counted() {
        let (mut log, header) = (AlertLog::default(), FrameHeader::default());
        for _ in 0..KEPT {
            log.push(run_alert(&header, AlertKind::Near));
        }
        log.push(run_alert(&header, AlertKind::Restarted));
        let numbers: Vec<u64> = log.latest().map(|alert| alert.number).collect();
        assert_eq!(numbers, (1..=KEPT as u64).collect::<Vec<_>>());
        assert_eq!((log.total(), log.since(KEPT as u64).count()), (KEPT as u64 + 1, 1));
        let counts: Vec<u64> = log.counts().map(|(_, count)| count).collect();
        assert_eq!(counts, [KEPT as u64, 0, 0, 0, 0, 1]);
    }

    #[test]
    fn many_near_pairs_bury_no_contact() {
        let (mut log, header) = (AlertLog::default(), FrameHeader::default());
        log.push(run_alert(&header, AlertKind::Contact));
        (0..2 * KEPT).for_each(|_| log.push(run_alert(&header, AlertKind::Near)));
        let first = log.latest().next().map(|kept| (kept.number, kept.alert.alert_kind()));
        assert_eq!((first, log.latest().len()), (Some((0, Some(AlertKind::Contact))), KEPT));
    }

    #[test]
    fn a_kind_that_only_a_newer_monitor_knows_is_kept_and_counted_with_all() {
        let mut log = AlertLog::default();
        log.push(Alert { kind: 77, ..run_alert(&FrameHeader::default(), AlertKind::Near) });
        assert_eq!((log.total(), log.latest().len(), log.counts().map(|(_, count)| count).sum::<u64>()), (1, 1, 0));
    }
}
