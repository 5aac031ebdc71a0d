//! How the frames come: rate, losses, latency, and how the server keeps its schedule.

use ratatui::text::{Line, Span};

use super::screen::Look;
use super::theme::{Tone, strong};
use super::wording::span;
use crate::display::observe::Scene;

/// Six lines of it.
pub(super) fn lines(scene: &Scene, look: Look) -> Vec<Line<'static>> {
    let traffic = &scene.traffic;
    let (overruns, behind_ns) = scene.status.as_ref().map(|status| (status.overruns, status.behind_ns)).unzip();
    let count = |count: Option<u64>| count.map(|count| (count.to_string(), count > 0));
    let behind = behind_ns.map(|behind_ns| (span(behind_ns, look.glyphs).replace(' ', ""), behind_ns > 0));
    let latency = [0.5, 0.99, 1.0].map(|share| traffic.recent_latency.quantile_ns(share));
    let lateness = scene.status.as_ref().map(|it| [it.lateness_p50_ns, it.lateness_p99_ns, it.lateness_max_ns]);
    vec![
        Line::from(vec![
            Span::styled(format!("{:<10}", "frames"), look.theme.faint()),
            Span::styled(format!("{:.1} Hz", traffic.rate_hz), strong()),
        ]),
        troubles([("lost", count(Some(traffic.lost))), ("restarts", count(Some(traffic.restarts)))], look),
        troubles([("overruns", count(overruns)), ("behind", behind)], look),
        Line::styled(format!("{:10}{:>6} {:>6} {:>6}", "", "p50", "p99", "max"), look.theme.faint()),
        row("latency", (traffic.recent_latency.count() > 0).then_some(latency), look),
        row("lateness", lateness, look),
    ]
}

/// Figures that should be 0, each with whether it is not.
fn troubles(troubles: [(&'static str, Option<(String, bool)>); 2], look: Look) -> Line<'static> {
    let mut spans = Vec::new();
    for (name, trouble) in troubles {
        let Some((figure, is_bad)) = trouble else { continue };
        let style = if is_bad { look.theme.text(Tone::Caution) } else { strong() };
        spans.push(Span::styled(format!("{name:<10}"), look.theme.faint()));
        spans.push(Span::styled(format!("{figure:<6}"), style));
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
