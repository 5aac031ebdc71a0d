//! The layout of a screen, and the drawing of a snapshot.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::widgets::Paragraph;

use super::screen::{Overlay, Screen};
use super::{alerts, charts, footer, header, overlays, panel, plan};
use crate::display::observe::Snapshot;

/// Lines of the figures about clearance and forecast, and of the figures about frames.
const FACTS: u16 = 6;
const TRAFFIC: u16 = 6;
/// Lines from which on a panel has charts. The lines above this number go to the alerts. Each ten of them make each chart
/// one line taller, up to `TALLEST`.
const CHARTED: u16 = 20;
const LINES_A_BAR: u16 = 10;
const TALLEST: u16 = 5;

/// Draws everything, on a screen of any size.
pub fn draw(frame: &mut Frame<'_>, snapshot: &Snapshot, screen: &Screen) {
    let areas = Areas::of(frame.area());
    plan::draw(frame, areas.plan, snapshot, screen);
    draw_panel(frame, areas.panel, snapshot, screen);
    draw_strip(frame, areas.strip, snapshot, screen);
    overlays::draw_cause(frame, areas.plan, snapshot, screen);
    match screen.overlay {
        Some(Overlay::Help) => overlays::draw_help(frame, areas.plan, screen),
        Some(Overlay::Lamps) => overlays::draw_all_lamps(frame, areas.plan.union(areas.panel), snapshot, screen),
        None => {}
    }
    header::draw_lamps(frame, areas.lamps, snapshot, screen);
    footer::draw_reply(frame, areas.reply, screen);
    footer::draw_keys(frame, areas.keys, snapshot, screen);
    header::draw_status(frame, areas.status, snapshot, screen);
}

fn draw_panel(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot, screen: &Screen) {
    let look = screen.look;
    let bar = area.height.checked_sub(CHARTED).map_or(0, |more| (1 + more / LINES_A_BAR).min(TALLEST));
    let (lines, rest) = cut_top(area, FACTS);
    frame.render_widget(Paragraph::new(panel::lines(snapshot, look)), lines);
    let cue = panel::cue_lines(snapshot, look);
    let (lines, rest) = cut_top(rest, cue.len() as u16);
    frame.render_widget(Paragraph::new(cue), lines);
    let (chart, rest) = cut_top(rest, if bar > 0 { bar + 1 } else { 0 });
    charts::draw_clearance(frame, chart, snapshot, screen);
    let (lines, rest) = cut_top(rest, TRAFFIC);
    frame.render_widget(Paragraph::new(panel::timing_lines(snapshot, look)), lines);
    let (chart, rest) = cut_top(rest, if bar > 0 { bar + 1 } else { 0 });
    charts::draw_lateness(frame, chart, screen);
    frame.render_widget(Paragraph::new(alerts::lines(snapshot, look, screen.alert_filter, rest.height.into())), rest);
}

/// Draws the figures below the plan, if there is no room for a panel.
fn draw_strip(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot, screen: &Screen) {
    let mut lines = panel::short_lines(snapshot, screen.look);
    lines.extend(alerts::newest(snapshot, screen.look, screen.alert_filter));
    frame.render_widget(Paragraph::new(lines), area);
}

/// Width from which on a column of figures fits beside the plan.
const WIDE: u16 = 64;
/// Smallest and greatest width of that column.
const PANEL: [u16; 2] = [30, 46];
/// Lines from which on a screen has lamps.
pub(super) const LAMPED: u16 = 13;
/// Lines of figures below the plan if there is no panel.
const STRIP: u16 = 4;

/// The parts of the screen. A part without room is empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Areas {
    pub(super) status: Rect,
    pub(super) lamps: Rect,
    pub(super) plan: Rect,
    /// Beside the plan.
    pub(super) panel: Rect,
    /// Below the plan, if there is no panel.
    pub(super) strip: Rect,
    pub(super) reply: Rect,
    pub(super) keys: Rect,
}

