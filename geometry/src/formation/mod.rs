//! The formation: all dragons of a show, on one clock.
//!
//! The place of every dragon depends on one number. So a formation is always in a pose of its plan, and proofs about it are about
//! one number. Each dragon has a [`Timetable`]; [`Layout`] numbers the benches and the handles of all of them.

mod layout;
mod timetable;

use std::sync::Arc;

use glam::DVec3;

use crate::dragon::{Board, Dragon};

pub use layout::Layout;
pub use timetable::Timetable;

/// A dragon with its timetable.
#[derive(Clone, Debug)]
pub struct Planned {
    /// The dragon on its route.
    pub dragon: Arc<Dragon>,
    /// Its travel over show time, on a run without commands.
    pub timetable: Timetable,
}

/// All dragons of a show. The first one leads: travels and speeds of the show are those of its head.
#[derive(Clone, Debug)]
pub struct Formation {
    lead: Planned,
    layout: Layout,
}

impl Formation {
    /// A formation of one dragon.
    pub fn of_one(lead: Planned) -> Self {
        let layout = Layout::of([lead.dragon.dimensions().benches()]);
        Self { lead, layout }
    }

    /// The dragon that leads.
    pub fn lead(&self) -> &Arc<Dragon> {
        &self.lead.dragon
    }

    /// Timetable of the dragon that leads.
    pub fn timetable(&self) -> &Timetable {
        &self.lead.timetable
    }

    /// The numbers of all benches and handles.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Replaces `boards` by the boards of all benches, of handles from which `position` returns the position in space.
    ///
    /// # Panics
    /// Panics if there is not one handle for each handle of the layout.
    pub fn place_boards<T>(&self, handles: &[T], position: impl Fn(&T) -> DVec3, boards: &mut Vec<Board>) {
        assert_eq!(handles.len(), self.layout.handles(), "the handles of a formation");
        self.lead.dragon.place_boards_at(handles, position, boards);
    }
}
