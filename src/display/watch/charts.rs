//! Clearance over the run, lateness over the last minutes.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Sparkline, SparklineBar};

use super::facts::{near_m, tone};
use super::screen::Screen;
use super::theme::{Tone, strong};
use super::wording::span;
use crate::display::observe::{ClearanceChart, Scene};

/// The clearance of the whole run, from its start to its end, and below it where the head is and where benches touch.
pub(super) fn draw_clearance(frame: &mut Frame<'_>, area: Rect, scene: &Scene, screen: &Screen) {
    let (Some(chart), true) = (&scene.chart, area.height > 1) else { return };
    let look = screen.look();
    let near_m = near_m(scene);
    let bars = columns(chart, area.width).map(|least_m| {
        let bar = SparklineBar::from(least_m.map(|least_m| (least_m.max(0.0) * 1e6) as u64 + 1));
        bar.style(least_m.and_then(|least_m| tone(least_m, near_m)).map(|tone| look.theme.text(tone)))
    });
    let sparkline = Sparkline::default()
        .data(bars)
        .bar_set(look.glyphs.bars())
        .absent_value_symbol(" ")
        .style(Style::new().fg(look.theme.colour(Color::Cyan)));
    frame.render_widget(sparkline, Rect { height: area.height - 1, ..area });
    let below = Rect { y: area.bottom() - 1, height: 1, ..area };
    frame.render_widget(timeline(chart, area.width, scene, screen), below);
}

/// The least clearance of each column, in metres.
fn columns(chart: &ClearanceChart, width: u16) -> impl Iterator<Item = Option<f64>> {
    let (bins, width) = (chart.least_m(), usize::from(width));
    (0..width).map(move |column| {
        let from = column * bins.len() / width;
        let to = ((column + 1) * bins.len() / width).max(from + 1);
        bins[from..to].iter().flatten().copied().reduce(f64::min)
    })
}

fn timeline(chart: &ClearanceChart, width: u16, scene: &Scene, screen: &Screen) -> Line<'static> {
    let look = screen.look();
    let length_s = chart.step_s() * chart.least_m().len() as f64;
    let column = |time_s: f64| {
        let column = ((time_s - chart.start_s()) / length_s * f64::from(width)).floor();
        (0.0..f64::from(width)).contains(&column).then_some(column as usize)
    };
    let [_, between, _] = look.glyphs.span();
    let mut cells = vec![Span::styled(between, look.theme.faint()); width.into()];
    if let Some(cell) = scene.outlook.contact_s().and_then(column).and_then(|at| cells.get_mut(at)) {
        *cell = Span::styled(look.glyphs.cross(), look.theme.text(Tone::Danger));
    }
    let now_s = scene.frame.as_ref().map(|still| still.header.sim_time_s());
    if let Some(cell) = now_s.and_then(column).and_then(|at| cells.get_mut(at)) {
        *cell = Span::styled(look.glyphs.pointer(), strong());
    }
    Line::from(cells)
}

/// The lateness of the last seconds, a column each, and the worst of them.
pub(super) fn draw_lateness(frame: &mut Frame<'_>, area: Rect, screen: &Screen) {
    if area.is_empty() {
        return;
    }
    let look = screen.look();
    let seconds: Vec<u64> = screen.lateness.latest(area.width.into()).collect();
    let worst_ns = seconds.iter().copied().max().unwrap_or_default();
    let title = match seconds.len() {
        0 => "lateness of each second".to_owned(),
        count => format!("p99 of {count} s, to {}", span(worst_ns, look.glyphs)),
    };
    frame.render_widget(Line::styled(title, look.theme.faint()), Rect { height: 1, ..area });
    let sparkline = Sparkline::default()
        .data(seconds)
        .bar_set(look.glyphs.bars())
        .style(Style::new().fg(look.theme.colour(Color::Cyan)));
    frame.render_widget(sparkline, Rect { y: area.y + 1, height: area.height - 1, ..area });
}
