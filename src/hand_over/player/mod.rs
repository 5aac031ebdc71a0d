//! `show.html`: one file that plays the show in a browser, without a network.
//!
//! It has key frames of all handles over the travel of each head, and the timetable in pieces of constant acceleration. So it is exact in
//! time, and between two key frames it follows a cubic. The largest distance of that cubic from the exact places is measured and stated.

use bench_dragon_geometry::dragon::{ChainSolver, Dragon};
use bench_dragon_geometry::formation::Planned;
use data_encoding::BASE64;
use glam::DVec2;
use maud::{DOCTYPE, PreEscaped, html};
use serde::Serialize;

use super::{HandOver, Moment};
use crate::output::figure::StageInPlan;
use crate::output::in_plan::{polyline, stage_in_plan};

/// Greatest number of coordinates in the file. Each takes 4 bytes, and 5.4 letters of the file.
const MOST_NUMBERS: f64 = 1_500_000.0;
/// Shortest and longest travel from one key frame to the next, in metres. Beyond the longest, boards would leave their places visibly.
const STEP_M: [f64; 2] = [0.05, 0.5];
/// A browser loads nothing for this page.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'";

#[derive(Serialize)]
struct Data {
    begin: f64,
    end: f64,
    stage: Lines,
    cues: Vec<CueData>,
    contact: Option<ContactData>,
    dragons: Vec<DragonData>,
}

#[derive(Serialize)]
struct Lines {
    outline: Vec<[f64; 2]>,
    keep_out: Vec<Vec<[f64; 2]>>,
    crowd: Vec<[f64; 2]>,
}

#[derive(Serialize)]
struct CueData {
    at: f64,
    name: String,
    note: String,
    waits: bool,
}

#[derive(Serialize)]
struct ContactData {
    at: f64,
    /// The two benches: the number of its dragon and its index.
    benches: [(usize, usize); 2],
}

#[derive(Serialize)]
struct DragonData {
    name: String,
    colour: String,
    handles: usize,
    width: f64,
    /// Distance of a hinge from the end of its board.
    hole: f64,
    route: Vec<[f64; 2]>,
    /// The timetable: beginning in seconds and metres, speed and acceleration of each piece.
    pieces: Vec<[f64; 4]>,
    /// Travel of the first key frame, and from one to the next.
    first: f64,
    step: f64,
    /// The key frames: x and y of all handles, as 32-bit numbers in base64.
    frames: String,
}

/// The key frames of a dragon.
struct KeyFrames {
    first_m: f64,
    step_m: f64,
    places: Vec<f32>,
    error_m: f64,
}

/// The page, in one file. An error is the reason for which it would be too large.
pub(super) fn html(show: &HandOver<'_>) -> Result<String, String> {
    let planned = show.config.formation().dragons();
    let numbers_per_m = |planned: &Planned| 2.0 * planned.dragon.dimensions().handles() as f64;
    let span_m = |dragon: &Dragon| dragon.end_travel_m() - dragon.start_travel_m();
    let all: f64 = planned.iter().map(|planned| numbers_per_m(planned) * span_m(&planned.dragon)).sum();
    let step_m = (all / MOST_NUMBERS).max(STEP_M[0]);
    if step_m > STEP_M[1] {
        return Err(format!("it would need a key frame every {} m to be small enough to open", STEP_M[1]));
    }
    let names = show.names();
    let mut error_m = 0.0_f64;
    let mut dragons = Vec::new();
    for ((planned, name), [red, green, blue]) in planned.iter().zip(names).zip(show.colours()) {
        let frames = KeyFrames::of(&planned.dragon, step_m);
        error_m = error_m.max(frames.error_m);
        let dimensions = planned.dragon.dimensions();
        let route = planned.dragon.route();
        let whole = polyline(route, route.start_travel_m() - dimensions.links_m(), route.end_travel_m());
        dragons.push(DragonData {
            name: name.into_owned(),
            colour: format!("#{red:02x}{green:02x}{blue:02x}"),
            handles: dimensions.handles(),
            width: dimensions.width_m(),
            hole: dimensions.hole_offset_m(),
            route: pairs(&whole),
            pieces: planned.timetable.pieces(),
            first: frames.first_m,
            step: frames.step_m,
            frames: BASE64.encode(&frames.places.iter().flat_map(|place| place.to_le_bytes()).collect::<Vec<u8>>()),
        });
    }
    let StageInPlan { outline, keep_out, crowd } = stage_in_plan(show.config.stage());
    let keep_out = keep_out.iter().map(|area| pairs(area)).collect();
    let data = Data {
        begin: show.config.start_s(),
        end: show.config.formation().end_s().max(show.config.end_s()),
        stage: Lines { outline: pairs(&outline), keep_out, crowd: pairs(&crowd) },
        cues: show.moments.iter().filter_map(cue).collect(),
        contact: show.contact().map(|contact| ContactData { at: contact.time_s, benches: contact.places }),
        dragons,
    };
    Ok(page(show, &data, error_m))
}