impl Areas {
    /// Divides a screen. Room goes to the status first, then to the reply, the keys and the lamps; the plan gets the rest.
    pub(super) fn of(screen: Rect) -> Self {
        let (status, rest) = cut_top(screen, 1);
        let (rest, keys) = cut_bottom(rest, u16::from(screen.height >= 4));
        let (rest, reply) = cut_bottom(rest, u16::from(screen.height >= 3));
        let (lamps, rest) = cut_top(rest, u16::from(screen.height >= LAMPED));
        if screen.width < WIDE {
            let (plan, strip) = cut_bottom(rest, if rest.height > 2 * STRIP { STRIP } else { rest.height / 3 });
            return Self { status, lamps, plan, panel: Rect::ZERO, strip, reply, keys };
        }
        let width = (screen.width * 3 / 8).clamp(PANEL[0], PANEL[1]);
        let plan = Rect { width: rest.width - width - 1, ..rest };
        let panel = Rect { x: rest.right() - width, width, ..rest };
        Self { status, lamps, plan, panel, strip: Rect::ZERO, reply, keys }
    }
}

/// Splits off the first rows, at most all of them. Returns them and the others.
pub(super) fn cut_top(area: Rect, rows: u16) -> (Rect, Rect) {
    let rows = rows.min(area.height);
    (Rect { height: rows, ..area }, Rect { y: area.y + rows, height: area.height - rows, ..area })
}

