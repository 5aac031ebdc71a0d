//! `solve contact`: when do two benches first touch, and where?

use bench_dragon::config::{Config, Overrides};
use bench_dragon::dragon::{Contact, first_contact};
use serde::Serialize;

use super::profile::Profile;
use crate::cli::{ContactArgs, Format};
use crate::command::load_config;
use crate::command::output::{print_json, print_line};

#[derive(Serialize)]
struct Answer {
    time_s: Option<f64>,
    benches: Option<[usize; 2]>,
    point_m: Option<[f64; 2]>,
    #[serde(flatten)]
    profile: Option<Profile>,
}

pub(super) fn run(args: &ContactArgs) -> anyhow::Result<()> {
    let config = load_config(&args.config, Overrides::default())?;
    let dragon = config.dragon();
    let contact = first_contact(dragon, dragon.start_travel_m(), dragon.end_travel_m());
    let answer = Answer {
        time_s: contact.map(|contact| contact.travel_m / config.head_speed_mps()),
        benches: contact.map(|contact| contact.benches),
        point_m: contact.map(|contact| contact.point.to_array()),
        profile: args.profile.then(|| Profile::of(&config, contact.as_ref(), args)).transpose()?,
    };
    match args.format.format {
        Format::Json => print_json(&answer),
        Format::Text => {
            if let Some(profile) = &answer.profile {
                print_line(profile.text())?;
            }
            Ok(print_line(text(&config, contact.as_ref()))?)
        }
    }
}

fn text(config: &Config, contact: Option<&Contact>) -> String {
    let Some(&Contact { travel_m, benches: [first, second], point }) = contact else {
        return format!("no contact before the run ends, at {:.6} s", config.end_s());
    };
    let time_s = travel_m / config.head_speed_mps();
    format!("first contact at {time_s:.6} s, benches {first} and {second}, at ({:.6}, {:.6}) m", point.x, point.y)
}
