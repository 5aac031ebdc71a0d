//! The lamps: those that matter in one line, all of them over the plan.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Clear, Paragraph};

use super::screen::{Look, Screen};
use super::theme::{Tone, strong};
use crate::display::observe::{Lamp, LampLevel, Scene, lamps};

/// Widest list of all lamps.
const WIDTH: u16 = 74;

/// Draws a contact that has not been acknowledged, then the lamps, the most urgent ones first, each whole or not at all.
pub(super) fn draw_row(frame: &mut Frame<'_>, area: Rect, scene: &Scene, screen: &Screen) {
    let (look, mut spans, mut room) = (screen.look(), Vec::new(), usize::from(area.width));
    if let Some(contact) = &screen.past_contact {
        let text = format!(" {contact}, a to acknowledge ");
        room = room.saturating_sub(text.chars().count() + 1);
        spans.extend([Span::styled(text, look.theme.block(Tone::Danger)), Span::raw(" ")]);
    }
    let mut lamps: Vec<Lamp> = lamps(scene, scene.seen_ns).into_iter().filter(is_in_row).collect();
    lamps.sort_by_key(|lamp| std::cmp::Reverse(lamp.level.max(LampLevel::Good)));
    for lamp in &lamps {
        let lamp_spans = short(lamp, look);
        let width: usize = lamp_spans.iter().map(Span::width).sum();
        if width > room {
            break;
        }
        room -= width;
        spans.extend(lamp_spans);
    }
    frame.render_widget(Line::from(spans), area);
}

/// Draws all lamps in the middle of an area.
pub(super) fn draw_all(frame: &mut Frame<'_>, area: Rect, scene: &Scene, screen: &Screen) {
    let look = screen.look();
    let line = |lamp: &Lamp| {
        let style = tone(lamp.level).map_or(look.theme.faint(), |tone| look.theme.text(tone));
        let sign = Span::styled(format!(" {} {:<9} ", sign(lamp.level, look), lamp.name), style);
        Line::from(vec![sign, Span::raw(lamp.text.clone())])
    };
    let lines: Vec<Line<'_>> = lamps(scene, scene.seen_ns).iter().map(line).collect();
    let (width, height) = (WIDTH.min(area.width), (lines.len() as u16 + 2).min(area.height));
    let middle = Rect { x: area.x + (area.width - width) / 2, y: area.y + (area.height - height) / 2, width, height };
    let block = Block::bordered().border_set(look.glyphs.border()).title(" lamps ");
    frame.render_widget(Clear, middle);
    frame.render_widget(Paragraph::new(lines).block(block), middle);
}

/// Whether a lamp belongs into the line: it burns, and says more than that a source publishes and nobody loses frames.
fn is_in_row(lamp: &Lamp) -> bool {
    lamp.level > LampLevel::Good || lamp.level == LampLevel::Good && !["source", "readers"].contains(&lamp.name)
}

fn short(lamp: &Lamp, look: Look) -> Vec<Span<'static>> {
    let style = tone(lamp.level).map_or(look.theme.faint(), |tone| look.theme.text(tone));
    let sign = Span::styled(format!("{} ", sign(lamp.level, look)), style);
    let has_text = lamp.level > LampLevel::Good || ["guard", "recorder", "timecode"].contains(&lamp.name);
    let text = if has_text { format!("{} {}  ", lamp.name, lamp.text) } else { format!("{}  ", lamp.name) };
    let style = if lamp.level > LampLevel::Good { style } else { strong() };
    vec![sign, Span::styled(text, style)]
}

fn tone(level: LampLevel) -> Option<Tone> {
    match level {
        LampLevel::Off => None,
        LampLevel::Good => Some(Tone::Good),
        LampLevel::Warning => Some(Tone::Caution),
        LampLevel::Danger => Some(Tone::Danger),
    }
}

/// A sign that says the same as the colour.
fn sign(level: LampLevel, look: Look) -> &'static str {
    look.glyphs.lamps()[level as usize]
}
