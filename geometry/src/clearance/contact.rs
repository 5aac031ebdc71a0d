//! Contacts of two boards. A search may also treat a given clearance as contact.

use std::cmp::Ordering;

use glam::DVec2;

/// A contact: two boards touch, or come within the clearance of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Travel of the head.
    pub travel_m: f64,
    /// Indices of two benches that are not neighbours, the lower one first.
    pub benches: [usize; 2],
    /// Point of contact; the midpoint between the nearest points if the boards are apart.
    pub point: DVec2,
}

impl Contact {
    /// Orders by travel, then by benches.
    pub(super) fn order(&self, other: &Self) -> Ordering {
        self.travel_m.total_cmp(&other.travel_m).then(self.benches.cmp(&other.benches))
    }
}

/// Beginning or end of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PairEvent {
    /// A pair that was apart touches from here on.
    Touch(Contact),
    /// A pair that touched is apart from here on.
    Part(Contact),
}

impl PairEvent {
    /// Travel, benches and point of the event.
    pub fn contact(&self) -> &Contact {
        match self {
            Self::Touch(contact) | Self::Part(contact) => contact,
        }
    }

    /// The same event with another travel, benches and point.
    pub(super) fn with(&self, contact: Contact) -> Self {
        match self {
            Self::Touch(_) => Self::Touch(contact),
            Self::Part(_) => Self::Part(contact),
        }
    }

    /// Orders as [`Contact::order`].
    pub(super) fn order(&self, other: &Self) -> Ordering {
        self.contact().order(other.contact())
    }
}
