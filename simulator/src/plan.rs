//! The plan of a scenario as text: dragons on their routes, the settings of the show, and cues.

#![allow(clippy::format_push_string, reason = "the texts are short")]

use bench_dragon::config::{Config, PlanDocument};

use crate::dice::Dice;

/// Steps for finding the end of a dragon's run.
const PLACING_STEPS: u64 = 20_000_000;
/// Attempts at other dragons, and at cues, that fit the plan.
const ATTEMPTS: usize = 40;
/// Least length of a course, in metres.
const LEAST_COURSE_M: f64 = 1.0;

/// Builds a configuration; `None` where dragons do not fit on their routes, stand in each other, or hardly walk.
fn build(toml: &str) -> Option<Config> {
    let config = PlanDocument::from_toml_within(toml, PLACING_STEPS).and_then(PlanDocument::build).ok()?;
    let begin_m = config.course_m(config.start_s());
    (config.require_start().is_ok() && config.formation().end_m() > begin_m + LEAST_COURSE_M).then_some(config)
}

/// Draws a show of one small dragon, without cues.
pub(crate) fn draw_plain(dice: &mut Dice, has_timecode: bool) -> (String, Config) {
    loop {
        let toml = document(dice, has_timecode);
        // Some random dragons do not fit on their random routes.
        if let Some(config) = build(&toml) {
            return (toml, config);
        }
    }
}

/// Draws other dragons and cues for a plan of some seeds; `None` where it stays as it is. `may_wait`: whether a cue may wait, which
/// a timecode does not allow.
pub(crate) fn draw_more(dice: &mut Dice, plain: &(String, Config), may_wait: bool) -> Option<(String, Config)> {
    let (has_others, has_cues) = (dice.chance(0.3), dice.chance(0.4));
    let several = if has_others { (0..ATTEMPTS).find_map(|_| built(with_others(dice, &plain.0))) } else { None };
    let cued = if has_cues {
        let (toml, config) = several.as_ref().unwrap_or(plain);
        (0..ATTEMPTS).find_map(|attempt| built(toml.clone() + &cues(dice, config, may_wait, attempt)))
    } else {
        None
    };
    // The description on the bus has the plan times of cues.
    cued.or(several).map(|(_, config)| (config.to_toml(), config))
}

fn built(toml: String) -> Option<(String, Config)> {
    build(&toml).map(|config| (toml, config))
}

/// A random configuration as text: a small dragon on a spiral, a turnaround or a path.
fn document(dice: &mut Dice, has_timecode: bool) -> String {
    let mut text = dragon(dice);
    text += &head(dice);
    let rate_hz = dice.one_of(&[1, 2, 3, 5, 7, 10, 10, 20, 25, 50, 60, 100]);
    let time_scale = if has_timecode { 1.0 } else { dice.one_of(&[1.0, 1.0, 1.0, 0.5, 3.0, 10.0]) };
    let catch_up_s = dice.one_of(&[0.25, 0.25, 0.0, 1.0, 2.0]);
    text += &format!("[serve]\nrate_hz = {rate_hz}\ntime_scale = {time_scale:?}\ncatch_up_s = {catch_up_s:?}\n");
    let guard = dice.chance(0.75);
    let (margin_m, near_m) = (dice.scaled(0.0005, 0.1), dice.within(0.01, 0.2));
    text += &format!("[monitor]\nguard = {guard}\nmargin_m = {margin_m}\nnear_m = {near_m}\n");
    text + &route(dice)
}

fn dragon(dice: &mut Dice) -> String {
    let width_m = dice.within(0.05, 0.5);
    let offset_m = dice.within(0.02, 0.3);
    let body_m = 2.0 * offset_m + dice.within(0.4, 1.8);
    let head_m = body_m + dice.within(0.0, 1.2);
    let benches = 1 + dice.below(14);
    format!(
        "[dragon]\nbenches = {benches}\nhead_length_m = {head_m}\nbody_length_m = {body_m}\nwidth_m = {width_m}\nhole_offset_m = {offset_m}\n"
    )
}

fn head(dice: &mut Dice) -> String {
    let speed_mps = dice.scaled(0.05, 2.0);
    let text = format!("[head]\nspeed_mps = {speed_mps}\n");
    if dice.chance(0.5) { text + &format!("accel_mps2 = {}\n", dice.scaled(0.05, 3.0)) } else { text }
}

