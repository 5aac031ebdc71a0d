//! The dragon on its route, seen from above.

use glam::DVec2;

use super::boards::{Standing, bounds};
use super::drawing::Drawing;
use super::legend::{Entry, Sample};
use super::mark::{LineStyle, Mark};
use super::page::{PLOT_WIDTH, head_height, page};
use super::palette::{BLACK, GREEN, PURPLE};
use super::path::{Path, Rect};
use super::plot::Plot;
use super::style::{BOTTOM_MARGIN, FINE_WIDTH, LEFT_MARGIN};

/// The dragon on its route at one time. A metre is as long on either axis.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanView {
    /// Stands over the plan.
    pub title: String,
    /// The route from point to point; what lies far off the dragon is left out.
    pub route: Vec<DVec2>,
    /// Corners of every board, the head's first.
    pub boards: Vec<[DVec2; 4]>,
    /// Every hinge.
    pub hinges: Vec<DVec2>,
    /// What a turnaround has besides.
    pub turn: Option<TurnMarks>,
}

/// The turning circle, around the origin, and the S in it.
#[derive(Clone, Debug, PartialEq)]
pub struct TurnMarks {
    /// Radius of the turning circle.
    pub radius_m: f64,
    /// The two arcs from point to point.
    pub arcs: [Vec<DVec2>; 2],
    /// Where the way in, the two arcs and the way out join.
    pub joints: [DVec2; 3],
}

/// Share of the dragon's extent that is left free around it.
const MARGIN: f64 = 0.03;
/// Heights of a plan on the page.
const HEIGHTS: [f64; 2] = [50.0, 160.0];
const JOINT_RADIUS: f64 = 0.9;
const ARC_WIDTH: f64 = 0.5;

impl PlanView {
    /// Draws it.
    pub fn draw(&self) -> Drawing {
        let [low, high] = self.bounds();
        let height = (PLOT_WIDTH * (high.y - low.y) / (high.x - low.x)).clamp(HEIGHTS[0], HEIGHTS[1]);
        let entries = self.legend();
        let mut drawing = page(&self.title, &entries, height + BOTTOM_MARGIN);
        let plot = Plot::plan(Rect::new(LEFT_MARGIN, head_height(&entries), PLOT_WIDTH, height), low, high);
        self.standing().draw(&mut drawing, &plot);
        if let Some(turn) = &self.turn {
            turn.draw(&mut drawing, &plot);
        }
        plot.draw_frame(&mut drawing);
        plot.label_x(&mut drawing, "x (m)");
        plot.label_y(&mut drawing, "y (m)");
        drawing
    }

    fn standing(&self) -> Standing<'_> {
        Standing { route: &self.route, boards: &self.boards, hinges: &self.hinges, touching: &[], hinge_radius: 0.25 }
    }

    /// What the plan shows: all boards, and the turning circle.
    fn bounds(&self) -> [DVec2; 2] {
        let radius_m = self.turn.as_ref().map_or(0.0, |turn| turn.radius_m);
        let circle = [DVec2::splat(-radius_m), DVec2::splat(radius_m)];
        let [low, high] = bounds(self.boards.iter().flatten().copied().chain(circle), 0.0);
        let margin_m = MARGIN * (high - low).max_element();
        [low - margin_m, high + margin_m]
    }

    fn legend(&self) -> Vec<Entry> {
        let mut entries = self.standing().legend();
        if self.turn.is_some() {
            entries.extend(TurnMarks::legend());
        }
        entries
    }
}

impl TurnMarks {
    fn draw(&self, drawing: &mut Drawing, plot: &Plot) {
        let circle = Path::circle(plot.at(DVec2::ZERO), self.radius_m * plot.mm_per_x());
        drawing.push(Mark::stroked(circle, BLACK, FINE_WIDTH).styled(LineStyle::Dashed).clipped(plot.area));
        for (arc, colour) in self.arcs.iter().zip([GREEN, PURPLE]) {
            drawing.push(plot.line(arc, colour, ARC_WIDTH));
        }
        for joint in self.joints {
            drawing
                .push(Mark::stroked(Path::circle(plot.at(joint), JOINT_RADIUS), BLACK, FINE_WIDTH).clipped(plot.area));
        }
    }

    fn legend() -> [Entry; 4] {
        let line = |colour, width, style| Sample::Line { colour, width, style };
        [
            Entry::new(line(BLACK, FINE_WIDTH, LineStyle::Dashed), "turning circle"),
            Entry::new(line(GREEN, ARC_WIDTH, LineStyle::Solid), "first arc"),
            Entry::new(line(PURPLE, ARC_WIDTH, LineStyle::Solid), "second arc"),
            Entry::new(Sample::Ring { colour: BLACK, radius: JOINT_RADIUS }, "joint"),
        ]
    }
}
