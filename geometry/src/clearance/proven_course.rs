//! Proven course: an interval of a formation's course on which no two benches come nearer than a margin.
//!
//! Within each dragon, and between it and the borders of a stage, it is [`ProvenTravel`]. Between dragons, a certified search shows that no pair comes within the margin and a
//! little more ([`RESERVE_M`]). So where that search finds a pair, its clearance is still at least the margin, and the proof ends there.

use super::border_search::Breach;
use super::formation_search::BetweenSearch;
use super::proven_travel::ProvenTravel;
use super::search::{ClearanceSearch, PairClearance};
use crate::formation::Formation;
use crate::stage::Stage;

/// Clearance over the margin at which the proof between dragons ends, in metres: more than any pair can close within the resolution
/// of the search, 10⁻¹¹ s.
const RESERVE_M: f64 = 1e-9;
/// Longest walk of a head on one stride of the proof, in lengths of the shorter link.
const STRIDE_LINKS: f64 = 1.0;

/// An interval of proven course, which can grow.
#[derive(Clone, Debug)]
pub struct ProvenCourse<'a> {
    formation: &'a Formation,
    within: Vec<ProvenTravel<'a>>,
    /// The proof between dragons; `None` for a course that is a travel.
    between: Option<Between>,
}

/// Why a place of a course is not proven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Violation {
    /// The nearest pair is nearer than the margin; for loose hinges as [`ProvenTravel::at`].
    Pair(PairClearance),
    /// A board is beyond a border of the stage, or nearer to it than the stage allows. Its bench is numbered on from dragon to dragon.
    Border(Breach),
}

/// The proof between dragons.
#[derive(Clone, Debug)]
struct Between {
    search: BetweenSearch,
    begin_m: f64,
    /// Plan time at the present end. Strides go from plan time to plan time, so that rounding does not keep one from advancing.
    end_s: f64,
    /// Whether a violation follows the interval.
    is_ended: bool,
}

impl<'a> ProvenCourse<'a> {
    /// The interval that contains only one place of the course. With a stage, the proof is also about its borders.
    ///
    /// # Errors
    /// What does not keep clear there.
    pub fn at(
        formation: &'a Formation,
        stage: Option<&'a Stage>,
        margin_m: f64,
        course_m: f64,
    ) -> Result<Self, Violation> {
        let mut within = Vec::new();
        for (dragon, planned) in formation.dragons().iter().enumerate() {
            let begin = formation.layout().benches_of(dragon).start;
            let proven = ProvenTravel::at(&planned.dragon, margin_m, formation.travel_m(dragon, course_m));
            let proven = proven.map_err(|nearest| Violation::Pair(nearest.numbered_from(begin)))?;
            let proven = stage.into_iter().try_fold(proven, ProvenTravel::within_borders);
            within.push(proven.map_err(|breach| Violation::Border(Breach { bench: begin + breach.bench, ..breach }))?);
        }
        if !formation.has_plan_course() {
            return Ok(Self { formation, within, between: None });
        }
        let boards = formation.boards_at(course_m);
        let nearest = ClearanceSearch::of(&formation.layout().between_dragons()).nearest(&boards);
        if let Some(nearest) = nearest.filter(|nearest| nearest.clearance_m < margin_m) {
            return Err(Violation::Pair(nearest));
        }
        // A pair in the reserve has no beginning that the search could find.
        let is_ended = nearest.is_some_and(|nearest| nearest.clearance_m <= margin_m + 2.0 * RESERVE_M);
        let search = BetweenSearch::new(formation, margin_m + RESERVE_M);
        let between = Some(Between { search, begin_m: course_m, end_s: formation.plan_s(course_m), is_ended });
        Ok(Self { formation, within, between })
    }

    /// Extends the proof up to `to_m`. The work of one call is bounded as that of [`ProvenTravel::extend`].
    pub fn extend(&mut self, to_m: f64, handles: usize) {
        let Self { formation, within, between } = self;
        let Some(between) = between else { return within[0].extend(to_m, handles) };
        let to_s = formation.plan_s(to_m.min(formation.end_m()));
        let meter = formation.lead().meter();
        for stride in 0..=handles / formation.layout().handles() {
            if between.is_ended || between.end_s >= to_s {
                return;
            }
            let mut next_s = formation.stride_end_s(between.end_s, STRIDE_LINKS).min(to_s);
            let mut has_ended = false;
            for (dragon, proven) in within.iter_mut().enumerate() {
                let next_travel_m = formation.dragons()[dragon].travel_m(next_s);
                proven.extend(next_travel_m, handles);
                if proven.end_m() < next_travel_m {
                    if !proven.is_whole() {
                        return;
                    }
                    next_s = formation.dragons()[dragon].last_before_s(proven.end_m(), [between.end_s, next_s]);
                    has_ended = true;
                }
            }
            meter.restart();
            match between.search.first(between.end_s, next_s) {
                Ok(None) => (between.end_s, between.is_ended) = (next_s, has_ended),
                Ok(Some(meeting)) => (between.end_s, between.is_ended) = (meeting.time_s, true),
                Err(_) if stride > 0 => return,
                Err(_) => between.is_ended = true,
            }
        }
    }

    /// Beginning of the interval.
    pub fn begin_m(&self) -> f64 {
        self.between.as_ref().map_or_else(|| self.within[0].begin_m(), |between| between.begin_m)
    }

    /// Present end of the interval.
    pub fn end_m(&self) -> f64 {
        self.between.as_ref().map_or_else(
            || self.within[0].end_m(),
            |between| self.formation.course_m(between.end_s).max(between.begin_m),
        )
    }

    /// Whether the interval contains a place of the course.
    pub fn contains(&self, course_m: f64) -> bool {
        (self.begin_m()..=self.end_m()).contains(&course_m)
    }

    /// Whether the interval cannot grow further.
    pub fn is_whole(&self) -> bool {
        match &self.between {
            None => self.within[0].is_whole(),
            Some(between) => between.is_ended || self.end_m() >= self.formation.end_m(),
        }
    }
}
