//! A scene on a screen.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::widgets::Paragraph;

use super::areas::{Areas, cut_top};
use super::screen::Screen;
use super::{alerts, banner, charts, facts, footer, help, plan, status_line, traffic};
use crate::observe::Scene;

/// Lines of figures.
const FACTS: u16 = 6;
const TRAFFIC: u16 = 6;
/// A panel of so many lines has charts; what is over them and the figures goes to the alerts, and of each so many lines more
/// one to each chart.
const CHARTED: u16 = 21;
const LINES_A_BAR: u16 = 10;
const TALLEST: u16 = 5;

/// Draws everything, on a screen of whatever size.
pub fn draw(frame: &mut Frame<'_>, scene: &Scene, screen: &Screen) {
    let areas = Areas::of(frame.area());
    plan::draw(frame, areas.plan, scene, screen);
    draw_panel(frame, areas.panel, scene, screen);
    draw_strip(frame, areas.strip, scene, screen);
    banner::draw(frame, areas.plan, scene, screen);
    if screen.helps {
        help::draw(frame, areas.plan, screen);
    }
    footer::draw_reply(frame, areas.reply, screen);
    footer::draw_keys(frame, areas.keys, scene, screen);
    status_line::draw(frame, areas.status, scene, screen);
}

fn draw_panel(frame: &mut Frame<'_>, area: Rect, scene: &Scene, screen: &Screen) {
    let look = screen.look();
    let bar = area.height.checked_sub(CHARTED).map_or(0, |more| (1 + more / LINES_A_BAR).min(TALLEST));
    let (lines, rest) = cut_top(area, FACTS);
    frame.render_widget(Paragraph::new(facts::lines(scene, look)), lines);
    let (chart, rest) = cut_top(rest, if bar > 0 { bar + 1 } else { 0 });
    charts::draw_clearance(frame, chart, scene, screen);
    let (lines, rest) = cut_top(rest, TRAFFIC);
    frame.render_widget(Paragraph::new(traffic::lines(scene, look)), lines);
    let (chart, rest) = cut_top(rest, if bar > 0 { bar + 1 } else { 0 });
    charts::draw_lateness(frame, chart, screen);
    frame.render_widget(Paragraph::new(alerts::lines(scene, look, rest.height.into())), rest);
}

/// Where there is no room for a panel.
fn draw_strip(frame: &mut Frame<'_>, area: Rect, scene: &Scene, screen: &Screen) {
    let mut lines = facts::short_lines(scene, screen.look());
    lines.extend(alerts::newest(scene, screen.look()));
    frame.render_widget(Paragraph::new(lines), area);
}
