//! `solve turn --shortest`: the shortest S inside the turning circle.

use anyhow::{Context as _, bail};
use bench_dragon_geometry::dragon::Dimensions;
use bench_dragon_geometry::number::{Fixed, Number};
use bench_dragon_geometry::planner::{
    PlannedTurn, ShortestTurn, Staging, TurnPassage, shortest_turn, shortest_turn_with_line,
};
use bench_dragon_geometry::route::{Turnaround, TurnaroundSpec};
use serde::Serialize;

use super::interrupt;
use super::turn::TurnArgs;
use super::turn_play::earliest_on_passage;
use crate::cli::print::Progress;

#[derive(Serialize)]
pub(super) struct Shortest {
    /// Radius at which the S begins and ends.
    entry_radius_m: f64,
    radius_ratio: f64,
    /// Length of the configured S minus length of this S.
    saving_m: f64,
    /// The obstacles to a shorter S with a lower and with a higher ratio.
    limits: [Option<String>; 2],
    /// The shortest S without a line.
    arcs: Option<ShortestOfKind>,
    /// The shortest S with a line; `None` if no line gives a shorter S.
    with_line: Option<ShortestOfKind>,
    /// The reason for which the shortest S with a line is unknown: it took too much work.
    with_line_undecided: Option<String>,
}

/// The shortest S of two arcs, or of two arcs and a line.
#[derive(Serialize)]
struct ShortestOfKind {
    length_m: f64,
    line_m: f64,
    entry_radius_m: f64,
    radius_ratio: f64,
}

impl From<&ShortestTurn> for ShortestOfKind {
    fn from(ShortestTurn { turnaround, radius_ratio, .. }: &ShortestTurn) -> Self {
        Self {
            length_m: turnaround.turn_length_m(),
            line_m: turnaround.line_m(),
            entry_radius_m: 0.5 * turnaround.turn_diameter_m(),
            radius_ratio: *radius_ratio,
        }
    }
}

/// How often the shortest turn is widened for the play of the hinges, and by how much at first, in lengths of the play.
const MOST_WIDENINGS: u32 = 6;
const WIDENING_PER_PLAY: f64 = 1.0;

/// Finds the shortest S as [`find_shortest`]. With play in the hinges, the S is widened until no pose that the play allows comes
/// within the clearance: the boards without play must be further and further apart.
pub(super) fn find_shortest_for_play(
    args: &TurnArgs,
    planned: &PlannedTurn,
    dimensions: Dimensions,
    staging: Staging,
    plan: TurnaroundSpec,
) -> anyhow::Result<(TurnaroundSpec, TurnPassage, Shortest)> {
    let mut widened = staging;
    for widening in 1..=MOST_WIDENINGS {
        let found = find_shortest(args, planned, dimensions.without_play(), widened, plan)?;
        if dimensions.play_m() == 0.0 {
            return Ok(found);
        }
        let TurnaroundSpec { pitch_m, turn_diameter_m, radius_ratio, line_m } = found.0;
        let of_plan = planned.turnaround();
        let turnaround = Turnaround::with_line(pitch_m, turn_diameter_m, radius_ratio, line_m)?
            .placed(of_plan.placement())
            .between(of_plan.start_travel_m(), of_plan.end_travel_m())?;
        let end = earliest_on_passage(
            planned.with(turnaround),
            dimensions,
            staging.clearance_m,
            &args.answer.work.long_meter(),
        )?;
        if end.is_none() {
            return Ok(found);
        }
        widened.clearance_m = staging.clearance_m + WIDENING_PER_PLAY * f64::from(1 << widening) * dimensions.play_m();
    }
    bail!("no S was found on which every pose that the play of the hinges allows keeps the clearance")
}

/// Finds the shortest S inside the planned circle. Returns its plan, its passage and its part of the answer.
fn find_shortest(
    args: &TurnArgs,
    planned: &PlannedTurn,
    dimensions: Dimensions,
    staging: Staging,
    plan: TurnaroundSpec,
) -> anyhow::Result<(TurnaroundSpec, TurnPassage, Shortest)> {
    let found = Progress::new("shortest turn", 1.0);
    let arcs =
        shortest_turn(planned.clone(), dimensions, staging, &args.answer.work.long_meter(), |share| found.add(share));
    drop(found);
    let arcs = arcs.with_context(unknown)?;
    let found = Progress::new("with a line", 1.0);
    let meter = args.answer.work.long_meter();
    let lined =
        shortest_turn_with_line(planned.clone(), dimensions, staging, arcs.as_ref(), &meter, |share| found.add(share));
    drop(found);
    if let (None, Err(spent)) = (&arcs, &lined) {
        return Err(*spent).with_context(unknown);
    }
    let with_line_undecided = lined.as_ref().err().map(ToString::to_string);
    let (of_arcs, with_line) =
        (arcs.as_ref().map(Into::into), lined.as_ref().ok().and_then(Option::as_ref).map(Into::into));
    // A line counts only if it gives a shorter S.
    let Some(found) = lined.unwrap_or_default().or(arcs) else {
        let Staging { clearance_m, speed_ratio } = staging;
        bail!(
            "no S inside a circle of diameter {} m keeps {} m between boards and every handle at most {} times as fast as \
             the head",
            Number(plan.turn_diameter_m),
            Number(clearance_m),
            Number(speed_ratio)
        );
    };
    let ShortestTurn { turnaround, radius_ratio, closest, limits } = found;
    let (turn_diameter_m, line_m) = (turnaround.turn_diameter_m(), turnaround.line_m());
    let shortest = Shortest {
        entry_radius_m: 0.5 * turn_diameter_m,
        radius_ratio,
        saving_m: planned.turnaround().turn_length_m() - turnaround.turn_length_m(),
        limits: limits.map(|limit| limit.map(|obstacle| obstacle.to_string())),
        arcs: of_arcs,
        with_line,
        with_line_undecided,
    };
    let plan = TurnaroundSpec { turn_diameter_m, radius_ratio, line_m, ..plan };
    Ok((plan, TurnPassage::Clear { closest }, shortest))
}

impl Shortest {
    /// The lines of its text, each with its name.
    pub(super) fn lines(&self) -> Vec<(&'static str, String)> {
        let Self { entry_radius_m, radius_ratio, saving_m, limits, arcs, with_line, with_line_undecided } = self;
        let begins = format!("at the radius {entry_radius_m:.6} m, with the radius ratio {radius_ratio:.6}");
        let mut lines = vec![("begins", begins), ("saving", format!("{} m", Fixed::<6>(*saving_m)))];
        for (side, limit) in ["lower ratio", "higher ratio"].iter().zip(limits) {
            let limit = limit.as_deref().unwrap_or("none");
            lines.push(("limit", format!("at a smaller radius with a {side}: {limit}")));
        }
        lines.push(match (arcs, with_line, with_line_undecided) {
            (.., Some(reason)) => ("with a line", format!("unknown: {reason}{}", interrupt::allows_more())),
            (Some(ShortestOfKind { length_m, .. }), Some(lined), None) => {
                let (saved_m, percent) = (length_m - lined.length_m, 100.0 * (1.0 - lined.length_m / length_m));
                let saved =
                    format!("{length_m:.6} m; the line saves {} m, {} %", Fixed::<6>(saved_m), Fixed::<1>(percent));
                ("without a line", saved)
            }
            (None, ..) => ("without a line", "no S keeps the limits".to_owned()),
            (Some(_), None, None) => ("with a line", "no S is shorter".to_owned()),
        });
        lines
    }
}

fn unknown() -> String {
    format!("the shortest S is unknown{}", interrupt::allows_more())
}
