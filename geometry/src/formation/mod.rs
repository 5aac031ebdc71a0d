//! The formation: all dragons of a show, on one clock.
//!
//! The place of every dragon depends on one number. So a formation is always in a pose of its plan, and proofs about it are about
//! one number. Each dragon has a [`Timetable`]; [`Layout`] numbers the benches and the handles of all of them.

mod delay_set;
mod layout;
mod timetable;

use std::sync::Arc;

use glam::DVec3;

use crate::dragon::{Board, Chain, Dragon, Meter};

pub use delay_set::DelaySet;
pub use layout::Layout;
pub use timetable::Timetable;

/// A dragon with its timetable.
#[derive(Clone, Debug)]
pub struct Planned {
    /// The dragon on its route.
    pub dragon: Arc<Dragon>,
    /// Travel of its head over plan time.
    pub timetable: Timetable,
}

impl Planned {
    /// Travel of the head at a plan time. Before its start and after its end, the dragon stands at the ends of its run.
    pub fn travel_m(&self, time_s: f64) -> f64 {
        let (start_m, end_m) = (self.dragon.start_travel_m(), self.dragon.end_travel_m());
        self.timetable.travel_m(time_s).clamp(start_m, end_m)
    }

    /// Speed of the head at a plan time, in metres per second of it: 0 before its start and after its end.
    pub fn speed_mps(&self, time_s: f64) -> f64 {
        let is_walking = (self.timetable.start_s()..self.timetable.end_s()).contains(&time_s);
        if is_walking { self.timetable.speed_mps(time_s) } else { 0.0 }
    }

    /// The same dragon, which leaves at another plan time.
    #[must_use]
    pub fn leaving_at(&self, start_s: f64) -> Self {
        let timetable = self.timetable.delayed(start_s - self.timetable.start_s());
        Self { dragon: Arc::clone(&self.dragon), timetable }
    }

    /// The chain at a plan time.
    pub(crate) fn chain_at(&self, time_s: f64) -> Chain<'_> {
        self.dragon.chain(self.travel_m(time_s)).expect("a travel of the timetable is in the run")
    }
}

/// All dragons of a show. The first one leads: speeds of the show are those of its head.
#[derive(Clone, Debug)]
pub struct Formation {
    dragons: Vec<Planned>,
    layout: Layout,
}

impl Formation {
    /// A formation of these dragons, the leading one first.
    ///
    /// # Panics
    /// Panics without a dragon.
    pub fn new(dragons: Vec<Planned>) -> Self {
        assert!(!dragons.is_empty(), "a formation without a dragon");
        let layout = Layout::of(dragons.iter().map(|planned| planned.dragon.dimensions().benches()));
        Self { dragons, layout }
    }

    /// The same formation with another meter for the work of all dragons.
    #[must_use]
    pub fn metered(&self, meter: &Meter) -> Self {
        let metered = |planned: &Planned| Planned {
            dragon: Arc::new(planned.dragon.metered(meter)),
            timetable: planned.timetable,
        };
        Self { dragons: self.dragons.iter().map(metered).collect(), layout: self.layout.clone() }
    }

    /// The same formation, in which each dragon leaves at another plan time.
    ///
    /// # Panics
    /// Panics if there is not one time for each dragon.
    #[must_use]
    pub fn leaving_at(&self, starts_s: &[f64]) -> Self {
        assert_eq!(starts_s.len(), self.dragons.len(), "the starts of a formation");
        let leaving = |(planned, start_s): (&Planned, &f64)| planned.leaving_at(*start_s);
        Self::new(self.dragons.iter().zip(starts_s).map(leaving).collect())
    }

    /// The dragons, the leading one first.
    pub fn dragons(&self) -> &[Planned] {
        &self.dragons
    }

    /// The dragon that leads.
    pub fn lead(&self) -> &Arc<Dragon> {
        &self.dragons[0].dragon
    }

    /// Timetable of the dragon that leads.
    pub fn timetable(&self) -> &Timetable {
        &self.dragons[0].timetable
    }

    /// The end of a stride of plan time: no head walks more than `links` lengths of its shorter link, and no speed changes at once
    /// in between.
    pub(crate) fn stride_end_s(&self, from_s: f64, links: f64) -> f64 {
        let ends = self.dragons.iter().map(|Planned { dragon, timetable }| {
            let link_m = dragon.dimensions().link_m(0).min(dragon.dimensions().link_m(1));
            let walked_s = from_s + links * link_m / timetable.most_speed_mps();
            timetable.next_jump_s(from_s).map_or(walked_s, |jump_s| walked_s.min(jump_s))
        });
        ends.fold(f64::INFINITY, f64::min)
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
        boards.clear();
        for (number, Planned { dragon, .. }) in self.dragons.iter().enumerate() {
            dragon.add_boards(&handles[self.layout.handles_of(number)], &position, boards);
        }
    }
}
