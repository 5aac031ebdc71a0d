//! `solve sweep`: the area that all boards sweep, and how near they come to the borders of the stage.

use std::path::PathBuf;

use anyhow::Context as _;
use bench_dragon_geometry::clearance::{Breach, LeastDistance, SweptArea, first_breach, least_distance};
use bench_dragon_geometry::formation::Formation;
use bench_dragon_geometry::number::{Fixed, Place};
use bench_dragon_geometry::stage::{BorderKind, Stage};
use clap::{Args, ValueHint};
use glam::DVec2;
use serde::Serialize;

use super::figure::{FigureArgs, FigureFile, title};
use super::{WorkArgs, interrupt, load_any_plan};
use crate::cli::flags::{ConfigArgs, Format, FormatArgs, within};
use crate::cli::in_file;
use crate::cli::print::{print_line, print_report};
use crate::config::Config;
use crate::output::Counted;
use crate::output::figure::{Caption, FigureFormat, Paper, SweepView};
use crate::output::floor_plan::FloorPlan;
use crate::output::in_plan::stage_in_plan;
use crate::output::terminal_text::Printable;

/// Find the area that all boards sweep over the whole run, and how near they come to the borders of `[stage]`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon solve sweep --config square.toml
  bench-dragon solve sweep --config square.toml --figure floor.dxf
  bench-dragon solve sweep --config square.toml --tolerance 0.05 --figure floor.png --paper a2")]
pub(crate) struct SweepArgs {
    /// Greatest distance in metres by which the area is larger than the true one, 0.001 to 1; it is never smaller.
    #[arg(long, value_name = "METRES", default_value = "0.01", allow_negative_numbers = true, value_parser = within(0.001..=1.0))]
    pub(crate) tolerance: f64,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    /// Draw the area into this file, .svg, .pdf or .png, or write its borders in metres, .dxf or .geojson; an existing file is replaced.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, value_parser = floor_file)]
    pub(crate) figure: Option<FloorFile>,
    /// Heading in large letters above the figure, such as the name of the show, 1 to 80 ASCII letters, digits and signs [default: none].
    #[arg(long, value_name = "TEXT", requires = "figure", value_parser = title)]
    pub(crate) title: Option<String>,
    /// Fill a sheet of this size, in portrait or landscape, whichever shows more: a0 to a4, letter, tabloid [default: 160 mm
    /// wide, for a document].
    #[arg(long, value_name = "SIZE", requires = "figure")]
    pub(crate) paper: Option<Paper>,
    #[command(flatten)]
    pub(crate) work: WorkArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// A file for the swept area.
#[derive(Clone, Debug)]
pub(crate) struct FloorFile {
    path: PathBuf,
    format: FloorFormat,
}

#[derive(Clone, Copy, Debug)]
enum FloorFormat {
    Figure(FigureFormat),
    Dxf,
    GeoJson,
}

fn floor_file(text: &str) -> Result<FloorFile, String> {
    let path = PathBuf::from(text);
    let suffix = path.extension().map(|suffix| suffix.to_string_lossy().to_ascii_lowercase());
    let format = match (FigureFormat::of(&path), suffix.as_deref()) {
        (Some(format), _) => FloorFormat::Figure(format),
        (None, Some("dxf")) => FloorFormat::Dxf,
        (None, Some("geojson")) => FloorFormat::GeoJson,
        _ => return Err("must end in .svg, .pdf, .png, .dxf or .geojson".to_owned()),
    };
    Ok(FloorFile { path, format })
}

#[derive(Serialize)]
struct SweepAnswer {
    /// Size of the swept area; null if it takes too much work.
    area_m2: Option<f64>,
    /// Its lowest and its highest x and y: x, y, x, y.
    box_m: Option<[f64; 4]>,
    /// The greatest distance by which the area is larger than the true one.
    tolerance_m: f64,
    /// Least distance of a board from the line of the crowd; null without one.
    crowd_m: Option<f64>,
    /// The first time at which a board is that near.
    at_s: Option<f64>,
    /// The index of its bench within its dragon.
    bench: Option<usize>,
    /// The name of the dragon, if there are several.
    dragon: Option<String>,
    /// The least distance from the outline, from the areas to keep out of, and from the crowd, if they are present.
    borders: Vec<NearBorder>,
    /// The first board that is beyond a border, or nearer to it than `clear_m`.
    too_near: Option<TooNear>,
    /// The reason for which a part of the answer is unknown: it took too much work.
    undecided: Option<String>,
}

/// The least distance of a board from a border.
#[derive(Clone, Debug, Serialize)]
struct NearBorder {
    /// The border, as messages call it.
    border: String,
    distance_m: f64,
    #[serde(flatten)]
    who: Who,
    #[serde(skip)]
    kind: BorderKind,
}

#[derive(Serialize)]
struct TooNear {
    border: String,
    #[serde(flatten)]
    who: Who,
}

/// A board at a time and a place.
#[derive(Clone, Debug, Serialize)]
struct Who {
    at_s: f64,
    bench: usize,
    /// The name of the dragon, if there are several.
    dragon: Option<String>,
    point_m: [f64; 2],
}

impl Who {
    fn of(config: &Config, dragon: usize, travel_m: f64, bench: usize, point: DVec2) -> Self {
        Self {
            at_s: config.formation().dragons()[dragon].timetable.time_s(travel_m),
            bench,
            dragon: config.named().map(|named| named.dragons()[dragon].name.clone()),
            point_m: point.to_array(),
        }
    }

