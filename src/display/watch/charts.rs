//! The charts of the clearance over the run, and of the lateness over the last minutes.

use std::collections::VecDeque;
use std::sync::Arc;

use bench_dragon_ipc::{FrameHeader, Status, TimeHistogram};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Sparkline, SparklineBar};

use super::look::{Tone, strong};
use super::panel::{near_m, span, tone};
use super::screen::Screen;
use crate::display::observe::{ClearanceChart, Snapshot};

/// Draws the clearance of the whole run, and below it the marks of the head and of the next contact.
pub(super) fn draw_clearance(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot, screen: &Screen) {
    let (Some(chart), true) = (&snapshot.chart, area.height > 1) else { return };
    let look = screen.look;
    let near_m = near_m(snapshot);
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
    frame.render_widget(timeline(chart, area.width, snapshot, screen), below);
}

/// The least clearance of each column, in metres; `None` without a measurement.
fn columns(chart: &ClearanceChart, width: u16) -> impl Iterator<Item = Option<f64>> {
    let (bins, width) = (&chart.least_m, usize::from(width));
    (0..width).map(move |column| {
        let from = column * bins.len() / width;
        let to = ((column + 1) * bins.len() / width).max(from + 1);
        bins[from..to].iter().flatten().copied().reduce(f64::min)
    })
}

fn timeline(chart: &ClearanceChart, width: u16, snapshot: &Snapshot, screen: &Screen) -> Line<'static> {
    let look = screen.look;
    let length_s = chart.step_s * chart.least_m.len() as f64;
    let column = |time_s: f64| {
        let column = ((time_s - chart.start_s) / length_s * f64::from(width)).floor();
        (0.0..f64::from(width)).contains(&column).then_some(column as usize)
    };
    let [_, between, _] = look.glyphs.signs().span;
    let mut cells = vec![Span::styled(between, look.theme.faint()); width.into()];
    if let Some(cell) = snapshot.forecast.contact_s().and_then(column).and_then(|at| cells.get_mut(at)) {
        *cell = Span::styled(look.glyphs.signs().cross, look.theme.text(Tone::Danger));
    }
    let now_s = snapshot.header().map(FrameHeader::show_time_s);
    if let Some(cell) = now_s.and_then(column).and_then(|at| cells.get_mut(at)) {
        *cell = Span::styled(look.glyphs.signs().pointer, strong());
    }
    Line::from(cells)
}

/// Draws the lateness of the last seconds, one column each, and the greatest of them as a number.
pub(super) fn draw_lateness(frame: &mut Frame<'_>, area: Rect, screen: &Screen) {
    if area.is_empty() {
        return;
    }
    let look = screen.look;
    let seconds: Vec<u64> = screen.lateness.latest(area.width.into()).collect();
    let worst_ns = seconds.iter().copied().max().unwrap_or_default();
    let title = if seconds.is_empty() {
        "p99 per second".to_owned()
    } else {
        format!("p99 per second, max {}", span(worst_ns, look.glyphs))
    };
    frame.render_widget(Line::styled(title, look.theme.faint()), Rect { height: 1, ..area });
    let sparkline = Sparkline::default()
        .data(seconds)
        .bar_set(look.glyphs.bars())
        .style(Style::new().fg(look.theme.colour(Color::Cyan)));
    frame.render_widget(sparkline, Rect { y: area.y + 1, height: area.height - 1, ..area });
}

/// Number of seconds that are kept: at least the columns of the widest chart.
const KEPT: usize = 120;
/// The quantile of a second's lateness that is kept.
const SHARE: f64 = 0.99;

/// The 99th percentile of each second's lateness, computed from a histogram that only grows.
#[derive(Clone, Debug, Default)]
pub(super) struct LatenessHistory {
    seconds_ns: VecDeque<u64>,
    /// The status with which the second in progress began.
    begun: Option<Arc<Status>>,
}

impl LatenessHistory {
    /// Records a status. A second ends after as many ticks as the server makes per second.
    pub(super) fn note(&mut self, status: &Arc<Status>) {
        let same_run = self.begun.as_ref().filter(|begun| begun.run_id == status.run_id && begun.tick <= status.tick);
        let Some(begun) = same_run else {
            self.begun = Some(Arc::clone(status));
            return;
        };
        if status.tick - begun.tick < u64::from(status.rate_hz.max(1)) {
            return;
        }
        let late_ns = since(&begun.lateness, &status.lateness).quantile_ns(SHARE);
        if self.seconds_ns.len() == KEPT {
            self.seconds_ns.pop_front();
        }
        self.seconds_ns.push_back(late_ns);
        self.begun = Some(Arc::clone(status));
    }

    /// The last `count` seconds, oldest first, in nanoseconds.
    pub(super) fn latest(&self, count: usize) -> impl Iterator<Item = u64> {
        let skipped = self.seconds_ns.len().saturating_sub(count);
        self.seconds_ns.iter().skip(skipped).copied()
    }
}

/// The difference of two states of a histogram.
fn since(before: &TimeHistogram, after: &TimeHistogram) -> TimeHistogram {
    let mut gained = TimeHistogram { max_ns: after.max_ns, ..TimeHistogram::default() };
    for (gained, (before, after)) in gained.counts.iter_mut().zip(before.counts.iter().zip(&after.counts)) {
        *gained = after.saturating_sub(*before);
    }
    gained
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(run_id: u64, tick: u64, lateness: &TimeHistogram) -> Arc<Status> {
        Arc::new(Status { run_id, tick, rate_hz: 10, lateness: *lateness, ..Status::default() })
    }

    #[test]
    fn each_second_has_its_own_lateness() {
        let (mut history, mut all) = (LatenessHistory::default(), TimeHistogram::default());
        history.note(&status(1, 0, &all));
        for (tick, late_ns) in [(5, 40), (10, 40), (15, 20), (20, 20)] {
            (0..5).for_each(|_| all.record(late_ns));
            history.note(&status(1, tick, &all));
        }
        assert_eq!(history.latest(9).collect::<Vec<_>>(), [40, 20]);
        assert_eq!(history.latest(1).collect::<Vec<_>>(), [20]);
    }

    #[test]
    fn a_restart_begins_a_new_second_and_keeps_the_earlier_ones() {
        let (mut history, mut all) = (LatenessHistory::default(), TimeHistogram::default());
        history.note(&status(1, 0, &all));
        (0..10).for_each(|_| all.record(30));
        history.note(&status(1, 10, &all));
        history.note(&status(2, 3, &TimeHistogram::default()));
        let mut again = TimeHistogram::default();
        (0..10).for_each(|_| again.record(50));
        history.note(&status(2, 13, &again));
        assert_eq!(history.latest(9).collect::<Vec<_>>(), [30, 50]);
    }

    #[test]
    fn at_most_two_minutes_are_kept() {
        let (mut history, mut all) = (LatenessHistory::default(), TimeHistogram::default());
        for second in 0..=KEPT as u64 + 5 {
            history.note(&status(1, second * 10, &all));
            all.record(second);
        }
        assert_eq!(history.latest(usize::MAX).count(), KEPT);
    }
}
