//! What stands across the plan where it is not the present that is drawn.

use ratatui::Frame;
use ratatui::layout::{Alignment, Rect};
use ratatui::text::Line;
use ratatui::widgets::{Block, Clear, Paragraph};

use super::condition::Condition;
use super::screen::Screen;
use crate::display::observe::{Link, Scene};

/// Draws it, unless frames come.
pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, scene: &Scene, screen: &Screen) {
    let Some(reason) = reason(scene, screen.instance()) else { return };
    let condition = Condition::of(scene);
    let style = screen.look().theme.block(condition.tone);
    let lines = [Line::from(condition.word), Line::from(reason)];
    let widest = lines.iter().map(Line::width).max().unwrap_or_default();
    let width = (widest + 4).min(area.width.into()) as u16;
    let height = 4.min(area.height);
    let box_area = Rect { x: area.x + (area.width - width) / 2, y: area.y + (area.height - height) / 2, width, height };
    let block = Block::bordered().border_set(screen.look().glyphs.border()).style(style);
    frame.render_widget(Clear, box_area);
    frame.render_widget(Paragraph::new(lines.to_vec()).alignment(Alignment::Center).block(block), box_area);
}

fn reason(scene: &Scene, instance: &str) -> Option<String> {
    let seconds = |age_ns: u64| age_ns as f64 * 1e-9;
    match &scene.link {
        Link::Live => None,
        Link::Waiting => Some(format!("no frame yet on instance {instance}")),
        Link::Failed { reason } => Some(reason.clone()),
        Link::Silent { age_ns } => Some(format!("the last frame is {:.1} s old", seconds(*age_ns))),
        Link::Gone { age_ns } => Some(format!("the server is gone, the last frame {:.1} s old", seconds(*age_ns))),
        Link::Ended { .. } => Some("the show has ended in order".to_owned()),
    }
}
