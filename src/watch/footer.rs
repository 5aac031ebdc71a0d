//! The last two lines: what became of the last command, or what is being typed; and the keys.

use bench_dragon_ipc::ShowState;
use ratatui::Frame;
use ratatui::layout::{Position, Rect};
use ratatui::text::{Line, Span};

use super::condition::state;
use super::screen::Screen;
use super::theme::strong;
use crate::observe::Scene;

/// Draws what is typed, with the cursor behind it, else the reply.
pub(super) fn draw_reply(frame: &mut Frame<'_>, area: Rect, screen: &Screen) {
    let look = screen.look();
    if let Some(entry) = &screen.entry {
        let line = Line::styled(entry.line(), strong());
        let column = (line.width() as u16).min(area.width.saturating_sub(1));
        frame.render_widget(line, area);
        frame.set_cursor_position(Position::new(area.x + column, area.y));
    } else if let Some(reply) = &screen.reply {
        frame.render_widget(Line::styled(reply.text.clone(), look.theme.text(reply.tone)), area);
    }
}

/// Draws the keys, those that matter most first.
pub(super) fn draw_keys(frame: &mut Frame<'_>, area: Rect, scene: &Scene, screen: &Screen) {
    let look = screen.look();
    let keys: &[(&str, &str)] = match (screen.entry.is_some(), screen.is_read_only()) {
        (true, _) => &[("enter", "send"), ("esc", "leave"), ("h", "hold")],
        (false, true) => &[("?", "help"), ("q", "quit"), ("f", "follow"), ("0", "all"), ("[ ]", "zoom")],
        (false, false) => &[
            ("space", if state(scene) == Some(ShowState::Running) { "pause" } else { "resume" }),
            ("h", "hold"),
            ("R", "release"),
            ("?", "help"),
            ("q", "quit"),
            ("+ - v", "speed"),
            ("s", "seek"),
            ("f", "follow"),
            ("0", "all"),
        ],
    };
    let spans = keys
        .iter()
        .flat_map(|(key, does)| [Span::styled(*key, strong()), Span::styled(format!(" {does}  "), look.theme.faint())]);
    frame.render_widget(spans.collect::<Line<'_>>(), area);
}
