//! The part of an answer about the outline of the stage.

use bench_dragon_geometry::clearance::{Breach, first_breach, standing_at};
use bench_dragon_geometry::formation::{Formation, Planned};
use bench_dragon_geometry::number::{Fixed, Place};
use bench_dragon_geometry::stage::{BorderKind, Stage};
use serde::Serialize;

use super::WorkArgs;
use super::interrupt;
use crate::output::Counted;

/// Whether the dragon stays on the stage during its run.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct StageAnswer {
    /// The first board that leaves the stage after it was inside; null if none does, or if the answer is unknown.
    leaves_stage: Option<Leaving>,
    /// Number of boards that stand outside the stage at the start; null if the dragon cannot stand there.
    outside_at_start: Option<usize>,
    /// The reason for which the answer is unknown: it took too much work.
    stage_undecided: Option<String>,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct Leaving {
    time_s: f64,
    bench: usize,
    point_m: [f64; 2],
}

impl StageAnswer {
    /// The answer for a dragon; `None` if the stage has no outline.
    pub(super) fn of(stage: &Stage, planned: &Planned, work: WorkArgs) -> Option<Self> {
        let within = Stage::new(vec![stage.outline()?.clone()], 0.0);
        let alone = Formation::of_one(planned.clone());
        let standing = standing_at(&alone, &within, BorderKind::Outline, 0.0, alone.begin_m());
        let answer = Self { outside_at_start: Some(standing.len()), ..Self::default() };
        Some(match first_breach(&planned.dragon.metered(&work.meter()), &within, 0.0) {
            Ok(exit) => Self { leaves_stage: exit.map(|exit| Leaving::of(&exit, planned)), ..answer },
            Err(spent) => Self { stage_undecided: Some(spent.to_string()), ..answer },
        })
    }

    /// The point at which the first board leaves the stage.
    pub(super) fn point_m(&self) -> Option<[f64; 2]> {
        self.leaves_stage.map(|leaving| leaving.point_m)
    }

    pub(super) fn text(&self) -> String {
        let standing = match self.outside_at_start {
            None | Some(0) => String::new(),
            Some(count) => format!("; {} stand outside at the start", Counted(count as u64, "board")),
        };
        self.leaving_text() + &standing
    }

    fn leaving_text(&self) -> String {
        match (&self.leaves_stage, &self.stage_undecided) {
            (Some(Leaving { time_s, bench, point_m }), _) => {
                format!(
                    "bench {bench} is the first that leaves it, at {} s, at {}",
                    Fixed::<6>(*time_s),
                    Place::<6>(*point_m)
                )
            }
            (None, Some(reason)) => {
                format!("unknown whether a board leaves it: {reason}{}", interrupt::allows_more())
            }
            (None, None) => "no board leaves it".to_owned(),
        }
    }
}

impl Leaving {
    fn of(&Breach { travel_m, bench, point, .. }: &Breach, planned: &Planned) -> Self {
        Self { time_s: planned.timetable.time_s(travel_m), bench, point_m: point.to_array() }
    }
}
