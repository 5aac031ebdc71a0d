//! The dragon on its route, seen from above, in dots.

use bench_dragon_geometry::dragon::Board;
use bench_dragon_ipc::HandleState;
use glam::DVec2;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::text::{Line as Text, Span};
use ratatui::widgets::canvas::{Canvas, Context, Line};

use super::camera::{Window, head};
use super::facts::{near_m, tone};
use super::screen::Screen;
use super::theme::{Theme, Tone, strong};
use super::wording::short;
use crate::display::observe::{Run, Scene, Still};

/// A board that is so many dots wide is drawn with its outline, and as a line where it is less.
const OUTLINED_DOTS: f64 = 3.0;
/// The route is drawn where its turns are so many dots apart: nearer to each other they would fill the plan.
const ROUTE_DOTS: f64 = 4.0;
/// The longest scale, as a share of the plan's width.
const SCALE_SHARE: f64 = 0.25;

/// Draws it, with a scale.
pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, scene: &Scene, screen: &Screen) {
    let look = screen.look();
    let Some(window) = screen.camera.window(area, look.glyphs, scene) else { return };
    let extent = window.extent;
    let canvas = Canvas::default()
        .marker(look.glyphs.marker())
        .x_bounds([extent.low.x, extent.high.x])
        .y_bounds([extent.low.y, extent.high.y])
        .paint(|context| paint(context, &window, scene, screen));
    frame.render_widget(canvas, area);
    let bottom = Rect { y: area.bottom() - 1, height: 1, ..area };
    frame.render_widget(scale(&window, area.width, screen), bottom);
}

fn paint(context: &mut Context<'_>, window: &Window, scene: &Scene, screen: &Screen) {
    let look = screen.look();
    if let Some(run) = scene.run.as_ref().filter(|run| turns_are_apart(run, window)) {
        for ends in run.route.windows(2) {
            line(context, [ends[0], ends[1]], look.theme.colour(Color::DarkGray));
        }
    }
    let Some(still) = scene.frame.as_deref() else { return };
    paint_boards(context, window, still, scene, look.theme);
    if let Some(nearest) = scene.nearest {
        let tone = tone(nearest.clearance_m, near_m(scene)).unwrap_or(Tone::Calm);
        let cross = Span::styled(look.glyphs.cross(), look.theme.text(tone).patch(strong()));
        context.print(nearest.point.x, nearest.point.y, cross);
    }
    if let Some(at) = head(still) {
        let style = strong().fg(look.theme.colour(Color::Red));
        context.print(at.x, at.y, Span::styled(look.glyphs.head(), style));
    }
}

/// The tail first, so that the head lies on top, and over it the nearest pair.
fn paint_boards(context: &mut Context<'_>, window: &Window, still: &Still, scene: &Scene, theme: Theme) {
    let nearest = scene.nearest.map(|nearest| nearest.benches);
    let mut boards = Boards::of(still, scene.run.as_deref());
    boards.outlined = boards.width_m() >= OUTLINED_DOTS * window.dot_m;
    for bench in (0..boards.count()).rev() {
        let colour = if bench == 0 { Color::Red } else { Color::Cyan };
        boards.draw(context, window, bench, theme.colour(colour));
    }
    for bench in nearest.into_iter().flatten() {
        boards.draw(context, window, bench, theme.colour(Color::Magenta));
    }
}

/// The boards of a frame; without a description only the lines from hinge to hinge are known.
struct Boards<'a> {
    handles: &'a [HandleState],
    placed: Vec<Board>,
    outlined: bool,
}

impl<'a> Boards<'a> {
    fn of(still: &'a Still, run: Option<&Run>) -> Self {
        let mut placed = Vec::new();
        if let Some(run) = run.filter(|run| run.config.dragon().dimensions().handles() == still.handles.len()) {
            run.config.dragon().place_boards_at(&still.handles, seen_from_above, &mut placed);
        }
        Self { handles: &still.handles, placed, outlined: false }
    }

    fn count(&self) -> usize {
        self.handles.len().saturating_sub(1)
    }

    fn width_m(&self) -> f64 {
        self.placed.first().map_or(0.0, |board| 2.0 * board.half_width)
    }

    fn draw(&self, context: &mut Context<'_>, window: &Window, bench: usize, colour: Color) {
        let Some(board) = self.placed.get(bench) else {
            if let [front, rear] = self.handles.get(bench..bench + 2).unwrap_or_default() {
                line(context, [seen_from_above(front), seen_from_above(rear)], colour);
            }
            return;
        };
        if !window.extent.reaches(board.centre, board.radius_m()) {
            return;
        }
        if self.outlined {
            let [a, b, c, d] = board.corners();
            for ends in [[a, b], [b, c], [c, d], [d, a]] {
                line(context, ends, colour);
            }
        } else {
            let along = board.half_length * board.heading;
            line(context, [board.centre - along, board.centre + along], colour);
        }
    }
}

fn line(context: &mut Context<'_>, [from, to]: [DVec2; 2], colour: Color) {
    context.draw(&Line::new(from.x, from.y, to.x, to.y, colour));
}

fn seen_from_above(handle: &HandleState) -> DVec2 {
    DVec2::new(handle.position_m[0], handle.position_m[1])
}

fn turns_are_apart(run: &Run, window: &Window) -> bool {
    run.config.dragon().route().pitch_m() >= ROUTE_DOTS * window.dot_m
}

/// A line of a round length, and what the camera does.
fn scale(window: &Window, width: u16, screen: &Screen) -> Text<'static> {
    let look = screen.look();
    let longest_m = SCALE_SHARE * f64::from(width) * window.cell_m;
    let power = 10_f64.powf(longest_m.log10().floor());
    let length_m = [5.0, 2.0, 1.0].map(|digit| digit * power).into_iter().find(|length_m| *length_m <= longest_m);
    let Some(length_m) = length_m else { return Text::default() };
    let cells = ((length_m / window.cell_m).round() as usize).saturating_sub(2);
    let [begin, between, end] = look.glyphs.span();
    let camera = if screen.camera.follows() { "  following the head" } else { "" };
    let text = format!("{begin}{}{end} {} m{camera}", between.repeat(cells), short(length_m));
    Text::styled(text, look.theme.faint())
}
