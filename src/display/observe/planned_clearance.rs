//! The clearance over a whole run, computed by the planner before the head walks it.
//!
//! All values are functions of the head's travel, because the state of a dragon is a function of its travel alone; of a formation, of
//! its place on the course. A
//! [`TravelClock`](super::TravelClock) converts travel to show time.

use std::sync::{Arc, Mutex, MutexGuard};
use std::{io, thread};

use bench_dragon_geometry::clearance::{ClearanceSearch, Contact, ContactSearch, CourseSearch, PairClearance};
use bench_dragon_geometry::dragon::{Dragon, Question};
use bench_dragon_geometry::formation::Formation;
use bench_dragon_geometry::planner::{ClosestApproach, clearance_profile, near_misses, on_one_core};
use rustix::process::setpriority_process;

/// Points of the curve, at even steps of travel.
const POINTS: usize = 600;
/// Points in one step.
const POINTS_PER_STEP: usize = 60;
/// Parts of the run in the search for the contact, and in the search for near misses.
const STEPS: usize = 32;
/// Greatest number of near misses that are kept: the nearest ones.
const MAX_NEAR_MISSES: usize = 200;
/// Greatest work of one step, in steps of the meter: one or two seconds.
const WORK_PER_STEP: u64 = 50_000_000;
/// Overlap of the searches for near misses, in link lengths, so that no near miss is lost at a seam.
const OVERLAP_LINKS: f64 = 1.0;

/// The planned clearance of a run so far: at most 600 points, 200 near misses and one contact.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlannedClearance {
    /// The nearest pair at even steps of travel, in order of travel.
    points: Vec<ClosestApproach>,
    /// The local minima under the configuration's `near_m` before the contact, in order of travel.
    pub near_misses: Vec<ClosestApproach>,
    /// Number of dropped near misses. None of them is nearer than the kept ones.
    pub near_misses_dropped: usize,
    /// The first contact of the run.
    pub contact: Option<Contact>,
    /// Whether the search is complete.
    pub is_complete: bool,
}

impl PlannedClearance {
    /// The least clearance of all pairs, in order of travel. Near misses and the contact are points of the curve, so it passes
    /// through them.
    pub fn curve(&self) -> Vec<ClosestApproach> {
        let contact = self.contact.map(|Contact { travel_m, benches, point }| ClosestApproach {
            travel_m,
            pair: PairClearance { benches, clearance_m: 0.0, point },
        });
        let mut curve: Vec<_> = self.points.iter().chain(&self.near_misses).copied().chain(contact).collect();
        curve.sort_by(|one, other| one.travel_m.total_cmp(&other.travel_m));
        curve
    }

    fn keep_nearest(&mut self) {
        let misses = &mut self.near_misses;
        let Some(dropped) = misses.len().checked_sub(MAX_NEAR_MISSES) else { return };
        misses.sort_by(|one, other| one.pair.clearance_m.total_cmp(&other.pair.clearance_m));
        misses.truncate(MAX_NEAR_MISSES);
        misses.sort_by(|one, other| one.travel_m.total_cmp(&other.travel_m));
        self.near_misses_dropped += dropped;
    }
}

/// Computes the plan of the dragon's run, with the near misses under `near_m`. It passes the plan to `show` after each step,
/// and stops if `show` returns false.
///
/// Each step has bounded work. A search that exceeds this bound stops there; the rest of the run stays unknown.
fn work_out(dragon: &Dragon, near_m: f64, question: &Question, mut show: impl FnMut(&PlannedClearance) -> bool) {
    let dragon = dragon.metered(&question.meter(WORK_PER_STEP));
    let mut plan = PlannedClearance::default();
    // With fewer than three benches, all pairs are neighbours.
    if dragon.dimensions().benches() < 3 {
        plan.is_complete = true;
        show(&plan);
        return;
    }
    let mut free_to_m = dragon.end_travel_m();
    for from in (0..POINTS).step_by(POINTS_PER_STEP) {
        let points = from..(from + POINTS_PER_STEP).min(POINTS);
        let travels_m: Vec<f64> = points.map(|point| share_m(&dragon, point, POINTS - 1, free_to_m)).collect();
        dragon.meter().restart();
        let found = clearance_profile(&dragon, &travels_m, || ());
        plan.points.extend(found.approaches);
        if !show(&plan) {
            return;
        }
        if found.ends_early_m.is_some() {
            break;
        }
    }
    let mut contacts = ContactSearch::new(&dragon);
    for part in 0..STEPS {
        let [from_m, to_m] = [part, part + 1].map(|part| share_m(&dragon, part, STEPS, dragon.end_travel_m()));
        dragon.meter().restart();
        let found = contacts.first(from_m, to_m);
        let is_over = !matches!(found, Ok(None));
        match found {
            Ok(None) => {}
            Ok(Some(contact)) => (plan.contact, free_to_m) = (Some(contact), contact.travel_m),
            Err(spent) => free_to_m = spent.reached_m.clamp(from_m, to_m),
        }
        if !show(&plan) {
            return;
        }
        if is_over {
            break;
        }
    }
    let overlap_m = OVERLAP_LINKS * dragon.dimensions().link_m(1);
    for part in 0..STEPS {
        let [from_m, to_m] = [part, part + 1].map(|part| share_m(&dragon, part, STEPS, free_to_m));
        let first_m = (from_m - overlap_m).max(dragon.start_travel_m());
        dragon.meter().restart();
        let found = near_misses(&dragon, first_m, (to_m + overlap_m).min(free_to_m), near_m, |_| ());
        plan.near_misses.extend(found.approaches.into_iter().filter(|miss| (from_m..to_m).contains(&miss.travel_m)));
        plan.keep_nearest();
        plan.is_complete = part + 1 == STEPS || found.ends_early_m.is_some();
        if !show(&plan) || plan.is_complete {
            return;
        }
    }
}

