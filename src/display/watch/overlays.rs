//! Texts over the plan: the cause of the show's standing, all keys, all lamps.

use ratatui::Frame;
use ratatui::layout::{Alignment, Rect};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Clear, Paragraph};

use super::header::{lamp_sign, tone};
use super::look::strong;
use super::screen::Screen;
use crate::display::observe::{Lamp, Level, Snapshot, SourcePresence, Standing, lamps};

/// Greatest widths of the boxes of keys and of lamps.
const HELP_WIDTH: u16 = 46;
const LAMPS_WIDTH: u16 = 74;

/// Draws the cause of the show's standing and its remedy over the plan: in a box in the middle while no frames arrive, in lines
/// at the top while they do. Draws nothing for a show that runs well.
pub(super) fn draw_cause(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot, screen: &Screen) {
    let Standing { level, word, cause, remedy } = Standing::of(snapshot, snapshot.seen_ns);
    let is_live = snapshot.presence == SourcePresence::Live;
    if is_live && level == Level::Good || area.is_empty() {
        return;
    }
    let style = screen.look.theme.block(tone(level));
    let width = usize::from(area.width);
    let mut lines = wrapped(&cause, width.saturating_sub(4));
    lines.extend(remedy.iter().flat_map(|remedy| wrapped(remedy, width.saturating_sub(4))));
    if !is_live {
        lines.insert(0, word.to_owned());
        let widest = lines.iter().map(|line| line.chars().count()).max().unwrap_or_default();
        let lines = lines.into_iter().map(Line::from).collect();
        draw_box(frame, area, (widest + 4) as u16, lines, Alignment::Center, Block::bordered().style(style), screen);
        return;
    }
    let height = (lines.len() as u16).min(area.height.div_ceil(2));
    let strip = Rect { height, ..area };
    let text: Vec<Line<'_>> = lines.into_iter().map(|line| Line::from(format!(" {line:<width$}"))).collect();
    frame.render_widget(Clear, strip);
    frame.render_widget(Paragraph::new(text).style(screen.look.theme.text(tone(level))), strip);
}

/// Breaks a text between words into lines of at most this many characters.
fn wrapped(text: &str, columns: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= columns => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

pub(super) fn draw_help(frame: &mut Frame<'_>, area: Rect, screen: &Screen) {
    let look = screen.look;
    let commands = [
        ("space", "pause, resume"),
        ("h", "hold: a safety stop"),
        ("r r", "release a hold"),
        ("g", "GO: walk on from a cue"),
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
    let commands = if screen.is_read_only { &[][..] } else { &commands };
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
