//! What the monitor has seen, newest first.

use bench_dragon_ipc::{Alert, AlertKind};
use ratatui::text::{Line, Span};

use super::screen::Look;
use super::theme::Tone;
use crate::observe::Scene;

/// A title and as many alerts as there are lines.
pub(super) fn lines(scene: &Scene, look: Look, count: usize) -> Vec<Line<'static>> {
    let total = scene.alerts.total();
    let title = match total {
        0 => "no alerts".to_owned(),
        1 => "1 alert".to_owned(),
        _ => format!("{total} alerts"),
    };
    let (mut lines, mut is_past) = (vec![Line::styled(title, look.theme.faint())], false);
    for numbered in scene.alerts.latest().rev().take(count) {
        if !is_past && is_of_another_run(&numbered.alert, scene) {
            is_past = true;
            lines.push(Line::styled("earlier runs", look.theme.faint()));
        }
        lines.push(line(&numbered.alert, scene, look));
    }
    lines.truncate(count);
    lines
}

/// The newest alert alone.
pub(super) fn newest(scene: &Scene, look: Look) -> Option<Line<'static>> {
    let alert = scene.alerts.latest().next_back()?.alert;
    let mut line = line(&alert, scene, look);
    if is_of_another_run(&alert, scene) {
        line.push_span(Span::styled("  earlier run", look.theme.faint()));
    }
    Some(line)
}

/// Whether it is not of the run whose frame is shown.
fn is_of_another_run(alert: &Alert, scene: &Scene) -> bool {
    scene.frame.as_ref().is_some_and(|still| still.header.run_id != alert.run_id)
}

fn line(alert: &Alert, scene: &Scene, look: Look) -> Line<'static> {
    let kind = alert.alert_kind();
    let name = kind.map_or("unknown", AlertKind::name);
    let tone = match kind {
        Some(AlertKind::Contact | AlertKind::Held | AlertKind::Fault) => Tone::Danger,
        Some(AlertKind::Near) | None => Tone::Caution,
        Some(AlertKind::Parted | AlertKind::Restarted) => Tone::Calm,
    };
    let benches = alert.pair().map_or_else(String::new, |[one, another]| format!(" {one}-{another}"));
    // Of an earlier run nothing is urgent any more.
    let style = if is_of_another_run(alert, scene) { look.theme.faint() } else { look.theme.text(tone) };
    let line = Line::from(vec![
        Span::raw(format!("{:>9.3} ", alert.sim_time_ns as f64 * 1e-9)),
        Span::styled(format!("{name:<9}"), style),
        Span::raw(benches),
    ]);
    if is_of_another_run(alert, scene) { line.style(look.theme.faint()) } else { line }
}