/// The same of a formation, whose `travel_m` is a place of its course: the nearest pairs of all its benches, and the first contact.
/// Its near misses are not searched.
fn work_out_course(formation: &Formation, question: &Question, mut show: impl FnMut(&PlannedClearance) -> bool) {
    let formation = formation.metered(&question.meter(WORK_PER_STEP));
    let [begin_m, end_m] = [formation.begin_m(), formation.end_m()];
    let mut plan = PlannedClearance::default();
    let mut nearest = ClearanceSearch::of(formation.layout());
    for point in 0..POINTS {
        let course_m = part_m([begin_m, end_m], point, POINTS - 1);
        let pair = nearest.nearest(&formation.boards_at(course_m));
        plan.points.extend(pair.map(|pair| ClosestApproach { travel_m: course_m, pair }));
        if (point + 1) % POINTS_PER_STEP == 0 && !show(&plan) {
            return;
        }
    }
    let mut contacts = CourseSearch::within(&formation, 0.0);
    for part in 0..STEPS {
        formation.lead().meter().restart();
        let [from_m, to_m] = [part, part + 1].map(|part| part_m([begin_m, end_m], part, STEPS));
        let found = contacts.first(from_m, to_m);
        plan.is_complete = part + 1 == STEPS || !matches!(found, Ok(None));
        plan.contact = found.ok().flatten();
        if !show(&plan) || plan.is_complete {
            return;
        }
    }
}

/// Returns the travel at `part` of `of` equal parts from the start to `to_m`.
fn share_m(dragon: &Dragon, part: usize, of: usize, to_m: f64) -> f64 {
    part_m([dragon.start_travel_m(), to_m], part, of)
}

fn part_m([from_m, to_m]: [f64; 2], part: usize, of: usize) -> f64 {
    if part >= of { to_m } else { from_m + (to_m - from_m) * (part as f64 / of as f64) }
}

/// The thread's niceness: frames and snapshots have priority.
const NICENESS: i32 = 10;

/// A plan that a thread computes. When it is dropped, it cancels the question of the thread, which is not joined.
#[derive(Debug)]
pub(super) struct ClearancePlanner {
    latest: Arc<Mutex<Arc<PlannedClearance>>>,
    question: Question,
}

impl ClearancePlanner {
    /// Starts a thread that plans the run of a formation; of one dragon without cues with the near misses under `near_m`.
    ///
    /// # Errors
    /// The operating system's reason if the thread cannot start.
    pub(super) fn start(formation: &Arc<Formation>, near_m: f64) -> io::Result<Self> {
        let latest = Arc::default();
        let shown = Arc::downgrade(&latest);
        let formation = Arc::clone(formation);
        let question = Question::default();
        let answered = question.clone();
        let show = move |plan: &PlannedClearance| {
            let owner = shown.upgrade();
            owner.map(|latest| *locked(&latest) = Arc::new(plan.clone())).is_some()
        };
        let work = move || {
            // On Linux this changes only the calling thread. If the kernel refuses, the thread works at normal priority.
            let _ = setpriority_process(None, NICENESS);
            on_one_core(|| {
                if formation.has_plan_course() {
                    work_out_course(&formation, &answered, show);
                } else {
                    work_out(formation.lead(), near_m, &answered, show);
                }
            });
        };
        thread::Builder::new().name("plan".to_owned()).spawn(work)?;
        Ok(Self { latest, question })
    }

    /// The plan so far.
    pub(super) fn latest(&self) -> Arc<PlannedClearance> {
        Arc::clone(&locked(&self.latest))
    }
}

