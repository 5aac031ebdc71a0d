//! Plan of a whole route: its crossings, its tightest bend, its end, and the dragon at the end of its run.

use glam::DVec2;
use kurbo::Rect;

use super::boards::DragonInPlan;
use super::drawing::{Drawing, Mark, circle};
use super::page::{Caption, LegendEntry, Swatch, page};
use super::plot::Plot;
use super::style::{
    BLACK, BLUE, BOTTOM_MARGIN, Colour, FINE_WIDTH, GREEN, GREY, LEFT_MARGIN, LINE_WIDTH, LineStyle, ORANGE,
    PLOT_WIDTH, PURPLE, VERMILION,
};
use crate::output::visible_box;

/// A route from above. Both axes have the same scale.
#[derive(Clone, Debug, PartialEq)]
pub struct RouteView {
    /// Caption above the plan.
    pub caption: Caption,
    /// The dragon at the end of its run, without boards if it cannot stand; and the route behind the start.
    pub dragon: DragonInPlan,
    /// Points of the route that the head walks.
    pub walked: Vec<DVec2>,
    /// Points of the route beyond the end of the run.
    pub beyond: Vec<DVec2>,
    /// Points at which the route crosses itself.
    pub crossings: Vec<DVec2>,
    /// The tightest bend.
    pub tightest: Option<DVec2>,
    /// The place that a bench cannot follow.
    pub tight_spot: Option<DVec2>,
    /// The point at which the first board leaves the stage.
    pub leaving: Option<DVec2>,
}

/// Free margin around the route ÷ its extent.
const MARGIN: f64 = 0.03;
/// Least and greatest height of the plan.
const HEIGHTS: [f64; 2] = [50.0, 160.0];
const HINGE_RADIUS: f64 = 0.2;
const RING_RADIUS: f64 = 1.3;
const END_RADIUS: f64 = 0.9;
/// Most marked crossings. More would hide the route.
const MOST_CROSSINGS: usize = 1000;

impl RouteView {
    /// Draws the figure.
    ///
    /// # Panics
    /// Panics for a route without points.
    pub fn draw(&self) -> Drawing {
        let [low, high] = self.bounds();
        let [least, most] = HEIGHTS;
        let height = (PLOT_WIDTH * (high.y - low.y) / (high.x - low.x)).clamp(least, most);
        let (mut drawing, top) = page(&self.caption, &self.legend(), height + BOTTOM_MARGIN);
        let plot = Plot::plan(Rect::from_origin_size((LEFT_MARGIN, top), (PLOT_WIDTH, height)), low, high);
        drawing.push(plot.line(&self.beyond, GREY, FINE_WIDTH));
        drawing.push(plot.line(&self.walked, BLUE, LINE_WIDTH).labelled("route"));
        self.dragon.draw(&mut drawing, &plot, &[], HINGE_RADIUS);
        for (colour, name, points) in self.marks() {
            for point in points.iter().take(MOST_CROSSINGS) {
                let ring = circle(plot.at(*point), RING_RADIUS);
                drawing.push(Mark::stroked(ring, colour, LINE_WIDTH).clipped(plot.area).labelled(name));
            }
        }
        drawing.push(plot.dot(self.end(), END_RADIUS, BLACK).labelled("end of the route"));
        plot.draw_frame(&mut drawing);
        plot.label(&mut drawing, "x (m)", "y (m)");
        drawing
    }

    fn end(&self) -> DVec2 {
        *self.beyond.last().expect("a route has points")
    }

    /// The rings: colour, name and points.
    fn marks(&self) -> [(Colour, &'static str, &[DVec2]); 4] {
        [
            (PURPLE, "crossing", &self.crossings),
            (GREEN, "tightest bend", self.tightest.as_slice()),
            (VERMILION, "a bench cannot follow", self.tight_spot.as_slice()),
            (ORANGE, "a board leaves the stage", self.leaving.as_slice()),
        ]
    }

    /// Low and high corner of the plan.
    fn bounds(&self) -> [DVec2; 2] {
        let core = self.walked.iter().chain(&self.beyond).copied().chain(self.dragon.stage.points());
        let rest = self.dragon.route.iter().chain(self.dragon.boards.iter().flatten()).copied();
        let [low, high] = visible_box(core, rest).expect("a route has points");
        let margin_m = MARGIN * (high - low).max_element();
        [low - margin_m, high + margin_m]
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let mut entries = self.dragon.legend(&[], "", HINGE_RADIUS);
        let line = Swatch::Line { colour: BLUE, width: LINE_WIDTH, style: LineStyle::Solid };
        entries.push(LegendEntry::new(line, "walked by the head"));
        entries.push(LegendEntry::new(Swatch::Dot { colour: BLACK, radius: END_RADIUS }, "end of the route"));
        let marks = self.marks().into_iter().filter(|(_, _, points)| !points.is_empty());
        entries.extend(
            marks.map(|(colour, name, _)| LegendEntry::new(Swatch::Ring { colour, radius: RING_RADIUS }, name)),
        );
        entries
    }
}
