//! A scene on a screen.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::widgets::Paragraph;

use super::areas::{Areas, cut_top};
use super::screen::{Overlay, Screen};
use super::{alerts, banner, charts, facts, footer, help, lamps, plan, status_line, traffic};
use crate::display::observe::Scene;

/// Lines of figures.
const FACTS: u16 = 6;
const TRAFFIC: u16 = 6;
/// A panel of so many lines has charts; what is over them and the figures goes to the alerts, and of each so many lines more
/// one to each chart.
const CHARTED: u16 = 20;
const LINES_A_BAR: u16 = 10;
const TALLEST: u16 = 5;

/// Draws everything, on a screen of whatever size.
pub fn draw(frame: &mut Frame<'_>, scene: &Scene, screen: &Screen) {
    let areas = Areas::of(frame.area());
    plan::draw(frame, areas.plan, scene, screen);
    draw_panel(frame, areas.panel, scene, screen);
    draw_strip(frame, areas.strip, scene, screen);
    banner::draw(frame, areas.plan, scene, screen);
    match screen.overlay {
        Some(Overlay::Help) => help::draw(frame, areas.plan, screen),
        Some(Overlay::Lamps) => lamps::draw_all(frame, areas.plan.union(areas.panel), scene, screen),
        None => {}
    }
    lamps::draw_row(frame, areas.lamps, scene, screen);
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
    frame.render_widget(Paragraph::new(alerts::lines(scene, look, screen.alert_filter, rest.height.into())), rest);
}

