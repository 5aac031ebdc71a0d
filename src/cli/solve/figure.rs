//! Shared parts of the figures of several questions: flags, captions, and the dragon in plan view.

use std::path::{Path, PathBuf};

use anyhow::ensure;
use bench_dragon_geometry::clearance::ClearanceSearch;
use bench_dragon_geometry::dragon::{Dimensions, Dragon};
use bench_dragon_geometry::number::Fixed;
use bench_dragon_geometry::route::{RouteShape, RouteSpec, Turnaround};
use clap::{Args, ValueHint};

use super::interrupt;
use crate::cli::flags::{BadInput, Format};
use crate::cli::print::print_line;
use crate::config::{Config, ConfigDocument};
use crate::output::Counted;
use crate::output::figure::{
    Caption, Circle, Drawing, FigureFormat, NearestPair, Paper, PlanView, TurnMarks, missing_letter,
};
use crate::output::in_plan::{boards, handles, in_plan, polyline};
use crate::output::terminal_text::Printable;

/// The flags of a figure.
#[derive(Clone, Debug, Args)]
pub(crate) struct FigureArgs {
    /// Draw a figure into this file, .svg, .pdf or .png; an existing file is replaced.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, value_parser = figure)]
    pub(crate) figure: Option<FigureFile>,
    /// Heading in large letters above the figure, such as the name of the show, 1 to 80 ASCII letters, digits and signs [default: none].
    #[arg(long, value_name = "TEXT", requires = "figure", value_parser = title)]
    pub(crate) title: Option<String>,
    /// Fill a sheet of this size, in portrait or landscape, whichever shows more: a0 to a4, letter, tabloid [default: 160 mm
    /// wide, for a document].
    #[arg(long, value_name = "SIZE", requires = "figure")]
    pub(crate) paper: Option<Paper>,
}

impl FigureArgs {
    /// Whether a figure is requested.
    pub(super) fn is_asked(&self) -> bool {
        self.figure.is_some()
    }

    /// Fails if the figure would replace the drawing of the route.
    pub(super) fn keep_drawing(&self, document: &ConfigDocument) -> Result<(), BadInput> {
        self.figure.as_ref().map_or(Ok(()), |file| keep_drawing("--figure", &file.path, document))
    }

    /// Writes a drawing to the requested file, on the requested paper.
    pub(super) fn save(&self, drawing: Drawing) -> anyhow::Result<()> {
        let Some(file) = &self.figure else { return Ok(()) };
        let drawing = if let Some(paper) = self.paper { drawing.on_paper(paper) } else { drawing };
        interrupt::write(&file.path, &drawing.encode(file.format))
    }

    /// Writes a drawing, and prints the file's path if the format is text.
    pub(super) fn save_and_report(&self, drawing: Drawing, format: Format) -> anyhow::Result<()> {
        self.save(drawing)?;
        match &self.figure {
            Some(file) if format == Format::Text => Ok(print_line(format_args!("drawn to {}", Printable(&file.path)))?),
            _ => Ok(()),
        }
    }

    /// Fails with `reason` if a figure is requested, because there is nothing to draw.
    pub(super) fn refuse(&self, reason: &str) -> anyhow::Result<()> {
        ensure!(!self.is_asked(), "--figure has nothing to show: {reason}");
        Ok(())
    }

    /// The caption of a figure with this title, for the configured dragon.
    pub(super) fn caption(&self, config: &Config, title: impl Into<String>) -> Caption {
        self.caption_at_speed(config, config.tables().head.speed_mps, title)
    }

    /// The caption of a figure with this title, for the configured dragon with another speed of the head, in m/s.
    pub(super) fn caption_at_speed(&self, config: &Config, speed_mps: f64, title: impl Into<String>) -> Caption {
        let mut caption = self.caption_of(config.document(), title);
        caption.facts.push(speed_fact(speed_mps, config.tables().head.accel_mps2));
        caption
    }

    /// The caption of a figure with this title, for the configured benches and route.
    pub(super) fn caption_of(&self, document: &ConfigDocument, title: impl Into<String>) -> Caption {
        let mut facts = dragon_facts(document.dimensions());
        facts.push(route_fact(document.route()));
        Caption { heading: self.title.clone(), title: title.into(), facts }
    }
}

/// Fails if a file to write is the drawing of the route.
pub(in crate::cli) fn keep_drawing(flag: &str, written: &Path, document: &ConfigDocument) -> Result<(), BadInput> {
    match document.drawing() {
        Some(drawing) if is_same_file(written, &drawing.path) => {
            let file = Printable(&drawing.file);
            Err(BadInput(format!("{flag} is {file}, the drawing of the route, must be another file")))
        }
        _ => Ok(()),
    }
}

/// Whether two paths lead to the same existing file.
fn is_same_file(one: &Path, other: &Path) -> bool {
    one.canonicalize().ok().zip(other.canonicalize().ok()).is_some_and(|(one, other)| one == other)
}

/// A file to draw into.
#[derive(Clone, Debug)]
pub(crate) struct FigureFile {
    pub(crate) path: PathBuf,
    pub(crate) format: FigureFormat,
}

fn figure(text: &str) -> Result<FigureFile, String> {
    let path = PathBuf::from(text);
    let format = FigureFormat::of(&path).ok_or("must end in .svg, .pdf or .png")?;
    Ok(FigureFile { path, format })
}

/// Most letters of a title. More would be too small to read.
const MOST_LETTERS: usize = 80;

pub(in crate::cli) fn title(text: &str) -> Result<String, String> {
    if text.trim().is_empty() || text.chars().count() > MOST_LETTERS {
        return Err(format!("must have 1 to {MOST_LETTERS} letters"));
    }
    match missing_letter(text) {
        Some(letter) => Err(format!("{letter:?} cannot be drawn: use letters, digits and signs of ASCII")),
        None => Ok(text.trim().to_owned()),
    }
}

