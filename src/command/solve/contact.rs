//! `solve contact`: when do two benches first touch, and where?

use anyhow::Context as _;
use bench_dragon::config::Overrides;
use bench_dragon::dragon::first_contact;
use serde::Serialize;

use super::figures;
use crate::cli::{ContactArgs, Format};
use crate::command::load_config;
use crate::command::output::{print_json, print_line};

#[derive(Serialize)]
struct Answer {
    time_s: Option<f64>,
    benches: Option<[usize; 2]>,
    point_m: Option<[f64; 2]>,
}

pub(super) fn run(args: &ContactArgs) -> anyhow::Result<()> {
    let config = load_config(&args.config, Overrides::default())?;
    let dragon = config.dragon();
    let contact = first_contact(dragon, dragon.start_travel_m(), dragon.end_travel_m());
    if let Some(file) = &args.figure.figure {
        let contact = contact.context("--figure has nothing to show: no benches touch before the run ends")?;
        figures::save(&figures::contact_view(&config, &contact).draw(), file)?;
    }
    let time_s = contact.map(|contact| contact.travel_m / config.head_speed_mps());
    if args.format.format == Format::Json {
        return print_json(&Answer {
            time_s,
            benches: contact.map(|contact| contact.benches),
            point_m: contact.map(|contact| contact.point.to_array()),
        });
    }
    match (contact, time_s) {
        (Some(contact), Some(time_s)) => {
            let [a, b] = contact.benches;
            let point = contact.point;
            print_line(format_args!(
                "first contact at {time_s:.6} s, benches {a} and {b}, at ({:.6}, {:.6}) m",
                point.x, point.y
            ))?;
        }
        _ => print_line(format_args!("no contact before the run ends, at {:.6} s", config.end_s()))?,
    }
    if let Some(file) = &args.figure.figure {
        print_line(format_args!("drawn to {}", file.path.display()))?;
    }
    Ok(())
}