/// Where there is no room for a panel.
fn draw_strip(frame: &mut Frame<'_>, area: Rect, scene: &Scene, screen: &Screen) {
    let mut lines = facts::short_lines(scene, screen.look());
    lines.extend(alerts::newest(scene, screen.look(), screen.alert_filter));
    frame.render_widget(Paragraph::new(lines), area);
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::ShowState;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;
    use ratatui::buffer::Buffer;
    use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
    use ratatui::style::Color;

    use super::*;
    use crate::display::observe::{GuardSituation, Link};
    use crate::display::watch::sample::scene;
    use crate::display::watch::{Glyphs, Look, Theme};

    const GLYPHS: [Glyphs; 3] = [Glyphs::Braille, Glyphs::Blocks, Glyphs::Ascii];

    fn screen(look: Look, keys: &str, scene: &Scene) -> Screen {
        let mut screen = Screen::new("dragon", look, false);
        screen.see(scene, 0);
        for key in keys.chars() {
            screen.press(KeyEvent::new(KeyCode::Char(key), KeyModifiers::NONE), scene, 0);
        }
        screen
    }

    fn drawn(scene: &Scene, screen: &Screen, width: u16, height: u16) -> Buffer {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("memory");
        terminal.draw(|frame| draw(frame, scene, screen)).expect("memory takes it");
        terminal.backend().buffer().clone()
    }

    fn rows(buffer: &Buffer) -> Vec<String> {
        let width = usize::from(buffer.area.width);
        let symbols = |row: &[ratatui::buffer::Cell]| row.iter().map(ratatui::buffer::Cell::symbol).collect();
        buffer.content.chunks(width.max(1)).map(symbols).collect()
    }

    fn text(scene: &Scene, screen: &Screen, width: u16, height: u16) -> String {
        rows(&drawn(scene, screen, width, height)).join("\n")
    }

    fn links() -> [Link; 5] {
        let age_ns = 3_200_000_000;
        let reason = "the bus cannot be read".to_owned();
        [Link::Live, Link::Waiting, Link::Silent { age_ns }, Link::Gone { age_ns }, Link::Failed { reason }]
    }

    #[test]
    fn a_screen_of_80_by_24_has_all_that_a_show_is_watched_for() {
        let scene = scene(ShowState::Running, 300.0);
        let text = text(&scene, &screen(Look::default(), "", &scene), 80, 24);
        for told in [
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
            assert!(text.contains(told), "{told} is missing in\n{text}");
        }
        let dots = text.chars().filter(|symbol| ('\u{2801}'..='\u{28ff}').contains(symbol)).count();
        assert!(dots > 280, "{dots} cells with dots in\n{text}");
        let [near, restarted] = ["near ", "restarted"].map(|kind| text.find(kind).expect("both alerts are shown"));
        assert!(near < restarted, "the newest comes first in\n{text}");
    }

    #[test]
    fn every_size_is_drawn_on_whatever_is_shown() {
        let widths = (0..6).chain([13, 30, 40, 63, 64, 80, 200]);
        for (width, height) in widths.flat_map(|width| (0..6).chain([9, 12, 24, 60]).map(move |height| (width, height)))
        {
            for link in links() {
                let scene = Scene { link, ..scene_of_few() };
                for (glyphs, keys) in GLYPHS.into_iter().zip(["s12", "?", "l"]) {
                    let look = Look { glyphs, theme: Theme::Coloured };
                    drawn(&scene, &screen(look, keys, &scene), width, height);
                }
            }
            drawn(&Scene::default(), &screen(Look::default(), "", &Scene::default()), width, height);
        }
    }

    /// The first benches alone, without a description: drawn quickly.
    fn scene_of_few() -> Scene {
        let mut scene = scene(ShowState::Running, 12.0);
        let mut still = (**scene.frame.as_ref().expect("a frame")).clone();
        still.handles.truncate(9);
        scene.frame = Some(std::sync::Arc::new(still));
        scene.run = None;
        scene
    }

    #[test]
    fn a_source_that_says_nothing_is_told_across_the_plan_and_in_the_first_line() {
        let words = ["WAITING", "SILENT", "LOST", "FAILED"];
        for ((width, height), (link, word)) in [(40, 12), (80, 24), (200, 60)]
            .into_iter()
            .flat_map(|size| links().into_iter().skip(1).zip(words).map(move |it| (size, it)))
        {
            let scene = Scene { link, ..scene(ShowState::Running, 300.0) };
            let rows = rows(&drawn(&scene, &screen(Look::default(), "", &scene), width, height));
            assert!(rows[0].contains(word) && !rows[0].contains("RUNNING"), "{}", rows[0]);
            assert!(rows[1..].iter().any(|row| row.contains(word)), "{}", rows.join("\n"));
        }
    }

    #[test]
    fn a_show_that_has_ended_in_order_is_not_lost() {
        let scene = Scene { link: Link::Ended { age_ns: 1_000_000_000 }, ..scene(ShowState::Ended, 300.0) };
        let text = text(&scene, &screen(Look::default(), "", &scene), 80, 24);
        assert!(text.contains("ENDED") && !text.contains("LOST"), "{text}");
    }

    #[test]
    fn without_colours_everything_is_still_told_by_words() {
        let look = Look { theme: Theme::Plain, glyphs: Glyphs::Braille };
        for link in links() {
            let scene = Scene { link, ..scene(ShowState::Held, 300.0) };
            let [plain, coloured] =
                [look, Look::default()].map(|look| drawn(&scene, &screen(look, "", &scene), 80, 24));
            assert!(plain.content.iter().all(|cell| (cell.fg, cell.bg) == (Color::Reset, Color::Reset)));
            assert!(coloured.content.iter().any(|cell| cell.fg != Color::Reset));
            assert_eq!(rows(&plain), rows(&coloured));
        }
    }

    #[test]
    fn a_terminal_without_other_characters_gets_ascii_alone() {
        let look = Look { glyphs: Glyphs::Ascii, theme: Theme::Coloured };
        for keys in ["", "?", "l", "f", "s300"] {
            for link in links() {
                let scene = Scene { link, ..scene(ShowState::Paused, 300.0) };
                let text = text(&scene, &screen(look, keys, &scene), 80, 24);
                assert!(text.is_ascii(), "{text}");
            }
        }
    }

    #[test]
    fn the_keys_of_a_screen_of_80_by_24_are_whole() {
        let scene = scene(ShowState::Running, 300.0);
        let rows = rows(&drawn(&scene, &screen(Look::default(), "", &scene), 80, 24));
        let keys = "h hold  space pause  r release  ? help  q quit  + - v speed  s seek  f follow";
        assert_eq!(rows[23].trim_end(), keys);
    }

    #[test]
    fn the_guards_situations_have_a_word_each_and_for_good_is_not_said_under_timecode() {
        let of = |guard| Scene { guard, ..scene(ShowState::Held, 300.0) };
        let text = |guard| text(&of(guard), &screen(Look::default(), "", &of(guard)), 80, 24);
        for (guard, words) in [
            (GuardSituation::None, ["HELD", "in "]),
            (GuardSituation::Waiting, ["GUARD WAITS", "waits for a grant"]),
            (GuardSituation::Missing, ["NO GUARD", "guard missing"]),
            (GuardSituation::AtEnd { for_good: true }, ["GUARD STOP", "for good"]),
            (GuardSituation::AtEnd { for_good: false }, ["GUARD STOP", "until timecode moves"]),
        ] {
            let text = text(guard);
            let words = if guard == GuardSituation::None { &words[..1] } else { &words[..] };
            assert!(words.iter().all(|word| text.contains(word)), "{words:?} in\n{text}");
            assert_eq!(text.contains("for good"), guard == GuardSituation::AtEnd { for_good: true }, "{text}");
        }
    }

    #[test]
    fn a_contact_that_has_passed_is_shown_on_every_screen_until_a_is_hit() {
        let mut touching = scene(ShowState::Running, 300.0);
        touching.nearest.as_mut().expect("a pair").clearance_m = -0.001;
        let parted = scene(ShowState::Running, 301.0);
        for (width, height) in [(80, 24), (60, 14), (40, 12)] {
            let mut screen = screen(Look::default(), "", &touching);
            screen.see(&parted, 0);
            assert!(text(&parted, &screen, width, height).contains("CONTACT 0-21 at 300.000 s"), "{width} by {height}");
            screen.press(KeyEvent::new(KeyCode::Char('a'), KeyModifiers::NONE), &parted, 0);
            assert!(!text(&parted, &screen, width, height).contains("CONTACT"), "{width} by {height}");
        }
    }

    #[test]
    fn alerts_are_filtered_by_their_kind() {
        let scene = scene(ShowState::Running, 300.0);
        let near = |keys| text(&scene, &screen(Look::default(), keys, &scene), 80, 24).contains("near      0-11");
        assert_eq!(["", "k", "kk", "kkk", "kkkkkkk"].map(near), [true, false, false, true, true]);
        let without = text(&scene, &screen(Look::default(), "k", &scene), 80, 24);
        assert!(without.contains("2 alerts, without near") && without.contains("restarted"), "{without}");
    }

    #[test]
    fn all_lamps_are_listed_over_the_plan() {
        let scene = scene(ShowState::Running, 300.0);
        let text = text(&scene, &screen(Look::default(), "l", &scene), 80, 24);
        for lamp in crate::display::observe::lamps(&scene, scene.seen_ns) {
            let line = format!("{:<9} {}", lamp.name, lamp.text);
            assert!(text.contains(&line), "{line} is missing in\n{text}");
        }
    }

    #[test]
    fn a_release_is_asked_for_where_replies_are() {
        let scene = scene(ShowState::Held, 300.0);
        let rows = rows(&drawn(&scene, &screen(Look::default(), "r", &scene), 80, 24));
        assert_eq!(rows[22].trim_end(), "release the hold? r again");
        assert_eq!(rows[23].trim_end(), "h hold  r release  esc leave");
    }

    #[test]
    fn alerts_of_earlier_runs_are_told_apart() {
        let mut scene = scene(ShowState::Running, 300.0);
        let mut still = (**scene.frame.as_ref().expect("a frame")).clone();
        still.header.run_id += 1;
        let restarted = crate::safety::monitor::run_alert(&still.header, bench_dragon_ipc::AlertKind::Restarted);
        scene.frame = Some(std::sync::Arc::new(still));
        let strip = text(&scene, &screen(Look::default(), "", &scene), 40, 12);
        assert!(strip.contains("near      0-11  earlier run"), "{strip}");
        std::sync::Arc::make_mut(&mut scene.alerts).push(restarted);
        let text = text(&scene, &screen(Look::default(), "", &scene), 80, 24);
        let at = |told: &str| text.find(told).unwrap_or_else(|| panic!("{told} is missing in\n{text}"));
        let order = ["3 alerts", "restarted", "earlier runs", "near  "].map(at);
        assert!(order.is_sorted(), "{text}");
    }

    #[test]
    fn the_head_stands_in_the_middle_of_a_plan_that_follows_it() {
        for time_s in [0.0, 60.0, 300.0] {
            let scene = scene(ShowState::Running, time_s);
            let rows = rows(&drawn(&scene, &screen(Look::default(), "f", &scene), 80, 24));
            let found: Vec<(usize, usize)> = rows
                .iter()
                .enumerate()
                // Lamps have the same sign.
                .filter(|(row, _)| *row != 1)
                .filter_map(|(row, text)| {
                    text.chars().position(|symbol| symbol == '\u{25cf}').map(|column| (column, row))
                })
                .collect();
            let [(column, row)] = found[..] else { panic!("one head: {found:?} in\n{}", rows.join("\n")) };
            assert!((23..=25).contains(&column) && (10..=12).contains(&row), "at column {column}, row {row}");
        }
    }
}
