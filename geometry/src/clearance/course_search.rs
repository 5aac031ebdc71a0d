//! Searches along the course of a formation: [`ContactSearch`] for a course that is a travel, and otherwise one for each dragon and
//! one between them.

use super::contact::{Contact, PairEvent};
use super::contact_search::{ContactSearch, Sweep};
use super::formation_search::{BetweenSearch, Meeting, meeting_at};
use crate::dragon::meter::Spent;
use crate::formation::{Formation, Planned};

/// Searches the course of a formation for contacts, or for pairs within a clearance. Here, *touch* means either. The `travel_m` of
/// its contacts is a place of the course, and benches are numbered on from dragon to dragon.
#[derive(Clone, Debug)]
pub struct CourseSearch {
    formation: Formation,
    clearance_m: f64,
    within: Vec<ContactSearch>,
    /// The search between dragons, of which there may be one; `None` for a course that is a travel.
    between: Option<BetweenSearch>,
    /// Place at which the last search for the first contact ended without one.
    searched_to_m: Option<f64>,
    events: Vec<PairEvent>,
}

impl CourseSearch {
    /// A search for pairs with a clearance of at most `clearance_m`; with 0, for contacts.
    ///
    /// # Panics
    /// Panics for a clearance that is negative or not finite.
    pub fn within(formation: &Formation, clearance_m: f64) -> Self {
        let within = |planned: &Planned| ContactSearch::within(&planned.dragon, clearance_m);
        Self {
            clearance_m,
            within: formation.dragons().iter().map(within).collect(),
            between: formation.has_plan_course().then(|| BetweenSearch::new(formation, clearance_m)),
            searched_to_m: None,
            events: Vec::new(),
            formation: formation.clone(),
        }
    }

    /// Finds the first place between two places at which some pair touches. Places outside the course are ignored. If pairs touch at
    /// the beginning already, the result is the deepest of them, and of equal ones that with the lowest indices. A search that starts
    /// where the last one ended continues it.
    ///
    /// # Errors
    /// The meter of the dragons is spent before the search is finished, or too many pairs are near each other. No benches touch up
    /// to the place in the error.
    pub fn first(&mut self, from_m: f64, to_m: f64) -> Result<Option<Contact>, Spent> {
        let (from_m, to_m) = (from_m.max(self.formation.begin_m()), to_m.min(self.formation.end_m()));
        let Some(between) = &mut self.between else { return self.within[0].first(from_m, to_m) };
        if from_m > to_m {
            return Ok(None);
        }
        let [from_s, to_s] = [from_m, to_m].map(|course_m| self.formation.plan_s(course_m));
        let contact = |formation: &Formation, meeting: Meeting| Contact {
            travel_m: if meeting.time_s == from_s { from_m } else { formation.course_m(meeting.time_s) },
            benches: meeting.benches,
            point: meeting.point,
        };
        if self.searched_to_m.take() != Some(from_m)
            && let Some(meeting) = meeting_at(&self.formation, self.clearance_m, from_s)
        {
            return Ok(Some(contact(&self.formation, meeting)));
        }
        let mut first: Option<Contact> = None;
        for (dragon, within) in self.within.iter_mut().enumerate() {
            let end_m = first.map_or(to_m, |first| first.travel_m);
            let [begin_m, end_m] = [from_m, end_m].map(|course_m| self.formation.travel_m(dragon, course_m));
            // Nothing is known yet about the other dragons, and between them.
            let found = within.first(begin_m, end_m).map_err(|spent| Spent { reached_m: from_m, ..spent })?;
            let found = found.map(|found| on_course(&self.formation, dragon, found, [from_m, to_m]));
            first = found.filter(|found| first.is_none_or(|first| found.travel_m < first.travel_m)).or(first);
        }
        let end_s = first.map_or(to_s, |first| self.formation.plan_s(first.travel_m));
        let met = between.first(from_s, end_s).map_err(|unfinished| Spent {
            reached_m: self.formation.course_m(unfinished.reached_s).clamp(from_m, to_m),
            ..unfinished.spent
        })?;
        let met = met.map(|meeting| contact(&self.formation, meeting));
        let result = met.filter(|met| first.is_none_or(|first| met.travel_m < first.travel_m)).or(first);
        self.searched_to_m = result.is_none().then_some(to_m);
        Ok(result)
    }

    /// Finds all beginnings and ends of contacts between two places, in order, as [`ContactSearch::sweep`].
    pub fn sweep(&mut self, from_m: f64, to_m: f64) -> Sweep<'_> {
        let Some(between) = &mut self.between else { return self.within[0].sweep(from_m, to_m) };
        self.searched_to_m = None;
        self.events.clear();
        let mut reached_m = to_m;
        for (dragon, within) in self.within.iter_mut().enumerate() {
            let [begin_m, end_m] = [from_m, to_m].map(|course_m| self.formation.travel_m(dragon, course_m));
            if begin_m == end_m {
                continue;
            }
            let swept = within.sweep(begin_m, end_m);
            let moved = |contact: &Contact| on_course(&self.formation, dragon, *contact, [from_m, to_m]);
            self.events.extend(swept.events.iter().map(|event| event.with(moved(event.contact()))));
            if swept.reached_m < end_m {
                let reached_s = self.formation.dragons()[dragon].timetable.time_s(swept.reached_m);
                reached_m = reached_m.min(self.formation.course_m(reached_s)).max(from_m);
            }
        }
        let [from_s, to_s] = [from_m, to_m].map(|course_m| self.formation.plan_s(course_m));
        let begin = self.events.len();
        let within = &self.within;
        let swept_s = between.sweep(from_s, to_s, |dragon| Some(within[dragon].last_pose()), &mut self.events);
        for event in &mut self.events[begin..] {
            let contact = *event.contact();
            *event = event.with(Contact { travel_m: self.formation.course_m(contact.travel_m), ..contact });
        }
        if swept_s < to_s {
            reached_m = reached_m.min(self.formation.course_m(swept_s)).max(from_m);
        }
        self.events.retain(|event| event.contact().travel_m <= reached_m);
        self.events.sort_unstable_by(PairEvent::order);
        Sweep { events: &self.events, reached_m }
    }
}

/// A contact within a dragon, at a travel of that dragon, as one of the formation between two places of the course.
fn on_course(formation: &Formation, dragon: usize, contact: Contact, [from_m, to_m]: [f64; 2]) -> Contact {
    let begin = formation.layout().benches_of(dragon).start;
    let plan_s = formation.dragons()[dragon].timetable.time_s(contact.travel_m);
    Contact {
        travel_m: formation.course_m(plan_s).clamp(from_m, to_m),
        benches: contact.benches.map(|bench| begin + bench),
        point: contact.point,
    }
}
