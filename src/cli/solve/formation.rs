//! Questions about several dragons: `solve contact` and `solve poses` for a configuration with `[[dragons]]`.

use std::ops::RangeInclusive;

use bench_dragon_geometry::clearance::{Meeting, first_meeting};
use bench_dragon_geometry::formation::Planned;
use bench_dragon_geometry::number::Fixed;
use glam::DVec2;
use serde::Serialize;

use super::contact::ContactArgs;
use super::figure::FigureArgs;
use super::interrupt;
use super::poses::{PosesArgs, one_time, times_s};
use crate::cli::flags::{BadInput, Format};
use crate::cli::print::{print_json, print_line};
use crate::config::{FormationDocument, NamedDragon};
use crate::output::Counted;
use crate::output::figure::{Caption, FormationView};
use crate::output::in_plan::dragons_in_plan;
use crate::output::poses::{MAX_POSITIONS, Poses};

/// The first contact of several dragons.
#[derive(Serialize)]
struct MeetingAnswer<'a> {
    /// Plan time in seconds; null where no benches touch.
    time_s: Option<f64>,
    /// The indices of the two benches within their dragons.
    benches: Option<[usize; 2]>,
    /// The names of their dragons.
    dragons: Option<[&'a str; 2]>,
    point_m: Option<[f64; 2]>,
    /// The requested clearance, in metres.
    clearance_m: Option<f64>,
    /// Plan time up to which there is no contact, where the search took too much work.
    searched_to_s: Option<f64>,
    /// The dragons that cannot walk their whole routes.
    stopped: Vec<Stopped<'a>>,
}

/// A dragon that stops before the end of its route.
#[derive(Serialize)]
struct Stopped<'a> {
    dragon: &'a str,
    time_s: f64,
    because: String,
}

impl<'a> Stopped<'a> {
    fn of(named: &'a NamedDragon, planned: &Planned) -> Option<Self> {
        let spot = planned.dragon.tight_spot()?;
        let because = format!("{}: {spot}", planned.dragon.feasible_end());
        Some(Self { dragon: &named.name, time_s: planned.timetable.end_s(), because })
    }

    fn text(&self) -> String {
        let Self { dragon, time_s, because } = self;
        format!("{dragon} stops at {} s, where {because}", Fixed::<6>(*time_s))
    }
}

/// Answers `solve contact` for a formation.
pub(super) fn contact(args: &ContactArgs, document: &FormationDocument) -> anyhow::Result<()> {
    refuse("--profile", args.profile, document)?;
    refuse("--contest", args.contest.is_some(), document)?;
    refuse("--max-ratio", args.max_ratio.is_some(), document)?;
    let clearance_m = args.clearance.unwrap_or(0.0);
    let formation = document.formation().metered(&args.work.meter());
    let searched = first_meeting(&formation, clearance_m, document.start_s(), document.formation().end_s());
    let meeting = searched.as_ref().ok().copied().flatten();
    let members = meeting.map(|meeting| meeting.benches.map(|bench| document.named_bench(bench)));
    let answer = MeetingAnswer {
        time_s: meeting.map(|meeting| meeting.time_s),
        benches: members.map(|members| members.map(|(_, index)| index)),
        dragons: members.map(|members| members.map(|(name, _)| name)),
        point_m: meeting.map(|meeting| meeting.point.to_array()),
        clearance_m: args.clearance,
        searched_to_s: searched.as_ref().err().map(|unfinished| unfinished.reached_s),
        stopped: document
            .dragons()
            .iter()
            .zip(formation.dragons())
            .filter_map(|(named, planned)| Stopped::of(named, planned))
            .collect(),
    };
    let view = meeting.map(|Meeting { time_s, point, .. }| {
        let names = members.map(|members| members.map(|(name, index)| format!("{name} bench {index}")).join(" and "));
        let title = format!("First {} at {} s: {}", what(clearance_m), Fixed::<6>(time_s), names.unwrap_or_default());
        formation_view(&args.figure, document, time_s, title, Some(point))
    });
    if args.format.format == Format::Json {
        print_json(&answer)?;
        return save(&args.figure, view, args.format.format);
    }
    let what = what(clearance_m);
    let text = match (meeting, members, searched.err()) {
        (Some(Meeting { time_s, point, .. }), Some([(one, first), (other, second)]), _) => format!(
            "first {what} at {} s: {one} bench {first} and {other} bench {second}, at ({}, {})",
            Fixed::<6>(time_s),
            Fixed::<6>(point.x),
            Fixed::<6>(point.y),
        ),
        (_, _, Some(unfinished)) => format!(
            "no {what} before {} s; not searched further: {unfinished}{}",
            Fixed::<6>(unfinished.reached_s),
            interrupt::allows_more()
        ),
        _ => format!("no {what}, until the last dragon ends at {} s", Fixed::<6>(document.formation().end_s())),
    };
    print_line(text)?;
    answer.stopped.iter().try_for_each(|stopped| print_line(stopped.text()))?;
    save(&args.figure, view, args.format.format)
}

/// The word for what a search finds.
fn what(clearance_m: f64) -> String {
    if clearance_m > 0.0 { format!("pair within {clearance_m} m") } else { "contact".to_owned() }
}

/// Writes the figure of a meeting, if it is requested.
fn save(figure: &FigureArgs, view: Option<FormationView>, format: Format) -> anyhow::Result<()> {
    match view {
        Some(view) if figure.is_asked() => figure.save_and_report(view.draw(), format),
        _ => figure.refuse("no contact is found"),
    }
}

/// All dragons on their routes at a plan time.
pub(super) fn formation_view(
    figure: &FigureArgs,
    document: &FormationDocument,
    time_s: f64,
    title: String,
    mark: Option<DVec2>,
) -> FormationView {
    let benches = Counted(document.formation().layout().benches() as u64, "bench");
    let caption = Caption { heading: figure.title.clone(), title, facts: vec![benches.to_string()] };
    FormationView { caption, dragons: dragons_in_plan(document, time_s), mark, shows_routes: false }
}

/// Answers `solve poses` for a formation.
pub(super) fn poses(args: &PosesArgs, document: &FormationDocument) -> anyhow::Result<Poses> {
    refuse("--xlsx", args.xlsx.is_some(), document)?;
    refuse("--contest", args.contest.is_some(), document)?;
    let most = MAX_POSITIONS / document.formation().layout().handles();
    let span: RangeInclusive<f64> = document.start_s()..=document.formation().end_s();
    let times_s = times_s(&args.times, &span, most)?;
    if args.figure.is_asked() {
        let time_s = one_time(&times_s)?;
        let title = format!("{} at {time_s} s", Counted(document.dragons().len() as u64, "dragon"));
        args.figure.save(formation_view(&args.figure, document, time_s, title, None).draw())?;
    }
    Ok(Poses::of_formation(&times_s, document))
}

/// Fails for a flag that is for one dragon only.
pub(super) fn refuse(flag: &str, is_set: bool, document: &FormationDocument) -> Result<(), BadInput> {
    if is_set {
        let count = document.dragons().len();
        return Err(BadInput(format!("{flag} is for one dragon, the configuration has {count}")));
    }
    Ok(())
}
