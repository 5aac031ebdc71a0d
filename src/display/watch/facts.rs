//! The figures that a show is watched for: how near benches are, have been, and when they touch.

use bench_dragon_ipc::ShowState;
use ratatui::text::{Line, Span};

use super::screen::Look;
use super::theme::{Tone, strong};
use super::wording::{millimetres, pair};
use crate::display::observe::{Arrival, GuardSituation, Outlook, Scene};

/// The clearance and its pair, the least so far, and what lies ahead.
pub(super) fn lines(scene: &Scene, look: Look) -> Vec<Line<'static>> {
    let [clearance, benches] = nearest(scene, look);
    let [least, least_when] = least(scene, look);
    let [ahead, ahead_when] = ahead(scene, look);
    vec![clearance, benches, least, least_when, ahead, ahead_when]
}

/// The same in three lines.
pub(super) fn short_lines(scene: &Scene, look: Look) -> Vec<Line<'static>> {
    let [clearance, benches] = nearest(scene, look);
    let [ahead, _] = ahead(scene, look);
    vec![clearance, benches, ahead]
}

fn named(name: &'static str, value: String, tone: Option<Tone>, look: Look) -> Line<'static> {
    let style = tone.map_or(strong(), |tone| look.theme.text(tone));
    Line::from(vec![Span::styled(format!("{name:<10}"), look.theme.faint()), Span::styled(value, style)])
}

fn detail(text: &str) -> Line<'static> {
    Line::from(format!("{:<10}{text}", ""))
}

/// How urgent a clearance is.
pub(super) fn tone(clearance_m: f64, near_m: f64) -> Option<Tone> {
    match clearance_m {
        _ if clearance_m <= 0.0 => Some(Tone::Danger),
        _ if clearance_m <= near_m => Some(Tone::Caution),
        _ => None,
    }
}

/// From here on a pair is near.
pub(super) fn near_m(scene: &Scene) -> f64 {
    scene.run.as_ref().map_or(0.0, |run| run.config.near_m())
}

fn nearest(scene: &Scene, look: Look) -> [Line<'static>; 2] {
    match scene.nearest {
        None => [named("clearance", "unknown".to_owned(), None, look), Line::default()],
        Some(nearest) => {
            let tone = tone(nearest.clearance_m, near_m(scene));
            [named("clearance", millimetres(nearest.clearance_m), tone, look), detail(&pair(nearest.benches))]
        }
    }
}

fn least(scene: &Scene, look: Look) -> [Line<'static>; 2] {
    match scene.least {
        None => [named("least", "unknown".to_owned(), None, look), Line::default()],
        Some((least_m, time_s)) => {
            let line = named("least", millimetres(least_m), tone(least_m, near_m(scene)), look);
            [line, detail(&format!("at {time_s:.3} s"))]
        }
    }
}

/// The guard's stop of a head that stands there comes before all that a forecast says.
fn ahead(scene: &Scene, look: Look) -> [Line<'static>; 2] {
    let caution = |name, value: &str| named(name, value.to_owned(), Some(Tone::Caution), look);
    match scene.guard {
        GuardSituation::AtEnd { for_good: true } => {
            return [caution("guard", "has stopped the head"), detail("for good: seek back")];
        }
        GuardSituation::AtEnd { for_good: false } => {
            return [caution("guard", "has stopped the head"), detail("until timecode moves")];
        }
        _ => {}
    }
    let counted = |at: Arrival| countdown(scene, at);
    match scene.outlook {
        Outlook::Unknown if scene.state() == Some(ShowState::Ended) => {
            [named("contact", "the run has ended".to_owned(), None, look), Line::default()]
        }
        Outlook::Unknown => [named("contact", "unknown".to_owned(), None, look), Line::default()],
        Outlook::Free { to, is_end: true } => {
            let line = named("contact", "none ahead".to_owned(), Some(Tone::Good), look);
            [line, detail(&format!("to the end, {:.2} s", to.time_s))]
        }
        Outlook::Free { to, is_end: false } => {
            [named("contact", "none yet".to_owned(), None, look), detail(&format!("searched to {:.2} s", to.time_s))]
        }
        Outlook::Contact { at, benches: [one, another] } => {
            [caution("contact", &counted(at)), detail(&format!("{one}-{another} at {:.3} s", at.time_s))]
        }
        Outlook::GuardStop { at, benches: Some([one, another]) } => {
            let line = caution("guard", &format!("stops {}", counted(at)));
            [line, detail(&format!("{one}-{another} at {:.3} s", at.time_s))]
        }
        Outlook::GuardStop { at, benches: None } if at.wall_s == 0.0 => {
            let line = named("no guard", "runs".to_owned(), Some(Tone::Danger), look);
            [line, detail("run monitor --guard")]
        }
        Outlook::GuardStop { at, benches: None } => {
            let line = named("no guard", format!("stops {}", counted(at)), Some(Tone::Danger), look);
            [line, detail(&format!("at {:.2} m, {:.1} s", at.travel_m, at.time_s))]
        }
        Outlook::Rest { at } => {
            let line = caution("stands", &format!("in {:.1} s", at.wall_s));
            [line, detail(&format!("at {:.2} m, {:.1} s", at.travel_m, at.time_s))]
        }
    }
}

/// Seconds of the clock on the wall; of a head that stands, those for which it has to walk.
fn countdown(scene: &Scene, at: Arrival) -> String {
    let walks = scene.state().is_some_and(ShowState::walks);
    if walks { format!("in {:.1} s", at.wall_s) } else { format!("{:.1} s of walk", at.wall_s) }
}
