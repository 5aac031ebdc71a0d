//! The formation: all dragons of a show, on one clock.
//!
//! The place of every dragon depends on one number. So a formation is always in a pose of its plan, and proofs about it are about
//! one number. Each dragon has a [`Timetable`]; [`Layout`] numbers the benches and the handles of all of them.

mod course;
mod delay_set;
mod even_run;
mod layout;
mod planned_walk;
mod stepper;
mod timetable;

use std::sync::Arc;

use glam::DVec3;

use crate::dragon::{Board, Chain, Dragon, Meter};

use course::Course;

pub use course::HeadAt;
pub use delay_set::DelaySet;
pub use layout::Layout;
pub use stepper::FormationStepper;
pub use timetable::{Change, Timetable};

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
        // The end is exact, so that a dragon which stands there has ended.
        if time_s >= self.timetable.end_s() { end_m } else { self.timetable.travel_m(time_s).clamp(start_m, end_m) }
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

    /// The last plan time between two plan times at which the head has walked no further than to a travel, to rounding.
    pub(crate) fn last_before_s(&self, travel_m: f64, [from_s, to_s]: [f64; 2]) -> f64 {
        let planned_s = self.timetable.time_s(travel_m).clamp(from_s, to_s);
        let mut time_s = planned_s;
        let mut step_s = f64::EPSILON * planned_s.abs().max(1.0);
        while self.travel_m(time_s) > travel_m && time_s > from_s {
            time_s = (planned_s - step_s).max(from_s);
            step_s *= 2.0;
        }
        time_s
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
    course: Course,
}

impl Formation {
    /// A formation of one dragon, whose course is the travel of its head.
    pub fn of_one(planned: Planned) -> Self {
        Self::with_course(vec![planned], Course::Travel)
    }

    /// A formation of these dragons, the leading one first, whose course is plan time × the planned speed of the leading dragon.
    ///
    /// # Panics
    /// Panics without a dragon.
    pub fn new(dragons: Vec<Planned>) -> Self {
        Self::beginning_at(0.0, dragons)
    }

    /// The same, with another plan time at which the course begins. The first dragon leaves then or later.
    ///
    /// # Panics
    /// Panics without a dragon.
    pub fn beginning_at(begin_s: f64, dragons: Vec<Planned>) -> Self {
        let lead = dragons.first().expect("a formation has a dragon");
        let end_s = dragons.iter().map(|planned| planned.timetable.end_s()).fold(begin_s, f64::max);
        let course = Course::Plan { speed_mps: lead.timetable.planned_mps(), begin_s, end_s };
        Self::with_course(dragons, course)
    }

    fn with_course(dragons: Vec<Planned>, course: Course) -> Self {
        let layout = Layout::of(dragons.iter().map(|planned| planned.dragon.dimensions().benches()));
        Self { dragons, layout, course }
    }

