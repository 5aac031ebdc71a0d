//! Plans on paper, and the floor for marking it.

use bench_dragon_geometry::clearance::SweptArea;
use bench_dragon_geometry::number::{Fixed, Place};

use super::{HandOver, Moment};
use crate::output::Counted;
use crate::output::figure::{Caption, Drawing, FigureFormat, FormationView, NamedInPlan, SweepView, pages_of};
use crate::output::floor_plan::{FloorMark, FloorPlan};
use crate::output::in_plan::{dragons_in_plan, handles, in_plan, polyline, stage_in_plan};

/// Greatest distance by which the swept area is larger than the true one, in metres.
const TOLERANCE_M: f64 = 0.01;
/// Greatest number of boards on all pages of a figure.
const MOST_BOARDS: usize = 100_000;
/// Greatest number of marks of a floor.
const MOST_MARKS: usize = 200_000;
/// Greatest number of moments whose names are on the floor's figure.
const NAMED_MOMENTS: usize = 20;
/// In CAD, every handle of this many has its name and coordinates as text.
const NAMED_HANDLES: usize = 10;

/// The plan at the start, in the format of a suffix.
pub(super) fn plan(show: &HandOver<'_>, suffix: &str) -> Result<Vec<u8>, String> {
    require_boards(show, 1)?;
    let start = &show.moments[0];
    Ok(encode(&drawing(show, 0, start), suffix))
}

/// A page for each moment.
pub(super) fn moments(show: &HandOver<'_>) -> Result<Vec<u8>, String> {
    require_boards(show, show.moments.len())?;
    let numbered = show.moments.iter().enumerate();
    let drawings: Vec<Drawing> = numbered.map(|(number, moment)| drawing(show, number, moment)).collect();
    Ok(pages_of(&drawings))
}

/// The floor, in the format of a suffix.
pub(super) fn floor(show: &HandOver<'_>, suffix: &str) -> Result<Vec<u8>, String> {
    let area = SweptArea::of(&show.config.formation().metered(&show.meter), TOLERANCE_M)
        .map_err(|error| format!("the swept area: {error}; --work allows more"))?;
    let stage = stage_in_plan(show.config.stage());
    if suffix == "dxf" {
        let plan = FloorPlan { swept: area.parts, stage, marks: marks(show)? };
        return Ok(plan.to_dxf().into_bytes());
    }
    let mut facts = vec![
        format!("{} m² swept by boards, at most {TOLERANCE_M} m too far", Fixed::<1>(area.area_m2())),
        Counted(show.config.formation().layout().benches() as u64, "bench").to_string(),
    ];
    let numbered = show.moments.iter().zip(1..).take(NAMED_MOMENTS);
    facts
        .extend(numbered.map(|(moment, number)| format!("{number}: {}, {} s", moment.name, Fixed::<1>(moment.time_s))));
    let title = "The floor: heads and tails at each moment".to_owned();
    let caption = Caption { heading: Some(show.title.clone()), title, facts };
    let view = SweepView { caption, stage, area: area.parts.concat(), nearest: Vec::new(), marks: ends(show) };
    Ok(encode(&view.draw().on_paper(show.paper), suffix))
}

fn require_boards(show: &HandOver<'_>, pages: usize) -> Result<(), String> {
    let boards = show.config.formation().layout().benches() * pages;
    if boards <= MOST_BOARDS {
        return Ok(());
    }
    Err(format!("it would have {boards} boards, at most {MOST_BOARDS} are drawn"))
}

fn encode(drawing: &Drawing, suffix: &str) -> Vec<u8> {
    drawing.encode(match suffix {
        "svg" => FigureFormat::Svg,
        "png" => FigureFormat::Png,
        _ => FigureFormat::Pdf,
    })
}

