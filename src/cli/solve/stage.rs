//! The part of an answer about the outline of the stage.

use bench_dragon_geometry::clearance::{StageExit, first_exit, standing_outside};
use bench_dragon_geometry::number::{Fixed, Place};
use serde::Serialize;

use super::WorkArgs;
use crate::config::Config;
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
    /// The answer for a configuration; `None` if its stage has no outline.
    pub(super) fn of(config: &Config, work: WorkArgs) -> Option<Self> {
        let outline = config.outline()?;
        let answer = Self { outside_at_start: Some(standing_outside(config.lead(), outline)), ..Self::default() };
        Some(match first_exit(&config.lead().metered(&work.meter()), outline) {
            Ok(exit) => Self { leaves_stage: exit.map(|exit| Leaving::of(&exit, config)), ..answer },
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
            (None, Some(reason)) => format!("unknown whether a board leaves it: {reason}; --work allows more"),
            (None, None) => "no board leaves it".to_owned(),
        }
    }
}

impl Leaving {
    fn of(&StageExit { travel_m, bench, point }: &StageExit, config: &Config) -> Self {
        Self { time_s: config.timetable().time_s(travel_m), bench, point_m: point.to_array() }
    }
}
