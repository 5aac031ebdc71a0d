//! Changes of a pair between apart and in touch, or within whatever clearance a search is for.

use std::cmp::Ordering;

use glam::DVec2;

/// Two boards touch, or come within the clearance that was searched for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Travel of the head.
    pub travel_m: f64,
    /// Lower index first; not neighbours.
    pub benches: [usize; 2],
    /// Where they touch; midway between their nearest points if they are apart.
    pub point: DVec2,
}

/// A change between apart and in touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PairEvent {
    /// A pair that was apart touches.
    Touch(Contact),
    /// A pair that was in touch is apart from here on.
    Part(Contact),
}

impl PairEvent {
    /// Where and when.
    pub fn contact(&self) -> &Contact {
        match self {
            Self::Touch(contact) | Self::Part(contact) => contact,
        }
    }

    /// By travel, then by benches.
    pub(super) fn order(&self, other: &Self) -> Ordering {
        let (ours, theirs) = (self.contact(), other.contact());
        ours.travel_m.total_cmp(&theirs.travel_m).then(ours.benches.cmp(&theirs.benches))
    }
}