fn route(dice: &mut Dice) -> String {
    match dice.below(6) {
        0 | 1 => {
            let (pitch_m, turns) = (dice.within(0.3, 1.5), dice.within(2.0, 6.0));
            format!("[route]\nkind = \"spiral\"\npitch_m = {pitch_m}\nstart_turns = {turns}\n")
        }
        2 => {
            let (pitch_m, diameter_m) = (dice.within(0.8, 2.0), dice.within(3.0, 9.0));
            format!("[route]\nkind = \"turnaround\"\npitch_m = {pitch_m}\nturn_diameter_m = {diameter_m}\n")
        }
        3 => {
            let (side_m, radius_m, laps) = (dice.within(1.0, 8.0), dice.within(0.8, 4.0), 1 + dice.below(4));
            let side = format!("[[route.segments]]\nkind = \"line\"\nlength_m = {side_m}\n");
            let bend = format!("[[route.segments]]\nkind = \"arc\"\nradius_m = {radius_m}\nturn_deg = 180\n");
            format!("[route]\nkind = \"path\"\nclosed = true\nlaps = {laps}\n{side}{bend}{side}{bend}")
        }
        _ => {
            let segments: String = (0..2 + dice.below(8)).map(|_| segment(dice)).collect();
            format!("[route]\nkind = \"path\"\n{segments}")
        }
    }
}

fn segment(dice: &mut Dice) -> String {
    let sign = dice.one_of(&[1.0, -1.0]);
    match dice.below(3) {
        0 => format!("[[route.segments]]\nkind = \"line\"\nlength_m = {}\n", dice.within(0.5, 12.0)),
        1 => {
            let (radius_m, turn_deg) = (dice.within(0.8, 5.0), sign * dice.within(20.0, 400.0));
            format!("[[route.segments]]\nkind = \"arc\"\nradius_m = {radius_m}\nturn_deg = {turn_deg}\n")
        }
        _ => {
            let (from_m, to_m, turn_deg) =
                (dice.within(1.0, 4.0), dice.within(1.0, 4.0), sign * dice.within(60.0, 700.0));
            format!(
                "[[route.segments]]\nkind = \"spiral\"\nstart_radius_m = {from_m}\nend_radius_m = {to_m}\nturn_deg = {turn_deg}\n"
            )
        }
    }
}

/// The plan of one dragon with one to three others. Most routes are near each other, so that some dragons meet.
fn with_others(dice: &mut Dice, plain: &str) -> String {
    let mut text = of_several(plain, "[[dragons]]\nname = \"lead\"\n", "", "");
    for number in 1..=1 + dice.below(3) {
        let name = format!("[[dragons]]\nname = \"other-{number}\"\n");
        let start_s = if dice.chance(0.5) { 0.0 } else { dice.within(0.0, 40.0) };
        let farthest_m = dice.one_of(&[6.0, 12.0, 12.0, 100.0]);
        let [x_m, y_m] = [(); 2].map(|()| dice.within(-farthest_m, farthest_m));
        let place =
            format!("start_x_m = {x_m}\nstart_y_m = {y_m}\nstart_heading_deg = {}\n", dice.within(-180.0, 180.0));
        let one = dragon(dice) + &head(dice) + &route(dice);
        text += &of_several(&one, &name, &format!("start_s = {start_s:?}\n"), &place);
    }
    text
}

/// The tables of one dragon as those of one of several.
fn of_several(text: &str, name: &str, head: &str, route: &str) -> String {
    text.replace("[dragon]\n", name)
        .replace("[head]\n", &format!("[dragons.head]\n{head}"))
        .replace("[route]\n", &format!("[dragons.route]\n{route}"))
        .replace("[[route.segments]]", "[[dragons.route.segments]]")
}

/// Up to six cues. A speed that no ramp reaches is not valid, so later attempts have fewer cues.
fn cues(dice: &mut Dice, config: &Config, may_wait: bool, attempt: usize) -> String {
    let count = 1 + dice.below((6 - attempt / 8).max(1));
    let [begin_s, end_s] = [config.start_s(), config.last_seek_s()];
    let mut times_s: Vec<f64> = (0..count).map(|_| dice.within(begin_s, end_s)).collect();
    times_s.sort_by(f64::total_cmp);
    if dice.chance(0.2) {
        times_s[0] = begin_s;
    }
    let mut text = String::new();
    for (number, at_s) in times_s.into_iter().enumerate() {
        text += &format!("[[cues]]\nname = \"cue {number}\"\nat_s = {at_s:?}\n");
        if may_wait && dice.chance(0.5) {
            text += "wait = true\n";
        }
        if dice.chance(0.5) {
            let planned_mps = config.tables().head.speed_mps;
            text += &format!("speed_mps = {}\n", (planned_mps * dice.scaled(0.3, 2.5)).clamp(0.01, 5.0));
            let dragons = config.formation().dragons().len();
            let dragon = dice.below(dragons);
            if dragons > 1 && dice.chance(0.6) {
                let name = if dragon == 0 { "lead".to_owned() } else { format!("other-{dragon}") };
                text += &format!("dragon = \"{name}\"\n");
            }
        }
    }
    text
}
