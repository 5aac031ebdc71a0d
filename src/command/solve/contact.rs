//! `solve contact`: when do two benches first touch, or come within a clearance, and where?

use anyhow::{Context as _, ensure};
use bench_dragon_geometry::clearance::{Contact, first_within};
use bench_dragon_geometry::dragon::{RunEnd, Spent};
use serde::Serialize;

use super::caption::caption;
use super::figures;
use super::profile::Profile;
use crate::cli::{ContactArgs, Format};
use crate::command::load_config;
use crate::command::output::{print_json, print_line};
use crate::config::{Config, Overrides};

#[derive(Serialize)]
struct Answer {
    time_s: Option<f64>,
    benches: Option<[usize; 2]>,
    point_m: Option<[f64; 2]>,
    /// The clearance that was asked for, if one was.
    #[serde(skip_serializing_if = "Option::is_none")]
    clearance_m: Option<f64>,
    /// Where the search ended, if the work for it was too much.
    #[serde(skip_serializing_if = "Option::is_none")]
    searched_to_s: Option<f64>,
    #[serde(flatten)]
    profile: Option<Profile>,
}

pub(super) fn run(args: &ContactArgs) -> anyhow::Result<()> {
    let config = load_config(&args.config, Overrides::default())?;
    let dragon = config.dragon();
    let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    let clearance_m = args.clearance.unwrap_or(0.0);
    let searched = first_within(&dragon.metered(&args.work.meter()), clearance_m, start_m, end_m);
    let contact = searched.ok().flatten();
    let spent = searched.err();
    let to_m = contact.map(|contact| contact.travel_m).or(spent.map(|spent| spent.reached_m)).unwrap_or(end_m);
    let answer = Answer {
        time_s: contact.map(|contact| config.timetable().time_s(contact.travel_m)),
        benches: contact.map(|contact| contact.benches),
        point_m: contact.map(|contact| contact.point.to_array()),
        clearance_m: args.clearance,
        searched_to_s: spent.map(|spent| config.timetable().time_s(spent.reached_m)),
        profile: args.profile.then(|| Profile::of(&config, to_m, args)).transpose()?,
    };
    match args.format.format {
        Format::Json => print_json(&answer)?,
        Format::Text => {
            print_line(text(&config, clearance_m, contact.as_ref(), spent))?;
            if let Some(profile) = &answer.profile {
                print_line(profile.text().trim_end())?;
            }
        }
    }
    draw(args, &config, to_m, contact.as_ref(), answer.profile.as_ref())?;
    if args.format.format == Format::Text { figures::tell(&args.figure) } else { Ok(()) }
}

/// Draws the clearance over time where a profile was asked for, else the boards at the contact.
fn draw(
    args: &ContactArgs,
    config: &Config,
    to_m: f64,
    contact: Option<&Contact>,
    profile: Option<&Profile>,
) -> anyhow::Result<()> {
    if args.figure.figure.is_none() {
        return Ok(());
    }
    if let Some(profile) = profile {
        ensure!(profile.has_points(), "--figure has nothing to show: the dragon has no two benches but neighbours");
        ensure!(
            to_m > config.dragon().start_travel_m(),
            "--figure has nothing to show: benches touch at the start already"
        );
        let meter = args.work.meter();
        let figure = figures::clearance_over_time(&args.figure, config, &meter, to_m, contact, &profile.near_misses);
        return figures::save(figure.draw(), &args.figure);
    }
    let contact = contact.context("--figure has nothing to show: no benches touch before the run ends")?;
    let mut view = figures::contact_view(&args.figure, config, contact);
    if let Some(clearance_m) = args.clearance {
        let (time_s, [first, second]) = (config.timetable().time_s(contact.travel_m), contact.benches);
        let title = format!("First within {clearance_m} m, at {time_s:.6} s: benches {first} and {second}");
        view.caption = caption(&args.figure, config, title);
    }
    figures::save(view.draw(), &args.figure)
}

fn text(config: &Config, clearance_m: f64, contact: Option<&Contact>, spent: Option<Spent>) -> String {
    let what = if clearance_m == 0.0 { "contact".to_owned() } else { format!("clearance of {clearance_m} m") };
    if let Some(&Contact { travel_m, benches: [first, second], point }) = contact {
        let time_s = config.timetable().time_s(travel_m);
        return format!(
            "first {what} at {time_s:.6} s, benches {first} and {second}, at ({:.6}, {:.6}) m",
            point.x, point.y
        );
    }
    if let Some(spent) = spent {
        let reached_s = config.timetable().time_s(spent.reached_m);
        return format!("no {what} up to {reached_s:.6} s; further on it is not known: {spent}, --work allows more");
    }
    let end_s = config.end_s();
    match config.dragon().run_end() {
        RunEnd::RouteEnd => format!("no {what} before the run ends, at {end_s:.6} s"),
        fault => format!("no {what} before the run ends, at {end_s:.6} s, where {fault}"),
    }
}