/// All dragons at a moment, on paper. All moments of a show have the same frame.
fn drawing(show: &HandOver<'_>, number: usize, moment: &Moment) -> Drawing {
    let Moment { name, time_s, cue } = moment;
    let title = format!("{}: {name}, at {} s", number + 1, Fixed::<3>(*time_s));
    let benches = Counted(show.config.formation().layout().benches() as u64, "bench").to_string();
    let note = cue.iter().map(|(note, _)| note.clone()).filter(|note| !note.is_empty());
    let contact = show.attention();
    let facts = std::iter::once(benches).chain(note).chain(contact).collect();
    let caption = Caption { heading: Some(show.title.clone()), title, facts };
    let dragons = dragons(show, *time_s);
    FormationView { caption, dragons, mark: None, shows_routes: true }.draw().on_paper(show.paper)
}

/// All dragons with their whole routes.
fn dragons(show: &HandOver<'_>, time_s: f64) -> Vec<NamedInPlan> {
    let planned = show.config.formation().dragons();
    let mut dragons = match show.config.named() {
        Some(named) => dragons_in_plan(named, time_s),
        None => vec![NamedInPlan {
            name: "dragon".to_owned(),
            colour: Some(show.colours()[0]),
            dragon: in_plan(show.config, show.config.lead(), planned[0].travel_m(time_s)),
        }],
    };
    for (named, planned) in dragons.iter_mut().zip(planned) {
        let (dragon, route) = (&planned.dragon, planned.dragon.route());
        named.dragon.route =
            polyline(route, dragon.start_travel_m() - dragon.dimensions().links_m(), route.end_travel_m());
    }
    dragons
}

/// The places of all handles of all dragons at a time, each with its dragon's number and its index.
pub(super) fn places(show: &HandOver<'_>, time_s: f64) -> impl Iterator<Item = (usize, usize, [f64; 2])> {
    let planned = show.config.formation().dragons().iter().enumerate();
    planned.flat_map(move |(number, planned)| {
        let handles = handles(&planned.dragon, planned.travel_m(time_s));
        handles.into_iter().enumerate().map(move |(index, handle)| (number, index, handle.position.to_array()))
    })
}

/// The head and the tail of each dragon at each moment, with number of the moment and coordinates; of several dragons, also its name.
fn ends(show: &HandOver<'_>) -> Vec<(glam::DVec2, Vec<String>)> {
    let layout = show.config.formation().layout();
    let names = show.config.named().map(|_| show.names());
    let mut marks = Vec::new();
    for (number, moment) in show.moments.iter().enumerate() {
        for (dragon, index, place) in places(show, moment.time_s) {
            let last = layout.handles_of(dragon).len() - 1;
            let letter = match index {
                0 => "H",
                index if index == last => "T",
                _ => continue,
            };
            let end = format!("{letter}{}", number + 1);
            let end = names.as_ref().map_or(end.clone(), |names| format!("{} {end}", names[dragon]));
            marks.push((place.into(), vec![end, format!("{}, {}", Fixed::<2>(place[0]), Fixed::<2>(place[1]))]));
        }
    }
    marks
}

/// All handles at each moment, on a layer for each moment.
fn marks(show: &HandOver<'_>) -> Result<Vec<FloorMark>, String> {
    let layout = show.config.formation().layout();
    let count = layout.handles() * show.moments.len();
    if count > MOST_MARKS {
        return Err(format!("it would have {count} marks, at most {MOST_MARKS} are written"));
    }
    let names = show.names();
    let mut marks = Vec::new();
    for (number, moment) in show.moments.iter().enumerate() {
        for (dragon, index, place) in places(show, moment.time_s) {
            let is_named = index % NAMED_HANDLES == 0 || index + 1 == layout.handles_of(dragon).len();
            let words = || format!("{} {index} {}", names[dragon], Place::<3>(place));
            let layer = format!("HANDLES_{:02}", number + 1);
            marks.push(FloorMark { layer, point: place.into(), words: is_named.then(words) });
        }
    }
    Ok(marks)
}
