//! How the frames come: rate, losses, latency, and how the server keeps its schedule.

use ratatui::text::{Line, Span};

use super::screen::Look;
use super::theme::{Tone, strong};
use super::wording::span;
use crate::observe::Scene;

/// Six lines of it.
pub(super) fn lines(scene: &Scene, look: Look) -> Vec<Line<'static>> {
    let traffic = &scene.traffic;
    let overruns = scene.status.as_ref().map(|status| status.overruns);
    let latency = [0.5, 0.99, 1.0].map(|share| traffic.recent_latency.quantile_ns(share));
    let lateness = scene.status.as_ref().map(|it| [it.lateness_p50_ns, it.lateness_p99_ns, it.lateness_max_ns]);
    vec![
        Line::from(vec![
            Span::styled(format!("{:<10}", "frames"), look.theme.faint()),
            Span::styled(format!("{:.1} Hz", traffic.rate_hz), strong()),
        ]),
        counts([("lost", Some(traffic.lost)), ("restarts", Some(traffic.restarts))], look),
        counts([("overruns", overruns), ("", None)], look),
        Line::styled(format!("{:10}{:>6} {:>6} {:>6}", "", "p50", "p99", "max"), look.theme.faint()),
        row("latency", (traffic.recent_latency.count() > 0).then_some(latency), look),
        row("lateness", lateness, look),
    ]
}

/// Counts of what should not happen.
fn counts(counts: [(&'static str, Option<u64>); 2], look: Look) -> Line<'static> {
    let mut spans = Vec::new();
    for (name, count) in counts {
        let Some(count) = count else { continue };
        let style = if count > 0 { look.theme.text(Tone::Caution) } else { strong() };
        spans.push(Span::styled(format!("{name:<10}"), look.theme.faint()));
        spans.push(Span::styled(format!("{count:<6}"), style));
    }
    Line::from(spans)
}

fn row(name: &'static str, times_ns: Option<[u64; 3]>, look: Look) -> Line<'static> {
    let mut spans = vec![Span::styled(format!("{name:<10}"), look.theme.faint())];
    for time_ns in times_ns.into_iter().flatten() {
        spans.push(Span::raw(format!("{:>6} ", span(time_ns, look.glyphs).replace(' ', ""))));
    }
    Line::from(spans)
}