    /// The same formation with another meter for the work of all dragons.
    #[must_use]
    pub fn metered(&self, meter: &Meter) -> Self {
        let metered = |planned: &Planned| Planned {
            dragon: Arc::new(planned.dragon.metered(meter)),
            timetable: planned.timetable.clone(),
        };
        Self { dragons: self.dragons.iter().map(metered).collect(), layout: self.layout.clone(), course: self.course }
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

    /// Whether the course is plan time × speed. It is the travel of the head otherwise.
    pub fn has_plan_course(&self) -> bool {
        self.course != Course::Travel
    }

    /// Where the course begins, in metres.
    pub fn begin_m(&self) -> f64 {
        match self.course {
            Course::Travel => self.lead().start_travel_m(),
            Course::Plan { speed_mps, begin_s, .. } => speed_mps * begin_s,
        }
    }

    /// Plan time at which a plan's course begins, in seconds.
    pub fn begin_s(&self) -> f64 {
        match self.course {
            Course::Travel => self.timetable().start_s(),
            Course::Plan { begin_s, .. } => begin_s,
        }
    }

    /// Plan time at which a plan's course ends, in seconds.
    pub fn end_s(&self) -> f64 {
        match self.course {
            Course::Travel => self.timetable().end_s(),
            Course::Plan { end_s, .. } => end_s,
        }
    }

    /// Where the course ends, in metres: no dragon walks further.
    pub fn end_m(&self) -> f64 {
        match self.course {
            Course::Travel => self.lead().end_travel_m(),
            Course::Plan { speed_mps, end_s, .. } => speed_mps * end_s,
        }
    }

    /// A dragon at a place of the course, while the formation goes along its course at `speed_mps`. Places beyond the ends count as
    /// the ends; of a course that is a travel they stay as they are.
    pub fn motion(&self, dragon: usize, course_m: f64, speed_mps: f64) -> HeadAt {
        let planned = &self.dragons[dragon];
        let (travel_m, speed_mps) = match self.course {
            Course::Travel => (course_m, speed_mps),
            Course::Plan { speed_mps: planned_mps, end_s, .. } => {
                let plan_s = if course_m >= planned_mps * end_s { end_s } else { course_m / planned_mps };
                (planned.travel_m(plan_s), planned.speed_mps(plan_s) * (speed_mps / planned_mps))
            }
        };
        HeadAt { travel_m, speed_mps, has_ended: travel_m >= planned.dragon.end_travel_m() }
    }

    /// Travel of the head of a dragon at a place of the course.
    pub fn travel_m(&self, dragon: usize, course_m: f64) -> f64 {
        self.motion(dragon, course_m, 0.0).travel_m
    }

    /// Greatest change of the speed along the course that asks no head for more than its acceleration while all walk evenly, in
    /// m/s². `None` if all heads start and stop at once.
    pub fn accel_mps2(&self) -> Option<f64> {
        let lead_mps = self.timetable().planned_mps();
        let scaled = |Planned { timetable, .. }: &Planned| {
            let accel_mps2 = timetable.most_accel_mps2();
            // Not lead ÷ own × own: of one dragon the value stays as it is, to the last bit.
            (accel_mps2 > 0.0).then(|| accel_mps2 * (lead_mps / timetable.most_speed_mps()))
        };
        self.dragons.iter().filter_map(scaled).reduce(f64::min)
    }

    /// The first place of the course at which the head of a dragon has a travel that it walks.
    pub fn place_of(&self, dragon: usize, travel_m: f64) -> f64 {
        match self.course {
            Course::Travel => travel_m,
            Course::Plan { .. } => self.course_m(self.dragons[dragon].timetable.time_s(travel_m)),
        }
    }

    /// Plan time of a place of a plan's course, in seconds.
    pub fn plan_s(&self, course_m: f64) -> f64 {
        course_m / self.timetable().planned_mps()
    }

    /// Planned speed of the leading head at a place of a plan's course, apart from ramps and rests, in metres per second of plan time.
    pub fn ordered_mps(&self, course_m: f64) -> f64 {
        self.timetable().ordered_mps(self.plan_s(course_m))
    }

    /// Place of the course at a plan time, in metres.
    pub fn course_m(&self, plan_s: f64) -> f64 {
        plan_s * self.timetable().planned_mps()
    }

    /// The boards of all benches at a place of the course, by the reference solver.
    ///
    /// # Panics
    /// Panics for a place that is not on the course.
    pub fn boards_at(&self, course_m: f64) -> Vec<Board> {
        let mut boards = Vec::with_capacity(self.layout.benches());
        for (number, planned) in self.dragons.iter().enumerate() {
            let chain = planned.dragon.chain(self.travel_m(number, course_m)).expect("a place of the course");
            let handles: Vec<DVec3> = chain.map(|handle| handle.in_space()).collect();
            planned.dragon.add_boards(&handles, |&position_m| position_m, &mut boards);
        }
        boards
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
