//! Fixes: small changes of a plan that take a problem away. Each is tried before it is offered.

use bench_dragon_geometry::clearance::DragonPair;
use bench_dragon_geometry::dragon::{ChainSolver, Question};
use bench_dragon_geometry::formation::DelaySet;
use bench_dragon_geometry::planner::smallest_pitch;
use bench_dragon_geometry::route::{PathSegment, RouteShape, SpiralSpec};
use serde_json::{Value, json};

use super::change::{Change, Key, Keys, Owner, Put};
use super::handle::documents;
use super::plan::{Plan, Touch};
use super::plan_folder::PlanFolder;
use super::toml_text;

/// Most work for a fix, in steps of the meter: about a second.
const WORK: u64 = 20_000_000;
/// Most radii that are tried for a bend that is too tight, and by which factor each is larger than the one before.
const RADII: i32 = 30;
const WIDER: f64 = 1.06;

/// All fixes of a plan, for the page.
pub(super) fn fixes(plan: &Plan, folder: &PlanFolder, touch: Touch, question: &Question) -> Vec<Value> {
    let trial = Trial { plan, folder, question };
    let mut found = Vec::new();
    if let Touch::Found { time_s, benches, .. } = touch {
        let of_contact = match plan.config.named() {
            Some(_) => trial.later_start(benches).into_iter().collect(),
            None => [trial.wider_pitch(), trial.earlier_end(time_s)].into_iter().flatten().collect::<Vec<_>>(),
        };
        found.extend(of_contact.into_iter().map(|fix| fix.of("contact", 0)));
    }
    let stopped = (0..plan.planned().len()).filter(|&dragon| plan.planned()[dragon].dragon.tight_spot().is_some());
    found.extend(stopped.filter_map(|dragon| Some(trial.wider_bend(dragon)?.of("stop", dragon))));
    found
}

struct Fix {
    words: String,
    put: Put,
}

impl Fix {
    fn of(self, problem: &str, dragon: usize) -> Value {
        json!({ "of": problem, "dragon": dragon, "words": self.words, "puts": [self.put] })
    }
}

struct Trial<'a> {
    plan: &'a Plan,
    folder: &'a PlanFolder,
    question: &'a Question,
}

impl Trial<'_> {
    /// The plan with a change.
    fn with(&self, put: &Put) -> Option<Plan> {
        let text = toml_text::changed(&self.plan.text, &[Change::from(put.clone())]).ok()?;
        let config = self.folder.config(&text).ok()?;
        Some(Plan { text, config })
    }

    /// The fix of a contact, if nothing touches with it.
    fn without_contact(&self, words: String, put: Put) -> Option<Fix> {
        let fixed = self.with(&put)?;
        let end_s = fixed.times_s()[1];
        let is_free =
            matches!(fixed.touch(fixed.times_s(), &self.question.meter(WORK)), Touch::Free { to_s } if to_s >= end_s);
        is_free.then_some(Fix { words, put })
    }

    /// The smallest pitch with which the head gets as far in.
    fn wider_pitch(&self) -> Option<Fix> {
        let (config, planned) = (&self.plan.config, &self.plan.planned()[0]);
        let SpiralSpec { pitch_m, start_turns } = config.route().spiral()?;
        let circle_m = if let RouteShape::Turnaround(turn) = config.route().shape {
            turn.turn_diameter_m
        } else {
            let mut solver = ChainSolver::new(&planned.dragon);
            let end = solver.solve(&planned.dragon, planned.dragon.end_travel_m()).ok()?[0].position;
            2.0 * end.distance(config.route().placement.position)
        };
        let dimensions = config.lead().dimensions().without_play();
        let smallest = smallest_pitch(&dimensions, start_turns, circle_m, 0.0, &self.question.meter(WORK)).ok()?;
        let wider_m = up(smallest.pitch_m, 1e4);
        let put = Put::new(Owner(None).route("pitch_m"), wider_m);
        if wider_m > pitch_m { self.without_contact(format!("pitch {wider_m:.4} m"), put) } else { None }
    }

    /// An end before the contact.
    fn earlier_end(&self, contact_s: f64) -> Option<Fix> {
        let end_s = ((contact_s - 0.05) * 10.0).floor() / 10.0;
        let put = Put::new(Owner(None).route("end_s"), end_s);
        if end_s <= self.plan.times_s()[0] {
            return None;
        }
        self.without_contact(format!("end at {end_s:.1} s"), put)
    }

    /// A later start of one of two dragons that touch, whichever waits less. Their boards then stay apart by more than a near miss.
    fn later_start(&self, benches: [usize; 2]) -> Option<Fix> {
        let config = &self.plan.config;
        let named = config.named().filter(|named| named.cues().is_empty())?;
        let formation = config.formation().metered(&self.question.meter(WORK));
        let places = benches.map(|bench| formation.layout().place(bench).0);
        let [one, other] = [places[0].min(places[1]), places[0].max(places[1])];
        if one == other {
            return None;
        }
        let planned = [one, other].map(|dragon| &formation.dragons()[dragon]);
        let mut delays = DelaySet::default();
        for zone in DragonPair::new(planned, config.tables().monitor.near_m).zones()? {
            delays.extend(&zone.delays);
        }
        let starts_s = planned.map(|planned| planned.timetable.start_s());
        let later = |delays: &DelaySet, dragon: usize, [before_s, start_s]: [f64; 2]| {
            let later_s = up(before_s + delays.next_outside(start_s - before_s), 10.0);
            let is_free = later_s.is_finite() && delays.next_outside(later_s - before_s) <= later_s - before_s;
            is_free.then_some((later_s - start_s, later_s, dragon))
        };
        let both = [later(&delays, other, starts_s), later(&delays.reversed(), one, [starts_s[1], starts_s[0]])];
        let (wait_s, start_s, dragon) = both.into_iter().flatten().min_by(|one, other| one.0.total_cmp(&other.0))?;
        let words = format!("start {} {wait_s:.1} s later", named.dragons()[dragon].name);
        let put = Put::new(head(dragon, "start_s"), start_s);
        // The plan is valid, too, with this start.
        self.with(&put).map(|_| Fix { words, put })
    }

    /// A larger radius of the tightest arc, with which the dragon walks to the end.
    fn wider_bend(&self, dragon: usize) -> Option<Fix> {
        let (owner, document) = documents(&self.plan.config).into_iter().nth(dragon)?;
        let path = document.route().as_path().filter(|_| document.drawing().is_none())?;
        let arcs = path.segments.iter().enumerate().filter_map(|(number, segment)| match segment {
            PathSegment::Arc { radius_m, .. } => Some((number, *radius_m)),
            _ => None,
        });
        let (number, radius_m) = arcs.min_by(|one, other| one.1.total_cmp(&other.1))?;
        let wider = (1..=RADII).map(|step| up(radius_m * WIDER.powi(step), 100.0));
        wider.into_iter().find_map(|radius_m| {
            let put = Put::new(owner.segment(number, "radius_m"), radius_m);
            let is_walked = self.with(&put)?.planned()[dragon].dragon.tight_spot().is_none();
            is_walked.then(|| Fix { words: format!("radius {radius_m:.2} m"), put })
        })
    }
}

/// The next number up of so many in a unit.
fn up(value: f64, in_unit: f64) -> f64 {
    (value * in_unit - 1e-9).ceil() / in_unit
}

/// The place of a key of `[dragons.head]`.
fn head(dragon: usize, key: &str) -> Keys {
    let name = |text: &str| Key::Name(text.to_owned());
    vec![name("dragons"), Key::Index(dragon), name("head"), name(key)]
}
