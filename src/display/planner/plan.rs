//! A valid text and all that is known of it at once: the drawing, the handles, the first contact, the facts of each route.

use bench_dragon_geometry::clearance::{first_meeting, first_within};
use bench_dragon_geometry::dragon::{ChainSolver, Meter};
use bench_dragon_geometry::formation::Planned;
use glam::DVec2;
use serde_json::{Value, json};

use super::handle::{documents, handles};
use crate::config::{Config, ConfigDocument};
use crate::display::observe::DescribedRun;
use crate::display::view::run_message;

/// Most work for the first contact while a hand drags, in steps of the meter: some 20 ms.
const QUICK_WORK: u64 = 400_000;

/// A text with its configuration.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) text: String,
    pub(super) config: Config,
}

/// The first contact, as far as it is known.
#[derive(Clone, Copy, Debug)]
pub(super) enum Touch {
    Found {
        time_s: f64,
        benches: [usize; 2],
        point_m: [f64; 2],
    },
    /// There is none up to here. The search goes on if this is before the end.
    Free {
        to_s: f64,
    },
}

impl Plan {
    /// The drawing and all answers that are known at once.
    pub(super) fn message(&self, number: u64, touch: Touch, at_s: Option<f64>) -> Value {
        json!({
            "type": "plan",
            "number": number,
            "text": self.text,
            "run": self.run(number),
            "handles": handles(&self.text, &self.config),
            "routes": self.facts(),
            "times_s": self.times_s(),
            "contact": self.contact(touch),
            "pose": self.pose(at_s.unwrap_or(self.first_shown_s(touch))),
        })
    }

    /// Routes, dragons and stage, as the page of a show gets them.
    pub(super) fn run(&self, number: u64) -> Value {
        run_message(&DescribedRun::new(number, self.config.clone()))
    }

    /// Plan times at which the plan begins and ends.
    pub(super) fn times_s(&self) -> [f64; 2] {
        match self.config.named() {
            Some(named) => [named.start_s(), named.formation().end_s()],
            None => [self.config.start_s(), self.config.end_s()],
        }
    }

    /// The plan time that a reader wants to see first.
    fn first_shown_s(&self, touch: Touch) -> f64 {
        match touch {
            Touch::Found { time_s, .. } => time_s,
            Touch::Free { .. } => self.times_s()[1],
        }
    }

    /// The first contact, as `solve contact` finds it, within the work that a drag allows. What is known of an earlier plan holds as far as
    /// the dragon is at the same places.
    pub(super) fn quick_touch(&self, earlier: Option<(&Self, Touch)>) -> Touch {
        let [start_s, end_s] = self.times_s();
        let known = earlier.map_or(Touch::Free { to_s: start_s }, |(plan, touch)| self.known(plan, touch));
        match known {
            Touch::Found { .. } => known,
            Touch::Free { to_s } => self.touch([to_s.clamp(start_s, end_s), end_s], &Meter::of(QUICK_WORK)),
        }
    }

    /// The bound that another plan's first contact gives for that of this one. Places depend on travel alone, so both
    /// must begin at the same.
    fn known(&self, other: &Self, touch: Touch) -> Touch {
        let start_s = self.times_s()[0];
        let [ours, theirs] = [self, other].map(|plan| {
            let dragon = plan.config.lead();
            (plan.config.named().is_none(), dragon.dimensions(), dragon.start_travel_m())
        });
        if !ours.0 || ours != theirs {
            return Touch::Free { to_s: start_s };
        }
        let ends_m = [self, other].map(|plan| plan.config.lead().end_travel_m());
        let same_to_m = self.config.route().same_to_m(other.config.route()).min(ends_m[0]).min(ends_m[1]);
        let travel_m = |time_s: f64| other.planned()[0].travel_m(time_s);
        let time_s = |travel_m: f64| self.config.timetable().time_s(travel_m);
        match touch {
            Touch::Found { time_s: contact_s, benches, point_m } if travel_m(contact_s) < same_to_m => {
                Touch::Found { time_s: time_s(travel_m(contact_s)), benches, point_m }
            }
            Touch::Found { time_s: free_s, .. } | Touch::Free { to_s: free_s } => {
                let free_m = travel_m(free_s).min(same_to_m);
                let is_known = free_m > self.config.lead().start_travel_m();
                Touch::Free { to_s: if is_known { time_s(free_m) } else { start_s } }
            }
        }
    }