fn dragon_facts(dimensions: &Dimensions) -> Vec<String> {
    let [head_m, body_m, width_m, hole_m] =
        [dimensions.head_length_m(), dimensions.body_length_m(), dimensions.width_m(), dimensions.hole_offset_m()]
            .map(rounded);
    vec![
        Counted(dimensions.benches() as u64, "bench").to_string(),
        format!("head {head_m} m, others {body_m} m"),
        format!("{width_m} m wide"),
        format!("holes at {hole_m} m"),
    ]
}

fn route_fact(route: &RouteSpec) -> String {
    match &route.shape {
        RouteShape::Spiral(plan) => format!("spiral, pitch {} m", rounded(plan.pitch_m)),
        RouteShape::Turnaround(plan) => {
            let [pitch_m, diameter_m, ratio] = [plan.pitch_m, plan.turn_diameter_m, plan.radius_ratio].map(rounded);
            let line = if plan.line_m > 0.0 { format!(", line {} m", rounded(plan.line_m)) } else { String::new() };
            format!("turnaround, pitch {pitch_m} m, turning circle {diameter_m} m, radius ratio {ratio}{line}")
        }
        RouteShape::Path(plan) => {
            let (segments, lap_m) = (Counted(plan.segments.len() as u64, "segment"), rounded(plan.lap_m()));
            match plan.laps {
                Some(laps) => format!("{} of {segments}, {lap_m} m each", Counted(u64::from(laps), "lap")),
                None => format!("path of {segments}, {lap_m} m"),
            }
        }
    }
}

fn speed_fact(speed_mps: f64, accel_mps2: Option<f64>) -> String {
    match accel_mps2 {
        Some(accel_mps2) => format!("head {} m/s, {} m/s²", rounded(speed_mps), rounded(accel_mps2)),
        None => format!("head {} m/s", rounded(speed_mps)),
    }
}

/// A number with up to six decimals, without trailing zeros.
fn rounded(value: f64) -> String {
    let text = Fixed::<6>(value).to_string();
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

pub(super) fn plan_of(config: &Config, dragon: &Dragon, caption: Caption, travel_m: f64) -> PlanView {
    PlanView { caption, dragon: in_plan(config, dragon, travel_m), circle: None, turn: None, pair: None }
}

pub(super) fn on_turn(plan: PlanView, turnaround: &Turnaround) -> PlanView {
    let radius_m = 0.5 * turnaround.turn_diameter_m();
    let circle = Circle { centre: turnaround.centre(), radius_m, name: "turning circle".to_owned() };
    PlanView { circle: Some(circle), turn: Some(turn_marks(turnaround)), ..plan }
}

/// The pair of these benches, or else the nearest pair. `None` if there are no two benches that are not neighbours.
pub(in crate::cli) fn pair(dragon: &Dragon, travel_m: f64, benches: Option<[usize; 2]>) -> Option<NearestPair> {
    let boards = boards(dragon, &handles(dragon, travel_m));
    let benches = benches.or_else(|| Some(ClearanceSearch::default().nearest(&boards)?.benches))?;
    let approach = boards[benches[0]].approach(&boards[benches[1]]);
    let half = 0.5 * approach.clearance_m.max(0.0) * approach.direction;
    Some(NearestPair {
        benches,
        clearance_m: approach.clearance_m,
        points: [approach.point - half, approach.point + half],
    })
}

/// Points of a line over time: a few per dot of a printed page.
const SAMPLES: u32 = 4_000;
/// Most handles that are placed for such a line. So the line of a long dragon has fewer points.
const MAX_PLACED: usize = 10_000_000;

/// The travels at which a line over time has its points, in metres.
pub(super) fn even_travels(dragon: &Dragon, from_m: f64, to_m: f64) -> Vec<f64> {
    let samples = SAMPLES.min((MAX_PLACED / dragon.dimensions().handles()) as u32);
    (0..=samples).map(|i| from_m + (to_m - from_m) * f64::from(i) / f64::from(samples)).collect()
}

fn turn_marks(turnaround: &Turnaround) -> TurnMarks {
    let [entry_m, line_end_m, end_m] = turnaround.ends_m();
    let route = turnaround.route();
    let seams = route.seams().iter().map(|&seam| route.point(seam).position).collect();
    let line = if turnaround.line_m() > 0.0 { polyline(&route, entry_m, line_end_m) } else { Vec::new() };
    TurnMarks { arcs: [polyline(&route, 0.0, entry_m), polyline(&route, line_end_m, end_m)], line, seams }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounded_numbers_have_no_trailing_zeros() {
        assert_eq!([0.450_337_37, 1.0, 300.0, 0.275].map(rounded), ["0.450337", "1", "300", "0.275"]);
    }

    #[test]
    fn captions_have_the_facts_of_the_configuration() {
        let text = "[dragon]\nbenches = 1\nwidth_m = 0.25\n[head]\nspeed_mps = 1.5\naccel_mps2 = 0.5\n";
        let config = Config::from_toml(text).expect("valid");
        let facts = dragon_facts(config.lead().dimensions());
        assert_eq!(facts, ["1 bench", "head 3.41 m, others 2.2 m", "0.25 m wide", "holes at 0.275 m"]);
        assert_eq!(route_fact(config.route()), "spiral, pitch 0.55 m");
        assert_eq!(
            speed_fact(config.tables().head.speed_mps, config.tables().head.accel_mps2),
            "head 1.5 m/s, 0.5 m/s²"
        );
    }
}
