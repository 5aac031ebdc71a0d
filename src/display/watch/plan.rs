//! The plan: the dragon on its route from above, drawn in dots.

use std::ops::Range;

use bench_dragon_geometry::dragon::Board;
use bench_dragon_geometry::stage::BorderKind;
use bench_dragon_ipc::HandleState;
use glam::DVec2;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::text::{Line as Text, Span};
use ratatui::widgets::canvas::{Canvas, Context, Line};

use super::camera::Viewport;
use super::look::{Theme, Tone, strong};
use super::panel::{near_m, short, tone};
use super::screen::Screen;
use crate::config::{Config, FormationDocument};
use crate::display::observe::{DescribedRun, FrameCopy, Snapshot};

/// Width in dots from which on a board is drawn as an outline. A narrower board is drawn as a line.
const OUTLINED_DOTS: f64 = 3.0;
/// Smallest distance of the route's turns, in dots, at which the route is drawn. Denser turns would fill the plan.
const ROUTE_DOTS: f64 = 4.0;
/// Greatest length of the scale, as a share of the plan's width.
const SCALE_SHARE: f64 = 0.25;

pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot, screen: &Screen) {
    let look = screen.look;
    let Some(viewport) = screen.camera.viewport(area, look.glyphs, snapshot) else { return };
    let extent = viewport.extent;
    let canvas = Canvas::default()
        .marker(look.glyphs.marker())
        .x_bounds([extent.low.x, extent.high.x])
        .y_bounds([extent.low.y, extent.high.y])
        .paint(|context| paint(context, &viewport, snapshot, screen));
    frame.render_widget(canvas, area);
    let bottom = Rect { y: area.bottom() - 1, height: 1, ..area };
    frame.render_widget(scale(&viewport, area.width, screen), bottom);
}

fn paint(context: &mut Context<'_>, viewport: &Viewport, snapshot: &Snapshot, screen: &Screen) {
    let look = screen.look;
    if let Some(run) = snapshot.run.as_ref().filter(|run| turns_are_apart(run, viewport)) {
        for ends in run.routes.iter().flat_map(|route| route.windows(2)) {
            line(context, [ends[0], ends[1]], look.theme.colour(Color::DarkGray));
        }
    }
    for border in snapshot.run.iter().flat_map(|run| run.config.stage().borders()) {
        let corners = border.corners();
        let is_closed = border.kind() != BorderKind::Crowd;
        let next = corners.iter().skip(1).chain(corners.first().filter(|_| is_closed));
        for (from, to) in corners.iter().zip(next) {
            line(context, [*from, *to], look.theme.colour(Color::Gray));
        }
    }
    let Some(copy) = snapshot.frame.as_deref() else { return };
    paint_boards(context, viewport, copy, snapshot, look.theme);
    if let Some(nearest) = snapshot.nearest {
        let tone = tone(nearest.clearance_m, near_m(snapshot)).unwrap_or(Tone::Calm);
        let cross = Span::styled(look.glyphs.signs().cross, look.theme.text(tone).patch(strong()));
        context.print(nearest.point.x, nearest.point.y, cross);
    }
    let style = strong().fg(look.theme.colour(Color::Red));
    let names = snapshot.config().and_then(Config::named).map(FormationDocument::dragons).unwrap_or_default();
    for (number, handles) in copy.dragons().into_iter().enumerate() {
        let Some(at) = copy.handles.get(handles.start).map(HandleState::plan_view_m) else { continue };
        // With several dragons, the name stands behind the sign.
        let name = names.get(number).map_or(String::new(), |named| format!(" {}", named.name));
        let name = Span::styled(name, strong().fg(look.theme.colour(dragon_colour(number))));
        context.print(at[0], at[1], Text::from(vec![Span::styled(look.glyphs.signs().head, style), name]));
    }
}

/// The colour of a dragon's boards, of the terminal's sixteen. Red is that of heads, magenta that of the nearest pair.
fn dragon_colour(number: usize) -> Color {
    const COLOURS: [Color; 8] = [
        Color::Cyan,
        Color::Yellow,
        Color::Green,
        Color::Blue,
        Color::LightCyan,
        Color::LightYellow,
        Color::LightGreen,
        Color::LightBlue,
    ];
    COLOURS[number % COLOURS.len()]
}

