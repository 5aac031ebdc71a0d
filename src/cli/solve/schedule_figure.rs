//! The figures of `solve schedule`: the time–distance chart of all dragons, or the coordination diagram of two.

use bench_dragon_geometry::formation::Planned;
use bench_dragon_geometry::planner::{Conflict, Passing, Schedule};
use glam::DVec2;

use super::figure::FigureArgs;
use crate::config::FormationDocument;
use crate::output::figure::{Caption, CoordinationDiagram, DragonLine, Drawing, PassingMark, TimeDistanceChart};

/// Points of a line over plan time.
const SAMPLES: u32 = 1000;

/// A plan to draw.
pub(super) struct DrawnPlan<'a> {
    pub(super) figure: &'a FigureArgs,
    /// The dragons, which leave as planned.
    pub(super) document: &'a FormationDocument,
    pub(super) schedule: &'a Schedule,
    pub(super) passings: &'a [Passing],
    pub(super) clearance_m: f64,
}

impl DrawnPlan<'_> {
    /// The chart of all dragons.
    pub(super) fn chart(&self) -> Drawing {
        let lines = self.document.dragons().iter().zip(self.planned()).map(|(named, planned)| DragonLine {
            name: named.name.clone(),
            colour: named.colour,
            points: walked(planned, [planned.timetable.start_s(), planned.timetable.end_s()]),
        });
        let apart = if self.clearance_m > 0.0 { format!(", {} m apart", self.clearance_m) } else { String::new() };
        let all: Vec<usize> = (0..self.planned().len()).collect();
        TimeDistanceChart {
            caption: self.caption(format!("When dragons pass each other{apart}"), &all),
            dragons: lines.collect(),
            passings: self.passings.iter().map(|passing| self.mark(passing)).collect(),
        }
        .draw()
    }

    /// The diagram of two dragons.
    pub(super) fn diagram(&self, dragons: [usize; 2]) -> Drawing {
        let conflict = self.conflict(dragons);
        let planned = dragons.map(|dragon| &self.planned()[dragon]);
        let [from_s, to_s] = planned.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[from_s, to_s], planned| {
            [from_s.min(planned.timetable.start_s()), to_s.max(planned.timetable.end_s())]
        });
        // The conflict has the dragon of the lower index first.
        let axes = if conflict.dragons == dragons { [0, 1] } else { [1, 0] };
        let cells = conflict.zones.iter().flat_map(|zone| conflict.pair.area_m(zone));
        let at = |time_s: f64| DVec2::from(planned.map(|planned| planned.travel_m(time_s)));
        let names = dragons.map(|dragon| self.document.dragons()[dragon].name.clone());
        let of_both = |passing: &&Passing| passing.dragons == conflict.dragons;
        CoordinationDiagram {
            caption: self.caption(format!("Where {} and {} would meet, and the plan", names[0], names[1]), &dragons),
            forbidden: cells.map(|cell| [0, 1].map(|end| DVec2::from(axes.map(|axis| cell[axis][end])))).collect(),
            line: times(from_s, to_s).map(at).collect(),
            nearest: self.passings.iter().filter(of_both).map(|passing| at(passing.nearest_s)).collect(),
            names,
        }
        .draw()
    }

    fn planned(&self) -> &[Planned] {
        self.document.formation().dragons()
    }

    fn conflict(&self, [one, other]: [usize; 2]) -> &Conflict {
        let of_both = |conflict: &&Conflict| conflict.dragons == [one.min(other), one.max(other)];
        self.schedule.conflicts().iter().find(of_both).expect("every two dragons")
    }

    fn caption(&self, title: String, dragons: &[usize]) -> Caption {
        let facts = dragons.iter().map(|&dragon| {
            let name = &self.document.dragons()[dragon].name;
            format!("{name} leaves at {:.3} s", self.planned()[dragon].timetable.start_s())
        });
        Caption { heading: self.figure.title.clone(), title, facts: facts.collect() }
    }

    /// Whether one of the dragons has no crossing with a smaller slack.
    fn is_tightest(&self, passing: &Passing) -> bool {
        passing.dragons.iter().any(|dragon| {
            let own = self.passings.iter().filter(|other| other.dragons.contains(dragon));
            own.map(|other| other.slack_s).fold(f64::INFINITY, f64::min) == passing.slack_s
        })
    }

    fn mark(&self, passing: &Passing) -> PassingMark {
        let planned = passing.dragons.map(|dragon| &self.planned()[dragon]);
        let parts = [0, 1].map(|i| walked(planned[i], passing.spans_s[i]));
        let point = |i: usize, time_s: f64| DVec2::new(time_s, walked_m(planned[i], time_s));
        let wait = passing.first.zip(passing.passes_s).zip(passing.arrives_s).map(|((first, passes_s), arrives_s)| {
            let first = usize::from(first == passing.dragons[1]);
            [point(first, passes_s), point(1 - first, arrives_s)]
        });
        PassingMark { dragons: passing.dragons, parts, wait, is_tightest: self.is_tightest(passing) }
    }
}

/// Even plan times between two.
fn times(from_s: f64, to_s: f64) -> impl Iterator<Item = f64> {
    (0..=SAMPLES).map(move |sample| from_s + (to_s - from_s) * f64::from(sample) / f64::from(SAMPLES))
}

fn walked_m(planned: &Planned, time_s: f64) -> f64 {
    planned.travel_m(time_s) - planned.dragon.start_travel_m()
}

/// A dragon's line between two plan times.
fn walked(planned: &Planned, [from_s, to_s]: [f64; 2]) -> Vec<DVec2> {
    times(from_s, to_s).map(|time_s| DVec2::new(time_s, walked_m(planned, time_s))).collect()
}
