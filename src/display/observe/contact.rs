//! Whether benches touch now, or have touched within the last minute.

use bench_dragon_geometry::clearance::PairClearance;
use bench_dragon_geometry::number::Fixed;

use super::snapshot::{Snapshot, SourcePresence};

/// Time for which a contact is recent, in nanoseconds.
const RECENT_NS: u64 = 60_000_000_000;

/// The last contact that the observer has measured, or that a monitor has reported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PastContact {
    /// The two benches, the lower index first.
    pub benches: [u64; 2],
    /// Show time in seconds.
    pub time_s: f64,
    /// Instant at which the observer last measured or received it, in nanoseconds of `CLOCK_MONOTONIC`.
    pub seen_ns: u64,
}

/// A contact that needs action.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Contact {
    /// Two boards touch or overlap in the newest frame.
    Now {
        /// The two benches.
        benches: [usize; 2],
        /// Depth of the overlap in metres; 0 where they only touch.
        depth_m: f64,
    },
    /// Two boards have touched within the last minute, and no boards touch in the newest frame.
    Recent(PastContact),
}

impl Contact {
    /// The contact of a snapshot at an instant of `CLOCK_MONOTONIC`, in nanoseconds.
    pub fn of(snapshot: &Snapshot, now_ns: u64) -> Option<Self> {
        if let Some(PairClearance { benches, clearance_m, .. }) =
            snapshot.nearest.filter(|pair| pair.clearance_m <= 0.0)
        {
            return Some(Self::Now { benches, depth_m: -clearance_m });
        }
        let is_over = matches!(snapshot.presence, SourcePresence::Ended { .. });
        let recent = snapshot.past_contact.filter(|past| !is_over && now_ns.saturating_sub(past.seen_ns) < RECENT_NS);
        recent.map(Self::Recent)
    }

    /// The contact of a snapshot in a few words.
    pub fn words(&self, snapshot: &Snapshot) -> String {
        match *self {
            Self::Now { benches, depth_m: 0.0 } => format!("{} touch", snapshot.pair_words(benches)),
            Self::Now { benches, depth_m } => {
                format!("{} overlap by {} mm", snapshot.pair_words(benches), Fixed::<1>(depth_m * 1e3))
            }
            Self::Recent(PastContact { benches, time_s, .. }) => {
                let pair = snapshot.pair_words(benches.map(|bench| bench as usize));
                format!("{pair} touched at {} s", Fixed::<3>(time_s))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::FrameHeader;
    use glam::DVec2;

    use super::*;

    #[test]
    fn a_contact_is_shown_while_it_lasts_and_for_a_minute() {
        let mut snapshot = Snapshot::live(FrameHeader::default());
        let words = |snapshot: &Snapshot, now_ns| Contact::of(snapshot, now_ns).map(|contact| contact.words(snapshot));
        assert_eq!(words(&snapshot, 0), None);
        for (clearance_m, expected) in
            [(1e-9, None), (0.0, Some("benches 3 and 11 touch")), (-0.084, Some("benches 3 and 11 overlap by 84.0 mm"))]
        {
            snapshot.nearest = Some(PairClearance { benches: [3, 11], clearance_m, point: DVec2::ZERO });
            assert_eq!(words(&snapshot, 0).as_deref(), expected);
        }
        snapshot.nearest = None;
        snapshot.past_contact = Some(PastContact { benches: [0, 8], time_s: 412.473_838, seen_ns: 5 });
        assert_eq!(words(&snapshot, 5 + RECENT_NS - 1).as_deref(), Some("benches 0 and 8 touched at 412.474 s"));
        assert_eq!(words(&snapshot, 5 + RECENT_NS), None);
        snapshot.presence = SourcePresence::Ended { age_ns: 0 };
        assert_eq!(words(&snapshot, 5), None, "the show has ended in order");
    }
}