impl Drop for ClearancePlanner {
    fn drop(&mut self) {
        self.question.cancel();
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().expect("no thread panics while it holds the lock")
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::config::Config;

    /// The plan after each step.
    fn planned(toml: &str, near_m: f64) -> Vec<PlannedClearance> {
        let mut plans = Vec::new();
        work_out(Config::from_toml(toml).expect("a valid text").lead(), near_m, &Question::default(), |plan| {
            plans.push(plan.clone());
            true
        });
        plans
    }

    /// The configuration's default.
    const NEAR_M: f64 = 0.02;

    #[test]
    fn the_papers_plan_has_its_contact_its_near_misses_and_its_clearances() {
        let plans = planned("", NEAR_M);
        let plan = plans.last().expect("a plan");
        let contact = plan.contact.expect("a contact");
        assert!((contact.travel_m - 412.473_838).abs() < 1e-6 && contact.benches == [0, 8], "{contact:?}");
        let misses: Vec<_> = plan.near_misses.iter().map(|miss| (miss.pair.benches, miss.travel_m)).collect();
        assert_eq!(misses.len(), 3, "{misses:?}");
        for ((benches, travel_m), (known, known_m)) in
            misses.into_iter().zip([([0, 12], 402.115_621), ([0, 9], 406.846_569), ([0, 11], 409.831_991)])
        {
            assert!(benches == known && (travel_m - known_m).abs() < 1e-6, "{benches:?} at {travel_m}");
        }
        let curve = plan.curve();
        assert_eq!(curve.len(), POINTS + 3 + 1);
        assert!(curve.is_sorted_by_key(|point| point.travel_m));
        assert_eq!((curve[0].travel_m, curve[0].pair.benches), (0.0, plan.points[0].pair.benches));
        assert!((curve[0].pair.clearance_m - 0.169_279).abs() < 1e-6);
        assert!((plan.near_misses[2].pair.clearance_m - 0.000_865).abs() < 1e-6);
        assert_eq!(plans.iter().filter(|plan| plan.is_complete).count(), 1);
    }

    #[test]
    fn the_plan_of_a_formation_has_its_contact_and_its_clearances() {
        let mut plans = Vec::new();
        let text = include_str!("../../../examples/two-dragons.toml");
        let config = Config::from_toml(text).expect("a valid text");
        let formation = config.formation();
        work_out_course(formation, &Question::default(), |plan| {
            plans.push(plan.clone());
            true
        });
        let plan = plans.last().expect("a plan");
        assert!(plan.is_complete && plan.near_misses.is_empty(), "{plan:?}");
        assert_eq!(plan.contact, CourseSearch::within(formation, 0.0).first(0.0, f64::MAX).expect("enough work"));
        assert_eq!(plan.points.len(), POINTS);
        let ends = [formation.begin_m(), formation.end_m()];
        assert_eq!([plan.points[0].travel_m, plan.points[POINTS - 1].travel_m], ends);
        let point = plan.points[POINTS / 3];
        let nearest = ClearanceSearch::of(formation.layout()).nearest(&formation.boards_at(point.travel_m));
        assert_eq!(Some(point.pair), nearest);
    }

    #[test]
    fn each_step_only_adds_to_the_plan() {
        let plans = planned("", NEAR_M);
        for pair in plans.windows(2) {
            assert!(pair[1].points.starts_with(&pair[0].points));
            assert!(pair[1].near_misses.starts_with(&pair[0].near_misses));
            assert!(pair[0].contact.is_none() || pair[0].contact == pair[1].contact);
        }
    }

    #[test]
    fn a_seam_between_two_searches_neither_loses_nor_doubles_a_near_miss() {
        const FAR_M: f64 = 0.08;
        let config = Config::from_toml("").expect("the paper's");
        let dragon = config.lead();
        let plan = planned("", FAR_M).pop().expect("a plan");
        let contact_m = plan.contact.expect("a contact").travel_m;
        let at_once = near_misses(dragon, dragon.start_travel_m(), contact_m, FAR_M, |_| ()).approaches;
        let pairs = |misses: &[ClosestApproach]| misses.iter().map(|miss| miss.pair.benches).collect::<Vec<_>>();
        assert!(at_once.len() > 10, "{}", at_once.len());
        assert_eq!(pairs(&plan.near_misses), pairs(&at_once));
        for (found, known) in plan.near_misses.iter().zip(&at_once) {
            // Around its minimum a clearance is nearly constant, so rounding shifts the travel of the minimum.
            assert!((found.travel_m - known.travel_m).abs() < 1e-4, "{found:?}, {known:?}");
            assert!((found.pair.clearance_m - known.pair.clearance_m).abs() < 1e-10, "{found:?}, {known:?}");
        }
    }

    #[test]
    fn the_nearest_near_misses_are_kept_in_order_of_travel() {
        let mut plan = PlannedClearance::default();
        let miss = |at: usize| ClosestApproach {
            travel_m: at as f64,
            pair: PairClearance { benches: [0, 2], clearance_m: 1.0 / (at + 1) as f64, point: DVec2::ZERO },
        };
        plan.near_misses = (0..MAX_NEAR_MISSES + 5).map(miss).collect();
        plan.keep_nearest();
        let kept: Vec<f64> = plan.near_misses.iter().map(|miss| miss.travel_m).collect();
        assert_eq!(kept, (5..MAX_NEAR_MISSES + 5).map(|at| at as f64).collect::<Vec<_>>());
        assert_eq!(plan.near_misses_dropped, 5);
    }

    #[test]
    fn a_dragon_of_two_benches_has_an_empty_plan() {
        let plans = planned("[dragon]\nbenches = 2\n", NEAR_M);
        assert_eq!(plans.len(), 1);
        assert!(plans[0].is_complete && plans[0].curve().is_empty());
    }
}
