//! Boxes over the plan: the reason for which it is not live, all keys, all lamps.

use ratatui::Frame;
use ratatui::layout::{Alignment, Rect};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Clear, Paragraph};

use super::header::{Condition, lamp_sign};
use super::look::strong;
use super::screen::Screen;
use crate::display::observe::{Lamp, Snapshot, SourcePresence, lamps};

/// Greatest widths of the boxes of keys and of lamps.
const HELP_WIDTH: u16 = 46;
const LAMPS_WIDTH: u16 = 74;

/// Draws the reason for which the plan is not live. Draws nothing while frames arrive.
pub(super) fn draw_banner(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot, screen: &Screen) {
    let Some(reason) = reason(snapshot, &screen.instance) else { return };
    let condition = Condition::of(snapshot);
    let lines = vec![Line::from(condition.word), Line::from(reason)];
    let widest = lines.iter().map(Line::width).max().unwrap_or_default();
    let block = Block::bordered().style(screen.look.theme.block(condition.tone));
    draw_box(frame, area, (widest + 4) as u16, lines, Alignment::Center, block, screen);
}

fn reason(snapshot: &Snapshot, instance: &str) -> Option<String> {
    let age_s = snapshot.presence.age_s().unwrap_or_default();
    match &snapshot.presence {
        SourcePresence::Live => None,
        SourcePresence::Waiting => Some(format!("no frame yet on instance {instance}")),
        SourcePresence::Failed { reason } => Some(reason.clone()),
        SourcePresence::Silent { .. } => Some(format!("the last frame is {age_s:.1} s old")),
        SourcePresence::Gone { .. } => Some(format!("the server is gone, the last frame is {age_s:.1} s old")),
        SourcePresence::Ended { .. } => Some("the show has ended in order".to_owned()),
    }
}

pub(super) fn draw_help(frame: &mut Frame<'_>, area: Rect, screen: &Screen) {
    let look = screen.look;
    let commands = [
        ("space", "pause, resume"),
        ("h", "hold: a safety stop"),
        ("r r", "release a hold"),
        ("+ -", "speed of the head, by 0.1 m/s"),
        ("v", "type a speed"),
        ("s", "type a time to seek, enter twice"),
    ];
    let views = [
        ("f", "follow the head: on, off"),
        ("0", "show all of the route"),
        ("a", "acknowledge a contact"),
        ("k", "filter the alerts by kind"),
        ("l", "show all lamps"),
        ("] [  z x", "zoom in, out"),
        (look.glyphs.signs().arrows, "move the plan"),
        ("ctrl-z", "suspend"),
        ("q  esc", "quit"),
    ];
    let commands = if screen.read_only { &[][..] } else { &commands };
    let line = |(key, does): &(&'static str, &'static str)| {
        Line::from(vec![Span::styled(format!(" {key:<10}"), strong()), Span::raw(*does)])
    };
    let lines = commands.iter().chain(&views).map(line).collect();
    draw_box(frame, area, HELP_WIDTH, lines, Alignment::Left, Block::bordered().title(" keys "), screen);
}

pub(super) fn draw_all_lamps(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot, screen: &Screen) {
    let line = |lamp: &Lamp| {
        let (sign, style) = lamp_sign(lamp.level, screen.look);
        let sign = Span::styled(format!(" {sign} {:<9} ", lamp.name), style);
        Line::from(vec![sign, Span::raw(lamp.text.clone())])
    };
    let lines = lamps(snapshot, snapshot.seen_ns).iter().map(line).collect();
    draw_box(frame, area, LAMPS_WIDTH, lines, Alignment::Left, Block::bordered().title(" lamps "), screen);
}

/// Draws lines in a box in the middle of an area.
fn draw_box(
    frame: &mut Frame<'_>,
    area: Rect,
    widest: u16,
    lines: Vec<Line<'_>>,
    alignment: Alignment,
    block: Block<'_>,
    screen: &Screen,
) {
    let (width, height) = (widest.min(area.width), (lines.len() as u16 + 2).min(area.height));
    let middle = Rect { x: area.x + (area.width - width) / 2, y: area.y + (area.height - height) / 2, width, height };
    let block = block.border_set(screen.look.glyphs.border());
    frame.render_widget(Clear, middle);
    frame.render_widget(Paragraph::new(lines).alignment(alignment).block(block), middle);
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::ShowState;

    use crate::display::observe::lamps;
    use crate::display::watch::sample::{snapshot, text_after};

    #[test]
    fn all_lamps_are_listed_over_the_plan() {
        let snapshot = snapshot(ShowState::Running, 300.0);
        let text = text_after("l", &snapshot);
        for lamp in lamps(&snapshot, snapshot.seen_ns) {
            let line = format!("{:<9} {}", lamp.name, lamp.text);
            assert!(text.contains(&line), "{line} is missing in\n{text}");
        }
    }
}
