//! `solve route`, `solve speed-limit` and `solve sensitivity` for several dragons: an answer for each.

use bench_dragon_geometry::dragon::Meter;
use bench_dragon_geometry::formation::Planned;
use bench_dragon_geometry::number::Fixed;
use bench_dragon_geometry::planner::{
    Infeasible, LargestRatio, MeetingRate, MeetingSensitivity, RouteSurvey, Setting, largest_speed_ratio,
    meeting_sensitivity,
};
use serde::Serialize;

use super::AnswerArgs;
use super::formation::{formation_view, refuse};
use super::interrupt;
use super::route::{RouteAnswer, RouteArgs, standing_m};
use super::sensitivity::SensitivityArgs;
use super::speed_limit::SpeedLimitArgs;
use super::stage::StageAnswer;
use crate::cli::flags::Format;
use crate::cli::print::{print_bytes, print_json, print_line, print_report};
use crate::config::{FormationDocument, NamedDragon};
use crate::output::Counted;
use crate::output::figure::FormationView;
use crate::output::table::{self, Cell, Column, Table};

/// An answer for each dragon.
#[derive(Serialize)]
struct Dragons<'a, Answer> {
    dragons: Vec<OfDragon<'a, Answer>>,
}

#[derive(Serialize)]
struct OfDragon<'a, Answer> {
    dragon: &'a str,
    #[serde(flatten)]
    answer: Answer,
}

/// Answers `solve route` for a formation.
pub(super) fn routes(args: &RouteArgs, document: &FormationDocument) -> anyhow::Result<()> {
    keep_files_apart(&args.answer, document)?;
    let planned = document.formation().dragons();
    let (dragons, texts): (Vec<_>, Vec<String>) =
        document.dragons().iter().zip(planned).map(|(named, planned)| route(args, named, planned)).unzip();
    print_report(args.answer.format.format, &Dragons { dragons }, texts.join("\n\n"))?;
    let figure = &args.answer.figure;
    if figure.is_asked() {
        let title = format!("The routes of {}, and where they start", Counted(texts.len() as u64, "dragon"));
        let view = formation_view(figure, document, document.start_s(), title, None);
        figure.save_and_report(FormationView { shows_routes: true, ..view }.draw(), args.answer.format.format)?;
    }
    match &args.answer.save_config {
        Some(path) => interrupt::write(path, document.to_toml().as_bytes()),
        None => Ok(()),
    }
}

/// The survey of a dragon's route, for JSON and as text.
fn route<'a>(args: &RouteArgs, named: &'a NamedDragon, planned: &Planned) -> (OfDragon<'a, RouteAnswer>, String) {
    let config = &named.config;
    let meter = args.answer.work.meter();
    let survey = RouteSurvey::of(config.lead().route(), config.route(), standing_m(config.lead()), &meter);
    let stage = StageAnswer::of(config.stage(), planned, args.answer.work);
    let answer = RouteAnswer::of(config.document(), &survey, Ok(config)).ending_at(planned.timetable.end_s());
    let answer = answer.on_stage(stage);
    let text = answer.text(config.route(), config.document().drawing());
    let text = format!("{:<16} {}\n{text}", "dragon", named.name);
    (OfDragon { dragon: &named.name, answer }, text)
}

/// Fails if an output would replace the drawing of a dragon's route.
fn keep_files_apart(args: &AnswerArgs, document: &FormationDocument) -> anyhow::Result<()> {
    Ok(document.dragons().iter().try_for_each(|dragon| args.keep_files_apart(dragon.config.document()))?)
}

#[derive(Default, Serialize)]
struct SpeedAnswer {
    head_speed_mps: Option<f64>,
    /// The configured speed of the head.
    planned_speed_mps: f64,
    largest_ratio: Option<f64>,
    /// Plan time of the largest ratio.
    time_s: Option<f64>,
    handle: Option<usize>,
    infeasible: Option<String>,
    undecided: Option<String>,
}

/// Answers `solve speed-limit` for a formation.
pub(super) fn speed_limits(args: &SpeedLimitArgs, document: &FormationDocument) -> anyhow::Result<()> {
    refuse("--save-config", args.answer.save_config.is_some(), document)?;
    refuse("--figure", args.answer.figure.is_asked(), document)?;
    let planned = document.formation().dragons();
    let (dragons, texts): (Vec<_>, Vec<String>) =
        document.dragons().iter().zip(planned).map(|(named, planned)| speed_limit(args, named, planned)).unzip();
    print_report(args.answer.format.format, &Dragons { dragons }, texts.join("\n"))
}