/// Draws the boards from the tail to the head, so that the head is on top, and then the nearest pair.
fn paint_boards(context: &mut Context<'_>, viewport: &Viewport, copy: &FrameCopy, snapshot: &Snapshot, theme: Theme) {
    let (handles, mut boards) = (&copy.handles, Vec::new());
    if let Some(run) = snapshot.run.as_ref().filter(|run| run.config.formation().layout().handles() == handles.len()) {
        run.config.formation().place_boards(handles, |handle| handle.position_m.into(), &mut boards);
    }
    let mut draw = |bench: usize, front: usize, colour: Color| {
        let colour = theme.colour(colour);
        if let Some(board) = boards.get(bench) {
            draw_board(context, viewport, board, colour);
        } else if let [front, rear] = handles.get(front..front + 2).unwrap_or_default() {
            // Without a description, only the links are known.
            line(context, [front, rear].map(|handle| handle.plan_view_m().into()), colour);
        }
    };
    // Each dragon before a handle has one bench less than handles.
    for (number, Range { start, end }) in copy.dragons().into_iter().enumerate() {
        for front in (start..end.saturating_sub(1)).rev() {
            draw(front.saturating_sub(number), front, if front == start { Color::Red } else { dragon_colour(number) });
        }
    }
    // A nearest pair is known only with a description.
    for board in snapshot.nearest.iter().flat_map(|nearest| nearest.benches).filter_map(|bench| boards.get(bench)) {
        draw_board(context, viewport, board, theme.colour(Color::Magenta));
    }
}

fn draw_board(context: &mut Context<'_>, viewport: &Viewport, board: &Board, colour: Color) {
    if !viewport.extent.reaches(board.centre, board.radius_m()) {
        return;
    }
    if 2.0 * board.half_width >= OUTLINED_DOTS * viewport.dot_m {
        let [a, b, c, d] = board.corners();
        for ends in [[a, b], [b, c], [c, d], [d, a]] {
            line(context, ends, colour);
        }
    } else {
        let along = board.half_length * board.heading;
        line(context, [board.centre - along, board.centre + along], colour);
    }
}

fn line(context: &mut Context<'_>, [from, to]: [DVec2; 2], colour: Color) {
    context.draw(&Line::new(from.x, from.y, to.x, to.y, colour));
}

fn turns_are_apart(run: &DescribedRun, viewport: &Viewport) -> bool {
    let pitches_m = run.config.formation().dragons().iter().map(|planned| planned.dragon.route().pitch_m());
    pitches_m.fold(f64::INFINITY, f64::min) >= ROUTE_DOTS * viewport.dot_m
}

/// A scale of a round length, and whether the camera follows the head.
fn scale(viewport: &Viewport, width: u16, screen: &Screen) -> Text<'static> {
    let look = screen.look;
    let longest_m = SCALE_SHARE * f64::from(width) * viewport.cell_m;
    let power = 10_f64.powf(longest_m.log10().floor());
    let length_m = [5.0, 2.0, 1.0].map(|digit| digit * power).into_iter().find(|length_m| *length_m <= longest_m);
    let Some(length_m) = length_m else { return Text::default() };
    let cells = ((length_m / viewport.cell_m).round() as usize).saturating_sub(2);
    let [begin, between, end] = look.glyphs.signs().span;
    let camera = if screen.camera.follows { "  following the head" } else { "" };
    let text = format!("{begin}{}{end} {} m{camera}", between.repeat(cells), short(length_m));
    Text::styled(text, look.theme.faint())
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::ShowState;

    use crate::display::watch::Look;
    use crate::display::watch::sample::{drawn, formation, rows, rows_after, screen_after, snapshot};

    #[test]
    fn several_dragons_have_names_at_their_heads_and_nothing_lies_between_them() {
        let snapshot = formation();
        let rows = rows(&drawn(&snapshot, &screen_after(Look::default(), "", &snapshot), 120, 36));
        let row_of = |text: &str| {
            let found: Vec<usize> = (0..rows.len()).filter(|row| rows[*row].contains(text)).collect();
            let [row] = found[..] else { panic!("{text} once: {found:?} in\n{}", rows.join("\n")) };
            row
        };
        let (silver, gold) = (row_of("\u{25cf} silver"), row_of("\u{25cf} gold"));
        assert!(silver + 2 < gold, "x right, y away:\n{}", rows.join("\n"));
        // A line may lie half a row beside its sign.
        for row in &rows[silver + 2..gold - 1] {
            let plan: String = row.chars().take(70).collect();
            let dots = plan.chars().any(|symbol| ('\u{2801}'..='\u{28ff}').contains(&symbol));
            assert!(!dots, "a board between the dragons:\n{}", rows.join("\n"));
        }
        assert!(rows.iter().any(|row| row.contains("near      gold 3-silver 0")), "{}", rows.join("\n"));
    }

    #[test]
    fn a_followed_head_is_in_the_middle_of_the_plan() {
        for time_s in [0.0, 60.0, 300.0] {
            let snapshot = snapshot(ShowState::Running, time_s);
            let rows = rows_after("f", &snapshot);
            let found: Vec<(usize, usize)> = rows
                .iter()
                .enumerate()
                // The line of lamps has the same sign.
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