/// Splits off the last rows. Returns the others and them.
fn cut_bottom(area: Rect, rows: u16) -> (Rect, Rect) {
    cut_top(area, area.height.saturating_sub(rows))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bench_dragon_ipc::ShowState;
    use ratatui::style::Color;

    use super::*;
    use crate::display::observe::SourcePresence;
    use crate::display::watch::sample::{drawn, rows, screen_after, snapshot, text_after};
    use crate::display::watch::{Glyphs, Look, Theme};

    const GLYPHS: [Glyphs; 3] = [Glyphs::Braille, Glyphs::Blocks, Glyphs::Ascii];

    fn presences() -> [SourcePresence; 5] {
        let age_ns = 3_200_000_000;
        let reason = "the bus cannot be read".to_owned();
        [
            SourcePresence::Live,
            SourcePresence::Waiting,
            SourcePresence::Silent { age_ns },
            SourcePresence::Gone { age_ns },
            SourcePresence::Failed { reason },
        ]
    }

    #[test]
    fn a_screen_of_80_by_24_has_all_figures() {
        let snapshot = snapshot(ShowState::Running, 300.0);
        let text = text_after("", &snapshot);
        for figure in [
            "RUNNING",
            "t 300.000 s",
            "1.000 m/s",
            "\u{d7} 20",
            "dragon",
            "live",
            "120.694 mm",
            "benches 0 and 21",
            "in 5.6 s",
            "0-8 at 412.474 s",
            "2 alerts",
            "near      0-11",
            "space pause",
            "q quit",
        ] {
            assert!(text.contains(figure), "{figure} is missing in\n{text}");
        }
        let dots = text.chars().filter(|symbol| ('\u{2801}'..='\u{28ff}').contains(symbol)).count();
        assert!(dots > 280, "{dots} cells with dots in\n{text}");
        let [near, restarted] = ["near ", "restarted"].map(|kind| text.find(kind).expect("both alerts are shown"));
        assert!(near < restarted, "the newest comes first in\n{text}");
    }

    #[test]
    fn every_size_of_screen_is_drawn_in_every_state() {
        let widths = (0..6).chain([13, 30, 40, 63, 64, 80, 200]);
        for (width, height) in widths.flat_map(|width| (0..6).chain([9, 12, 24, 60]).map(move |height| (width, height)))
        {
            for presence in presences() {
                let snapshot = Snapshot { presence, ..snapshot_of_few() };
                for (glyphs, keys) in GLYPHS.into_iter().zip(["s12", "?", "l"]) {
                    let look = Look { glyphs, theme: Theme::Coloured };
                    drawn(&snapshot, &screen_after(look, keys, &snapshot), width, height);
                }
            }
            drawn(&Snapshot::default(), &screen_after(Look::default(), "", &Snapshot::default()), width, height);
        }
    }

    /// Only the first benches, without a description, so that drawing is fast.
    fn snapshot_of_few() -> Snapshot {
        let mut snapshot = snapshot(ShowState::Running, 12.0);
        let mut copy = (**snapshot.frame.as_ref().expect("a frame")).clone();
        copy.handles.truncate(9);
        snapshot.frame = Some(Arc::new(copy));
        snapshot.run = None;
        snapshot
    }

    #[test]
    fn a_source_that_is_not_live_is_reported_on_the_plan_and_in_the_first_line() {
        let words = ["NO SERVER", "SILENT", "SERVER LOST", "NO BUS"];
        for ((width, height), (presence, word)) in [(40, 12), (80, 24), (200, 60)]
            .into_iter()
            .flat_map(|size| presences().into_iter().skip(1).zip(words).map(move |it| (size, it)))
        {
            let snapshot = Snapshot { presence, ..snapshot(ShowState::Running, 300.0) };
            let rows = rows(&drawn(&snapshot, &screen_after(Look::default(), "", &snapshot), width, height));
            assert!(rows[0].contains(word) && !rows[0].contains("RUNNING"), "{}", rows[0]);
            assert!(rows[1..].iter().any(|row| row.contains(word)), "{}", rows.join("\n"));
        }
    }

    #[test]
    fn without_colours_the_text_is_the_same() {
        let look = Look { theme: Theme::Plain, glyphs: Glyphs::Braille };
        for presence in presences() {
            let snapshot = Snapshot { presence, ..snapshot(ShowState::Held, 300.0) };
            let [plain, coloured] =
                [look, Look::default()].map(|look| drawn(&snapshot, &screen_after(look, "", &snapshot), 80, 24));
            assert!(plain.content.iter().all(|cell| (cell.fg, cell.bg) == (Color::Reset, Color::Reset)));
            assert!(coloured.content.iter().any(|cell| cell.fg != Color::Reset));
            assert_eq!(rows(&plain), rows(&coloured));
        }
    }

    #[test]
    fn a_terminal_without_utf_8_gets_only_ascii() {
        let look = Look { glyphs: Glyphs::Ascii, theme: Theme::Coloured };
        for keys in ["", "?", "l", "f", "s300"] {
            for presence in presences() {
                let snapshot = Snapshot { presence, ..snapshot(ShowState::Paused, 300.0) };
                let text = rows(&drawn(&snapshot, &screen_after(look, keys, &snapshot), 80, 24)).join("\n");
                assert!(text.is_ascii(), "{text}");
            }
        }
    }

    #[test]
    fn the_parts_of_any_screen_lie_in_it_and_do_not_overlap() {
        for (width, height) in (0..=130).flat_map(|width| (0..=40).map(move |height| (width, height))) {
            let screen = Rect::new(0, 0, width, height);
            let Areas { status, lamps, plan, panel, strip, reply, keys } = Areas::of(screen);
            let parts = [status, lamps, plan, panel, strip, reply, keys];
            for (index, part) in parts.iter().enumerate() {
                assert!(part.is_empty() || screen.union(*part) == screen, "{part} of {screen}");
                let others = parts[index + 1..].iter();
                assert!(others.clone().all(|other| !part.intersects(*other)), "{part} of {screen}");
            }
        }
    }

    #[test]
    fn a_screen_of_80_by_24_has_a_plan_of_49_by_20_beside_the_figures() {
        let areas = Areas::of(Rect::new(0, 0, 80, 24));
        assert_eq!((areas.plan, areas.panel), (Rect::new(0, 2, 49, 20), Rect::new(50, 2, 30, 20)));
    }
}