fn cue(moment: &Moment) -> Option<CueData> {
    let (note, waits) = moment.cue.clone()?;
    Some(CueData { at: moment.time_s, name: moment.name.clone(), note, waits })
}

fn pairs(points: &[DVec2]) -> Vec<[f64; 2]> {
    // Tenths of a millimetre: a screen shows no less.
    let short = |metres: f64| (metres * 1e4).round() / 1e4;
    points.iter().map(|point| [short(point.x), short(point.y)]).collect()
}

impl KeyFrames {
    fn of(dragon: &Dragon, longest_m: f64) -> Self {
        let (first_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
        let intervals = ((end_m - first_m) / longest_m).ceil().max(1.0);
        let step_m = (end_m - first_m) / intervals;
        let mut solver = ChainSolver::new(dragon);
        let mut at = |place: f64| -> Vec<f64> {
            let travel_m = (first_m + place * step_m).min(end_m);
            let handles = solver.solve(dragon, travel_m).expect("the travel is in the run").iter();
            handles.flat_map(|handle| handle.position.to_array()).collect()
        };
        let count = intervals as usize + 1;
        let frames: Vec<Vec<f32>> =
            (0..count).map(|frame| at(frame as f64).into_iter().map(|number| number as f32).collect()).collect();
        let mut error_m = 0.0_f64;
        for interval in 0..count - 1 {
            let exact = at(interval as f64 + 0.5);
            let drawn = halfway(&frames, interval);
            let distances = exact
                .chunks(2)
                .zip(drawn.chunks(2))
                .map(|(exact, drawn)| (exact[0] - drawn[0]).hypot(exact[1] - drawn[1]));
            error_m = distances.fold(error_m, f64::max);
        }
        Self { first_m, step_m, places: frames.concat(), error_m }
    }
}

/// What the page draws in the middle of an interval, as its script does it.
fn halfway(frames: &[Vec<f32>], interval: usize) -> Vec<f64> {
    let last = frames.len() - 1;
    let [before, from, to, after] =
        [interval.saturating_sub(1), interval, interval + 1, (interval + 2).min(last)].map(|at| &frames[at]);
    let (has_before, has_after) = (interval > 0, interval + 2 <= last);
    let number = |at: usize| {
        let [before, from, to, after] = [before, from, to, after].map(|frame| f64::from(frame[at]));
        let rise = to - from;
        let [leaving, arriving] = [0.5 * (to - before), 0.5 * (after - from)];
        let [leaving, arriving] = match (has_before, has_after) {
            (true, true) => [leaving, arriving],
            // At an end, the curve is the parabola through three key frames.
            (false, true) => [2.0 * rise - arriving, arriving],
            (true, false) => [leaving, 2.0 * rise - leaving],
            (false, false) => [rise, rise],
        };
        0.5 * (from + to) + 0.125 * (leaving - arriving)
    };
    (0..from.len()).map(number).collect()
}

fn page(show: &HandOver<'_>, data: &Data, error_m: f64) -> String {
    // A `<` could end the element of the data.
    let data = serde_json::to_string(data).expect("the data is plain").replace('<', "\\u003c");
    let millimetres = (error_m * 1e3 * 10.0).ceil() / 10.0;
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (show.title) }
                style { (PreEscaped(include_str!("page.css"))) }
            }
            body {
                header {
                    h1 { (show.title) }
                    p { "Handles are within " (millimetres) " mm of their exact places." }
                    p #contact.contact role="status" hidden { "✕ " @if let Some(contact) = show.contact() { (contact.words()) } }
                    @if show.searched_to_s().is_some() { p { (show.attention().unwrap_or_default()) } }
                }
                main {
                    canvas #plan role="img" aria-label="Plan of the show" {}
                    aside tabindex="0" aria-label="Dragons and cues" {
                        h2 { "Dragons" }
                        ul #dragons {}
                        div #cues-part { h2 { "Cues" } ul #cues {} }
                    }
                }
                footer {
                    button #play type="button" { "Play" }
                    input #seek type="range" step="any" aria-label="Show time";
                    span #time {}
                    label { "Speed " select #speed {
                        @for speed in ["0.5", "1", "2", "5", "10", "20", "50"] {
                            option value=(speed) selected[speed == "1"] { (speed) "×" }
                        }
                    } }
                    button #nearer type="button" aria-label="Zoom in" { "+" }
                    button #further type="button" aria-label="Zoom out" { "−" }
                    button #fit type="button" { "Whole plan" }
                }
                script #show type="application/json" { (PreEscaped(data)) }
                script { (PreEscaped(include_str!("page.js"))) }
            }
        }
    }
    .into_string()
}
