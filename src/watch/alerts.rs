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
    let newest = scene.alerts.latest().rev().map(|numbered| line(&numbered.alert, look));
    std::iter::once(Line::styled(title, look.theme.faint())).chain(newest).take(count).collect()
}

/// The newest alert alone.
pub(super) fn newest(scene: &Scene, look: Look) -> Option<Line<'static>> {
    scene.alerts.latest().next_back().map(|numbered| line(&numbered.alert, look))
}

fn line(alert: &Alert, look: Look) -> Line<'static> {
    let kind = alert.alert_kind();
    let name = kind.map_or("unknown", AlertKind::name);
    let tone = match kind {
        Some(AlertKind::Contact | AlertKind::Held | AlertKind::Fault) => Tone::Danger,
        Some(AlertKind::Near) | None => Tone::Caution,
        Some(AlertKind::Parted | AlertKind::Restarted) => Tone::Calm,
    };
    let benches = alert.pair().map_or_else(String::new, |[one, another]| format!(" {one}-{another}"));
    Line::from(vec![
        Span::raw(format!("{:>9.3} ", alert.sim_time_ns as f64 * 1e-9)),
        Span::styled(format!("{name:<9}"), look.theme.text(tone)),
        Span::raw(benches),
    ])
}
