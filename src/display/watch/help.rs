//! All keys, over the plan.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Clear, Paragraph};

use super::screen::Screen;
use super::theme::strong;

const WIDTH: u16 = 46;

/// Draws them in the middle of an area.
pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, screen: &Screen) {
    let look = screen.look();
    let orders = [
        ("space", "pause, resume"),
        ("h", "hold: a safety stop"),
        ("r r", "release a hold"),
        ("+ -", "speed of the head, by 0.1 m/s"),
        ("v", "type a speed"),
        ("s", "type a show time to go to, enter twice"),
    ];
    let views = [
        ("f", "follow the head, or stay"),
        ("0", "all of the route"),
        ("a", "acknowledge a contact"),
        ("k", "which kinds of alerts are listed"),
        ("l", "all lamps"),
        ("] [  z x", "nearer, farther"),
        (look.glyphs.arrows(), "move the plan"),
        ("ctrl-z", "suspend"),
        ("q  esc", "quit"),
    ];
    let orders = if screen.is_read_only() { &[][..] } else { &orders };
    let line = |(key, does): &(&'static str, &'static str)| {
        Line::from(vec![Span::styled(format!(" {key:<10}"), strong()), Span::raw(*does)])
    };
    let lines: Vec<Line<'_>> = orders.iter().chain(&views).map(line).collect();
    let (width, height) = (WIDTH.min(area.width), (lines.len() as u16 + 2).min(area.height));
    let middle = Rect { x: area.x + (area.width - width) / 2, y: area.y + (area.height - height) / 2, width, height };
    let block = Block::bordered().border_set(look.glyphs.border()).title(" keys ");
    frame.render_widget(Clear, middle);
    frame.render_widget(Paragraph::new(lines).block(block), middle);
}
