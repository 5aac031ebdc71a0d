//! The caption of a figure: what the user calls it, what it shows, and for which dragon.

use bench_dragon_geometry::dragon::Dimensions;
use bench_dragon_geometry::route::RouteSpec;

use crate::cli::FigureArgs;
use crate::config::Config;
use crate::output::Counted;
use crate::output::figure::Caption;

/// The caption of a figure with this title, for the configured dragon.
pub(super) fn caption(args: &FigureArgs, config: &Config, title: impl Into<String>) -> Caption {
    caption_at_speed(args, config, config.head_speed_mps(), title)
}

/// The same for a head of another speed, in m/s.
pub(super) fn caption_at_speed(
    args: &FigureArgs,
    config: &Config,
    speed_mps: f64,
    title: impl Into<String>,
) -> Caption {
    let mut facts = dragon_facts(config.dragon().dimensions());
    facts.push(route_fact(config.route()));
    facts.push(speed_fact(speed_mps, config.head_accel_mps2()));
    Caption { heading: args.title.clone(), title: title.into(), facts }
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

fn route_fact(route: RouteSpec) -> String {
    match route {
        RouteSpec::Spiral(plan) => format!("spiral, pitch {} m", rounded(plan.pitch_m)),
        RouteSpec::Turnaround(plan) => {
            let [pitch_m, diameter_m, ratio] = [plan.pitch_m, plan.turn_diameter_m, plan.radius_ratio].map(rounded);
            format!("turnaround, pitch {pitch_m} m, turning circle {diameter_m} m, radius ratio {ratio}")
        }
    }
}

fn speed_fact(speed_mps: f64, accel_mps2: Option<f64>) -> String {
    match accel_mps2 {
        Some(accel_mps2) => format!("head {} m/s, {} m/s²", rounded(speed_mps), rounded(accel_mps2)),
        None => format!("head {} m/s", rounded(speed_mps)),
    }
}

/// A number to six decimals, without zeros at its end.
fn rounded(value: f64) -> String {
    let text = format!("{value:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_no_more_digits_than_they_need() {
        assert_eq!([0.450_337_37, 1.0, 300.0, 0.275].map(rounded), ["0.450337", "1", "300", "0.275"]);
    }

    #[test]
    fn facts_are_those_of_the_configuration() {
        let text = "[dragon]\nbenches = 1\nwidth_m = 0.25\n[head]\nspeed_mps = 1.5\naccel_mps2 = 0.5\n";
        let config = Config::from_toml(text).expect("valid");
        let facts = dragon_facts(config.dragon().dimensions());
        assert_eq!(facts, ["1 bench", "head 3.41 m, others 2.2 m", "0.25 m wide", "holes at 0.275 m"]);
        assert_eq!(route_fact(config.route()), "spiral, pitch 0.55 m");
        assert_eq!(speed_fact(config.head_speed_mps(), config.head_accel_mps2()), "head 1.5 m/s, 0.5 m/s²");
    }
}
