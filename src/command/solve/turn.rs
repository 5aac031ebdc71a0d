//! `solve turn`: does the dragon get through a turn, and how near do its benches come to each other?

use std::fmt::Write as _;

use bench_dragon::dragon::Dimensions;
use bench_dragon::plan::{ClosestApproach, TurnPassage, passage_through, walk_through};
use bench_dragon::route::{CircularArc, Turnaround};
use serde::Serialize;

use super::figures;
use super::save_config::save_config;
use super::turn_plan::planned_turn;
use crate::cli::{Format, TurnArgs};
use crate::command::output::{print_json, print_line};

#[derive(Serialize)]
struct Answer {
    radii_m: [f64; 2],
    length_m: f64,
    centres_m: [[f64; 2]; 2],
    entry_m: [f64; 2],
    exit_m: [f64; 2],
    /// By how much either arc turns, in radians.
    angles: [f64; 2],
    least_clearance: Option<Nearness>,
    contact: Option<Touch>,
    infeasible: Option<String>,
}

#[derive(Serialize)]
struct Nearness {
    clearance_m: f64,
    time_s: f64,
    benches: [usize; 2],
    point_m: [f64; 2],
}

#[derive(Serialize)]
struct Touch {
    time_s: f64,
    benches: [usize; 2],
    point_m: [f64; 2],
}

pub(super) fn run(args: &TurnArgs) -> anyhow::Result<()> {
    let (config, plan) = planned_turn(&args.plan)?;
    let speed_mps = config.head_speed_mps();
    let turnaround = plan.turnaround(speed_mps)?;
    let passage = walk_through(turnaround, *config.dragon().dimensions());
    let answer = Answer::of(&turnaround, &passage, speed_mps);
    match args.format.format {
        Format::Json => print_json(&answer)?,
        Format::Text => print_line(answer.text().trim_end())?,
    }
    draw(args, &turnaround, *config.dragon().dimensions(), &passage, speed_mps)?;
    save_config(&args.save, answer.infeasible.as_deref().map_or(Ok(&config), Err))
}

/// Draws the dragon where its benches come nearest, or where they touch.
fn draw(
    args: &TurnArgs,
    turnaround: &Turnaround,
    dimensions: Dimensions,
    passage: &TurnPassage,
    speed_mps: f64,
) -> anyhow::Result<()> {
    let Some(file) = &args.figure.figure else { return Ok(()) };
    let (what, travel_m) = match passage {
        TurnPassage::Clear { closest: Some(closest) } => ("nearest to itself", closest.travel_m),
        TurnPassage::Clear { closest: None } => ("on its way out", turnaround.turn_length_m()),
        TurnPassage::Contact(contact) => ("touching itself", contact.travel_m),
        TurnPassage::Infeasible(infeasible) => return figures::refuse(&args.figure, &infeasible.to_string()),
    };
    let dragon = passage_through(*turnaround, dimensions)?;
    let title = format!("The dragon {what}, at {:.6} s", travel_m / speed_mps);
    figures::save(&figures::turn_view(&dragon, turnaround, title, travel_m).draw(), file)?;
    if args.format.format == Format::Text { figures::tell(&args.figure) } else { Ok(()) }
}

impl Answer {
    fn of(turnaround: &Turnaround, passage: &TurnPassage, speed_mps: f64) -> Self {
        let arcs = turnaround.arcs();
        let nearness = |ClosestApproach { travel_m, pair }: &ClosestApproach| Nearness {
            clearance_m: pair.clearance_m,
            time_s: travel_m / speed_mps,
            benches: pair.benches,
            point_m: pair.point.to_array(),
        };
        Self {
            radii_m: arcs.map(|arc| arc.radius_m()),
            length_m: turnaround.turn_length_m(),
            centres_m: arcs.map(|arc| arc.centre().to_array()),
            entry_m: turnaround.entry().to_array(),
            exit_m: turnaround.exit().to_array(),
            angles: arcs.map(|arc: CircularArc| arc.angle()),
            least_clearance: match passage {
                TurnPassage::Clear { closest } => closest.as_ref().map(nearness),
                _ => None,
            },
            contact: match passage {
                TurnPassage::Contact(contact) => Some(Touch {
                    time_s: contact.travel_m / speed_mps,
                    benches: contact.benches,
                    point_m: contact.point.to_array(),
                }),
                _ => None,
            },
            infeasible: match passage {
                TurnPassage::Infeasible(infeasible) => Some(infeasible.to_string()),
                _ => None,
            },
        }
    }

    fn text(&self) -> String {
        let mut text = String::new();
        // Writing into a String cannot fail.
        for (name, i) in [("entry arc", 0), ("exit arc", 1)] {
            let (radius_m, [x, y], degrees) = (self.radii_m[i], self.centres_m[i], self.angles[i].to_degrees());
            let _ = writeln!(text, "{name:<16} radius {radius_m:.6} m, centre ({x:.6}, {y:.6}) m, turns {degrees:.3}°");
        }
        let ([entry_x, entry_y], [exit_x, exit_y]) = (self.entry_m, self.exit_m);
        let _ = writeln!(text, "{:<16} ({entry_x:.6}, {entry_y:.6}) m", "entry");
        let _ = writeln!(text, "{:<16} ({exit_x:.6}, {exit_y:.6}) m", "exit");
        let _ = writeln!(text, "{:<16} {:.6} m", "length", self.length_m);
        if let Some(Nearness { clearance_m, time_s, benches: [first, second], point_m: [x, y] }) = self.least_clearance
        {
            let _ = writeln!(
                text,
                "{:<16} {clearance_m:.6} m at {time_s:.6} s, benches {first} and {second}, at ({x:.6}, {y:.6}) m",
                "least clearance"
            );
        }
        if let Some(Touch { time_s, benches: [first, second], point_m: [x, y] }) = self.contact {
            let _ = writeln!(
                text,
                "{:<16} at {time_s:.6} s, benches {first} and {second}, at ({x:.6}, {y:.6}) m",
                "first contact"
            );
        }
        if let Some(reason) = &self.infeasible {
            let _ = writeln!(text, "{:<16} {reason}", "infeasible");
        }
        text
    }
}