/// The speed limit of a dragon, for JSON and as text.
fn speed_limit<'a>(
    args: &SpeedLimitArgs,
    named: &'a NamedDragon,
    planned: &Planned,
) -> (OfDragon<'a, SpeedAnswer>, String) {
    let largest = largest_speed_ratio(&planned.dragon.metered(&args.answer.work.meter()));
    let planned_speed_mps = named.config.tables().head.speed_mps;
    let name = &named.name;
    let (answer, text) = match largest {
        Ok(LargestRatio { ratio, travel_m, handle }) => {
            let (head_mps, time_s) = (args.limit / ratio, planned.timetable.time_s(travel_m));
            let verdict = if planned_speed_mps <= head_mps { "within the limit" } else { "too fast" };
            let text = format!(
                "{name}: the head may walk at {head_mps:.6} m/s, planned are {planned_speed_mps} m/s, {verdict}; handle {handle} \
                 is the fastest, {ratio:.6} times as fast as the head, at {} s",
                Fixed::<6>(time_s)
            );
            let answer = SpeedAnswer {
                head_speed_mps: Some(head_mps),
                largest_ratio: Some(ratio),
                time_s: Some(time_s),
                handle: Some(handle),
                ..SpeedAnswer::default()
            };
            (answer, text)
        }
        Err(reason @ Infeasible::TooMuchWork(_)) => {
            let answer = SpeedAnswer { undecided: Some(reason.to_string()), ..SpeedAnswer::default() };
            (answer, format!("{name}: {reason}{}", interrupt::allows_more()))
        }
        Err(reason) => {
            let answer = SpeedAnswer { infeasible: Some(reason.to_string()), ..SpeedAnswer::default() };
            (answer, format!("{name}: infeasible on all of the planned run: {reason}"))
        }
    };
    (OfDragon { dragon: name, answer: SpeedAnswer { planned_speed_mps, ..answer } }, text)
}

#[derive(Serialize)]
struct MeetingAnswer<'a> {
    /// Plan time of the first contact between two dragons; null without one.
    time_s: Option<f64>,
    dragons: Option<[&'a str; 2]>,
    benches: Option<[usize; 2]>,
    parameters: Vec<ParameterRow<'a>>,
    /// Plan time up to which there is no contact, where the search took too much work.
    searched_to_s: Option<f64>,
}

#[derive(Serialize)]
struct ParameterRow<'a> {
    dragon: &'a str,
    parameter: &'static str,
    value: f64,
    derivative: Option<f64>,
    derivative_reason: Option<String>,
}

/// Answers `solve sensitivity` for a formation: how the time of the first contact between two dragons changes.
pub(super) fn sensitivity(args: &SensitivityArgs, document: &FormationDocument) -> anyhow::Result<()> {
    refuse("--xlsx", args.xlsx.is_some(), document)?;
    refuse("--figure", args.figure.is_asked(), document)?;
    refuse("--parameter", !args.parameter.is_empty(), document)?;
    refuse("--turn-diameter", args.turn_diameter.is_some(), document)?;
    let settings: Vec<Setting> = document.dragons().iter().map(setting).collect();
    let meter: Meter = args.work.long_meter();
    let formation = document.formation().metered(&meter);
    let found = meeting_sensitivity(&formation, &settings, [document.start_s(), document.formation().end_s()]);
    let known = found.as_ref().ok().and_then(Option::as_ref);
    let members = known.map(|found| found.meeting.benches.map(|bench| document.named_bench(bench)));
    let row = |rate: &MeetingRate| ParameterRow {
        dragon: &document.dragons()[rate.dragon].name,
        parameter: rate.parameter.key(),
        value: rate.value,
        derivative: rate.derivative.ok(),
        derivative_reason: rate.derivative.err().map(|reason| reason.to_string()),
    };
    let answer = MeetingAnswer {
        time_s: known.map(|found| found.meeting.time_s),
        dragons: members.map(|members| members.map(|(name, _)| name)),
        benches: members.map(|members| members.map(|(_, bench)| bench)),
        parameters: known.iter().flat_map(|found| &found.rates).map(row).collect(),
        searched_to_s: found.as_ref().err().map(|unfinished| unfinished.reached_s),
    };
    if args.format.format == Format::Json {
        return print_json(&answer);
    }
    match (known, members, &found) {
        (Some(MeetingSensitivity { meeting, .. }), Some([(one, first), (other, second)]), _) => {
            let time_s = Fixed::<6>(meeting.time_s);
            print_line(format_args!(
                "first contact between dragons at {time_s} s: {one} bench {first} and {other} bench {second}"
            ))?;
            print_line("")?;
            print_bytes(table::text(&[rate_table(&answer)]))
        }
        (_, _, Err(unfinished)) => Ok(print_line(format_args!(
            "no contact between dragons before {} s; not searched further: {unfinished}{}",
            Fixed::<6>(unfinished.reached_s),
            interrupt::allows_more()
        ))?),
        _ => Ok(print_line("no contact between dragons, until the last one ends")?),
    }
}

/// The plan of a dragon.
fn setting(named: &NamedDragon) -> Setting {
    let config = &named.config;
    Setting {
        dimensions: *config.lead().dimensions(),
        route: config.route().clone(),
        speed_mps: config.tables().head.speed_mps,
        accel_mps2: config.tables().head.accel_mps2,
    }
}

/// How the time of the contact changes with each parameter.
fn rate_table(answer: &MeetingAnswer<'_>) -> Table {
    let numbers = ["value", "seconds per unit", "seconds per 1 %"].map(|title| Column::number(title, 6));
    let columns = [vec![Column::text("dragon"), Column::text("parameter")], numbers.to_vec(), vec![Column::text("")]];
    let mut table = Table::new("time of the first contact between dragons", columns.concat());
    for row in &answer.parameters {
        let percent = row.derivative.map(|derivative| 0.01 * row.value * derivative);
        let numbers = [Some(row.value), row.derivative, percent].map(Cell::from);
        let texts = [row.dragon, row.parameter].map(|text| Cell::from(text.to_owned()));
        let reason = row.derivative_reason.clone().unwrap_or_default();
        table.push([texts.to_vec(), numbers.to_vec(), vec![reason.into()]].concat());
    }
    table
}
