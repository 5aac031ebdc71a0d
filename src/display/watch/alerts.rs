//! What the monitor has seen, newest first.

use bench_dragon_ipc::{Alert, AlertKind};
use ratatui::text::{Line, Span};

use super::alert_filter::AlertFilter;
use super::screen::Look;
use super::theme::Tone;
use crate::display::observe::Scene;

/// A title and as many of the filter's alerts as there are lines.
pub(super) fn lines(scene: &Scene, look: Look, filter: AlertFilter, count: usize) -> Vec<Line<'static>> {
    let total = scene.alerts.total();
    let title = match total {
        0 => format!("no alerts{}", filter.words()),
        1 => format!("1 alert{}", filter.words()),
        _ => format!("{total} alerts{}", filter.words()),
    };
    let (mut lines, mut is_past) = (vec![Line::styled(title, look.theme.faint())], false);
    let listed = scene.alerts.latest().rev().filter(|numbered| filter.takes(&numbered.alert));
    for numbered in listed.take(count) {
        if !is_past && is_of_another_run(&numbered.alert, scene) {
            is_past = true;
            lines.push(Line::styled("earlier runs", look.theme.faint()));
        }
        lines.push(line(&numbered.alert, scene, look));
    }
    lines.truncate(count);
    lines
}

/// The newest of the filter's alerts alone.
pub(super) fn newest(scene: &Scene, look: Look, filter: AlertFilter) -> Option<Line<'static>> {
    let alert = scene.alerts.latest().rev().find(|numbered| filter.takes(&numbered.alert))?.alert;
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