    fn text(&self) -> String {
        let dragon = self.dragon.as_ref().map_or_else(String::new, |name| format!("{name} "));
        format!("{dragon}bench {} at {} s, at {}", self.bench, Fixed::<6>(self.at_s), Place::<6>(self.point_m))
    }
}

pub(super) fn run(args: &SweepArgs) -> anyhow::Result<()> {
    let config = in_file(&args.config, load_any_plan(&args.config, args.work)?.build())?;
    if let Some(file) = &args.figure {
        let documents = config.named().map(|named| named.dragons().iter().map(|dragon| dragon.config.document()));
        let all = documents.into_iter().flatten().chain([config.document()]);
        all.into_iter().try_for_each(|document| super::keep_drawing("--figure", &file.path, document))?;
    }
    let (area, unswept) = match SweptArea::of(&config.formation().metered(&args.work.meter()), args.tolerance) {
        Ok(area) => (Some(area), None),
        Err(error) => (None, Some(format!("the area: {error}"))),
    };
    let nearest = borders(&config, args.work);
    let too_near = too_near(&config, args.work);
    let undecided = [unswept, nearest.as_ref().err().cloned(), too_near.as_ref().err().cloned()];
    let borders = nearest.unwrap_or_default();
    let crowd = borders.iter().find(|near| near.kind == BorderKind::Crowd);
    let answer = SweepAnswer {
        area_m2: area.as_ref().map(SweptArea::area_m2),
        box_m: area.as_ref().map(|area| {
            let [low, high] = area.bounds();
            [low.x, low.y, high.x, high.y]
        }),
        tolerance_m: args.tolerance,
        crowd_m: crowd.map(|near| near.distance_m),
        at_s: crowd.map(|near| near.who.at_s),
        bench: crowd.map(|near| near.who.bench),
        dragon: crowd.and_then(|near| near.who.dragon.clone()),
        too_near: too_near.unwrap_or_default(),
        undecided: undecided.into_iter().flatten().reduce(|all, reason| format!("{all}; {reason}")),
        borders,
    };
    print_report(args.format.format, &answer, answer.text(config.stage()))?;
    save(args, &config, area.as_ref(), &answer)
}

/// The least distance from each kind of border.
fn borders(config: &Config, work: WorkArgs) -> Result<Vec<NearBorder>, String> {
    let mut nearest = Vec::new();
    for kind in BorderKind::ALL {
        let mut least: Option<NearBorder> = None;
        for (number, planned) in metered(config, work).dragons().iter().enumerate() {
            let found = least_distance(&planned.dragon, config.stage(), kind)
                .map_err(|spent| format!("distances from borders: {spent}"))?;
            let Some(LeastDistance { distance_m, travel_m, bench, border, point }) = found else { continue };
            let who = Who::of(config, number, travel_m, bench, point);
            let is_nearer = least.as_ref().is_none_or(|least| {
                distance_m < least.distance_m || distance_m == least.distance_m && who.at_s < least.who.at_s
            });
            if is_nearer {
                least = Some(NearBorder { border: config.stage().name(border), distance_m, who, kind });
            }
        }
        nearest.extend(least);
    }
    Ok(nearest)
}

/// The first board of all dragons that is too near to a border.
fn too_near(config: &Config, work: WorkArgs) -> Result<Option<TooNear>, String> {
    let mut first: Option<TooNear> = None;
    for (number, planned) in metered(config, work).dragons().iter().enumerate() {
        let found = first_breach(&planned.dragon, config.stage(), config.stage().clear_m())
            .map_err(|spent| format!("boards too near to a border: {spent}"))?;
        let Some(Breach { travel_m, bench, border, point }) = found else { continue };
        let who = Who::of(config, number, travel_m, bench, point);
        if first.as_ref().is_none_or(|first| who.at_s < first.who.at_s) {
            first = Some(TooNear { border: config.stage().name(border), who });
        }
    }
    Ok(first)
}

fn metered(config: &Config, work: WorkArgs) -> Formation {
    config.formation().metered(&work.meter())
}

impl SweepAnswer {
    fn text(&self, stage: &Stage) -> String {
        let mut lines = Vec::new();
        if let (Some(area_m2), Some([low_x, low_y, high_x, high_y])) = (self.area_m2, self.box_m) {
            lines.push(format!(
                "boards sweep {} m², from {} to {}, at most {} m too far",
                Fixed::<3>(area_m2),
                Place::<3>([low_x, low_y]),
                Place::<3>([high_x, high_y]),
                self.tolerance_m
            ));
        }
        let near = |NearBorder { border, distance_m, who, .. }: &NearBorder| {
            format!("{border}: nearest {} m, {}", Fixed::<6>(*distance_m), who.text())
        };
        lines.extend(self.borders.iter().map(near));
        let [passes, none_passes] = if stage.clear_m() > 0.0 {
            let clear = format!("nearer than clear_m {}", stage.clear_m());
            [format!("first {clear}"), format!("no board comes {clear} to a border")]
        } else {
            ["first passed".to_owned(), "no board passes a border".to_owned()]
        };
        match &self.too_near {
            Some(TooNear { border, who }) => lines.push(format!("{border}: {passes}, {}", who.text())),
            None if stage.borders().is_empty() || self.undecided.is_some() => {}
            None => lines.push(none_passes),
        }
        lines.extend(self.undecided.as_ref().map(|reason| format!("unknown: {reason}{}", interrupt::allows_more())));
        lines.join("\n")
    }
}

/// Writes the file of `--figure`.
fn save(args: &SweepArgs, config: &Config, area: Option<&SweptArea>, answer: &SweepAnswer) -> anyhow::Result<()> {
    let Some(FloorFile { path, format }) = &args.figure else { return Ok(()) };
    interrupt::require_whole(path)?;
    let area = area.context("--figure has nothing to show: the area takes too much work")?;
    let stage = stage_in_plan(config.stage());
    let FloorFormat::Figure(format) = *format else {
        let plan = FloorPlan { swept: area.parts.clone(), stage, marks: Vec::new() };
        let text = if matches!(format, FloorFormat::Dxf) { plan.to_dxf() } else { plan.to_geojson() };
        interrupt::write(path, text.as_bytes())?;
        return print_path(args);
    };
    let dragons = config.formation().dragons().len();
    let who = if dragons > 1 { Counted(dragons as u64, "dragon").to_string() } else { "the dragon".to_owned() };
    let caption = Caption {
        heading: args.title.clone(),
        title: format!("The area that boards of {who} sweep"),
        facts: vec![
            format!("{} m²", Fixed::<1>(area.area_m2())),
            Counted(config.formation().layout().benches() as u64, "bench").to_string(),
        ],
    };
    let view = SweepView {
        caption,
        stage,
        area: area.parts.concat(),
        nearest: answer.borders.iter().map(|near| near.who.point_m.into()).collect(),
        marks: Vec::new(),
    };
    let figure = Some(FigureFile { path: path.clone(), format });
    FigureArgs { figure, title: None, paper: args.paper }.save(view.draw())?;
    print_path(args)
}

/// Prints the path of the written file, if the format is text.
fn print_path(args: &SweepArgs) -> anyhow::Result<()> {
    match &args.figure {
        Some(file) if args.format.format == Format::Text => {
            Ok(print_line(format_args!("drawn to {}", Printable(&file.path)))?)
        }
        _ => Ok(()),
    }
}
