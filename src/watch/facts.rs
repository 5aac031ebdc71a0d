//! The figures that a show is watched for: how near benches are, have been, and when they touch.

use ratatui::text::{Line, Span};

use super::screen::Look;
use super::theme::{Tone, strong};
use super::wording::{metres, pair};
use crate::observe::{Outlook, Scene};

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
            [named("clearance", metres(nearest.clearance_m), tone, look), detail(&pair(nearest.benches))]
        }
    }
}

fn least(scene: &Scene, look: Look) -> [Line<'static>; 2] {
    match scene.least {
        None => [named("least", "unknown".to_owned(), None, look), Line::default()],
        Some((least_m, time_s)) => {
            let line = named("least", metres(least_m), tone(least_m, near_m(scene)), look);
            [line, detail(&format!("at {time_s:.3} s"))]
        }
    }
}

fn ahead(scene: &Scene, look: Look) -> [Line<'static>; 2] {
    match scene.outlook {
        Outlook::Unknown => [named("contact", "unknown".to_owned(), None, look), Line::default()],
        Outlook::Free { to, is_end: true } => {
            let line = named("contact", "none ahead".to_owned(), Some(Tone::Good), look);
            [line, detail(&format!("to the end, {:.2} s", to.time_s))]
        }
        Outlook::Free { to, is_end: false } => {
            [named("contact", "none yet".to_owned(), None, look), detail(&format!("searched to {:.2} s", to.time_s))]
        }
        Outlook::Contact { at, benches: [one, another] } => {
            let line = named("contact", format!("at {:.3} s", at.time_s), Some(Tone::Caution), look);
            [line, detail(&format!("in {:.1} s, {one} and {another}", at.wall_s))]
        }
        Outlook::GuardStop { at, .. } => {
            let line = named("guard", format!("stops at {:.3} s", at.time_s), Some(Tone::Caution), look);
            [line, detail(&format!("in {:.1} s", at.wall_s))]
        }
        Outlook::Rest { at } => {
            let line = named("stops", format!("at {:.3} s", at.time_s), Some(Tone::Caution), look);
            [line, detail(&format!("in {:.1} s, after {:.3} m", at.wall_s, at.travel_m))]
        }
    }
}
