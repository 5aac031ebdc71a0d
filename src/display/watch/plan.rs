//! The plan: the dragon on its route from above, drawn in dots.

use bench_dragon_geometry::dragon::Board;
use glam::DVec2;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::text::{Line as Text, Span};
use ratatui::widgets::canvas::{Canvas, Context, Line};

use super::camera::{Viewport, head};
use super::look::{Theme, Tone, strong};
use super::panel::{near_m, short, tone};
use super::screen::Screen;
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
    if let Some(outline) = snapshot.run.as_ref().and_then(|run| run.config.outline()) {
        let corners = outline.corners();
        for (from, to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
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
    if let Some(at) = head(copy) {
        let style = strong().fg(look.theme.colour(Color::Red));
        context.print(at.x, at.y, Span::styled(look.glyphs.signs().head, style));
    }
}

/// Draws the boards from the tail to the head, so that the head is on top, and then the nearest pair.
fn paint_boards(context: &mut Context<'_>, viewport: &Viewport, copy: &FrameCopy, snapshot: &Snapshot, theme: Theme) {
    let (handles, mut boards) = (&copy.handles, Vec::new());
    if let Some(run) = snapshot.run.as_ref().filter(|run| run.config.formation().layout().handles() == handles.len()) {
        run.config.formation().place_boards(handles, |handle| handle.position_m.into(), &mut boards);
    }
    let mut draw = |bench: usize, colour: Color| {
        let colour = theme.colour(colour);
        if let Some(board) = boards.get(bench) {
            draw_board(context, viewport, board, colour);
        } else if let [front, rear] = handles.get(bench..bench + 2).unwrap_or_default() {
            // Without a description, only the links are known.
            line(context, [front, rear].map(|handle| handle.plan_view_m().into()), colour);
        }
    };
    for bench in (0..handles.len().saturating_sub(1)).rev() {
        draw(bench, if bench == 0 { Color::Red } else { Color::Cyan });
    }
    let nearest = snapshot.nearest.map(|nearest| nearest.benches);
    nearest.into_iter().flatten().for_each(|bench| draw(bench, Color::Magenta));
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
    run.config.lead().route().pitch_m() >= ROUTE_DOTS * viewport.dot_m
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

    use crate::display::watch::sample::{rows_after, snapshot};

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