    /// The first contact between two plan times, within some work.
    pub(super) fn touch(&self, [from_s, to_s]: [f64; 2], meter: &Meter) -> Touch {
        let Some(named) = self.config.named() else {
            let (dragon, timetable) = (self.config.lead().metered(meter), self.config.timetable());
            let [start_s, end_s] = self.times_s();
            let travel_m = |time_s: f64| self.planned()[0].travel_m(time_s);
            let from_m = if from_s <= start_s { dragon.start_travel_m() } else { travel_m(from_s) };
            let to_m = if to_s >= end_s { dragon.end_travel_m() } else { travel_m(to_s) };
            return match first_within(&dragon, 0.0, from_m, to_m.max(from_m)) {
                Ok(Some(contact)) => Touch::Found {
                    time_s: timetable.time_s(contact.travel_m),
                    benches: contact.benches,
                    point_m: contact.point.to_array(),
                },
                Ok(None) => Touch::Free { to_s },
                Err(spent) => Touch::Free { to_s: timetable.time_s(spent.reached_m) },
            };
        };
        match first_meeting(&named.formation().metered(meter), 0.0, from_s, to_s) {
            Ok(Some(meeting)) => {
                Touch::Found { time_s: meeting.time_s, benches: meeting.benches, point_m: meeting.point.to_array() }
            }
            Ok(None) => Touch::Free { to_s },
            Err(unfinished) => Touch::Free { to_s: unfinished.reached_s },
        }
    }

    /// The dragons with their timetables.
    pub(super) fn planned(&self) -> &[Planned] {
        self.config.formation().dragons()
    }

    /// Two benches, by their numbers and in words.
    pub(super) fn benches(&self, benches: [usize; 2]) -> Value {
        let names = benches.map(|bench| self.bench_name(bench));
        json!({ "benches": benches, "words": format!("{} and {}", names[0], names[1]) })
    }

    /// A bench in words.
    pub(super) fn bench_name(&self, bench: usize) -> String {
        match self.config.named() {
            Some(named) => {
                let (name, index) = named.named_bench(bench);
                format!("{name} {index}")
            }
            None => format!("bench {bench}"),
        }
    }

    /// The contact for the page, with the outlines of the two boards at its instant.
    pub(super) fn contact(&self, touch: Touch) -> Value {
        match touch {
            Touch::Free { to_s } if to_s >= self.times_s()[1] => json!({ "state": "none" }),
            Touch::Free { to_s } => json!({ "state": "searching", "to_s": to_s }),
            Touch::Found { time_s, benches, point_m } => json!({
                "state": "found",
                "time_s": time_s,
                "pair": self.benches(benches),
                "point_m": point_m,
                "boards": self.boards(time_s, benches),
            }),
        }
    }

    /// The corners of boards at a plan time.
    fn boards(&self, time_s: f64, benches: [usize; 2]) -> Vec<Vec<f64>> {
        let layout = self.config.formation().layout();
        let corners = |bench: usize| {
            let (dragon, index) = layout.place(bench);
            let planned = &self.planned()[dragon];
            let mut solver = ChainSolver::new(&planned.dragon);
            let chain = solver.solve(&planned.dragon, planned.travel_m(time_s)).expect("the travel is in the run");
            let board = planned.dragon.board(index, &chain[index], &chain[index + 1]);
            board.corners().iter().flat_map(DVec2::to_array).collect()
        };
        benches.map(corners).into()
    }

    /// The handles of all dragons at a plan time: x and y of each, dragon after dragon.
    pub(super) fn pose(&self, time_s: f64) -> Value {
        let [start_s, end_s] = self.times_s();
        let time_s = if time_s.is_finite() { time_s.clamp(start_s, end_s.max(start_s)) } else { start_s };
        let mut handles = Vec::with_capacity(2 * self.config.formation().layout().handles());
        for planned in self.planned() {
            let mut solver = ChainSolver::new(&planned.dragon);
            let chain = solver.solve(&planned.dragon, planned.travel_m(time_s)).expect("the travel is in the run");
            handles.extend(
                chain.iter().flat_map(|handle| handle.position.to_array()).map(|value_m| (value_m * 1e4).round() / 1e4),
            );
        }
        json!({ "time_s": time_s, "handles": handles })
    }

    /// Length and tightest bend of each route, and why its dragon stops.
    fn facts(&self) -> Vec<Value> {
        let documents = documents(&self.config).into_iter().map(|(_, document)| document);
        let names = self.config.named().map(|named| named.dragons().iter().map(|dragon| &*dragon.name));
        let mut names = names.into_iter().flatten();
        documents.zip(self.planned()).map(|(document, planned)| facts(names.next(), document, planned)).collect()
    }
}

/// The facts of a dragon's route; its name, if there are several.
fn facts(name: Option<&str>, document: &ConfigDocument, planned: &Planned) -> Value {
    let (dragon, route) = (&planned.dragon, planned.dragon.route());
    let (start_m, end_m) = (route.start_travel_m(), route.end_travel_m());
    let tightest = route.tightest_bend(start_m, end_m);
    let stops = dragon.tight_spot().map(|spot| {
        json!({
            "because": format!("{}: {spot}", dragon.feasible_end()),
            "time_s": planned.timetable.end_s(),
            "point_m": spot.point.to_array(),
        })
    });
    json!({
        "name": name,
        "kind": document.route_kind(),
        "closed": document.route().as_path().is_some_and(|path| path.laps.is_some()),
        "length_m": end_m - start_m,
        "tightest_radius_m": tightest.map(|tightest| tightest.radius_m),
        "stops": stops,
    })
}
