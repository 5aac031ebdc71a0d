//! The dragon on its route, seen from above, and two of its benches from near.

use glam::DVec2;
use kurbo::{Rect, Shape as _};

use super::boards::{DragonInPlan, bounds, width_m, write_names};
use super::drawing::{Drawing, Mark, circle, polyline};
use super::page::{Caption, LegendEntry, Swatch, page};
use super::plot::Plot;
use super::style::{
    AXIS_WIDTH, BLACK, BOTTOM_MARGIN, FINE_WIDTH, GREEN, LABEL_SIZE, LEFT_MARGIN, LINE_WIDTH, LineStyle, PLOT_WIDTH,
    PURPLE,
};
use super::text::{Anchor, Text};

/// The dragon on its route at one time. A metre is as long on either axis.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanView {
    /// Stands over it.
    pub caption: Caption,
    /// The dragon.
    pub dragon: DragonInPlan,
    /// A circle around the origin.
    pub circle: Option<Circle>,
    /// What a turnaround has besides.
    pub turn: Option<TurnMarks>,
    /// Two benches that a second plan shows larger.
    pub pair: Option<NearestPair>,
}

/// A circle around the origin that a plan shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Circle {
    /// Metres.
    pub radius_m: f64,
    /// What it is.
    pub name: String,
}

/// The S of a turnaround.
#[derive(Clone, Debug, PartialEq)]
pub struct TurnMarks {
    /// The two arcs from point to point.
    pub arcs: [Vec<DVec2>; 2],
    /// The joints of the spiral in, the two arcs and the spiral out.
    pub seams: [DVec2; 3],
}

/// Two benches whose clearance is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestPair {
    /// The two benches.
    pub benches: [usize; 2],
    /// Their clearance in metres; 0 or less where they touch.
    pub clearance_m: f64,
    /// The nearest points of their boards: where they touch, the same point twice.
    pub points: [DVec2; 2],
}

/// Share of the dragon's extent that is left free around it.
const MARGIN: f64 = 0.03;
/// Heights of a plan on the page, the larger one without a pair below it.
const HEIGHTS: [f64; 2] = [50.0, 160.0];
/// The same with a pair below it, so that a page of A4 holds both.
const HEIGHTS_OVER_PAIR: [f64; 2] = [50.0, 128.0];
const PAIR_HEIGHT: f64 = 50.0;
/// Room for the words over the pair.
const PAIR_GAP: f64 = 6.0;
const HINGE_RADIUS: f64 = 0.25;
const SEAM_RADIUS: f64 = 0.9;
const ARC_WIDTH: f64 = 0.5;
/// Height of what is shown ÷ width of a board, beside the clearance.
const HEIGHT_PER_WIDTH: f64 = 4.5;
/// A clearance that is printed as 0: half of a micrometre.
const TOUCHING_M: f64 = 5e-7;
/// Least distance of the two points on the page that is drawn as a measure, and not as a point.
const LEAST_MEASURE: f64 = 1.5;
/// Length of the strokes at the ends of a measure.
const END_LENGTH: f64 = 3.0;
const POINT_RADIUS: f64 = 2.0;
const NEAR_HINGE_RADIUS: f64 = 0.8;
/// From the words to the plot below.
const WORDS_RISE: f64 = 3.2;

impl PlanView {
    /// Draws it.
    ///
    /// # Panics
    /// The two benches of a pair must have boards.
    pub fn draw(&self) -> Drawing {
        let [low, high] = self.bounds();
        let [least, most] = if self.pair.is_some() { HEIGHTS_OVER_PAIR } else { HEIGHTS };
        let height = (PLOT_WIDTH * (high.y - low.y) / (high.x - low.x)).clamp(least, most);
        let row = height + BOTTOM_MARGIN;
        let pair_row = if self.pair.is_some() { PAIR_GAP + PAIR_HEIGHT + BOTTOM_MARGIN } else { 0.0 };
        let (mut drawing, top) = page(&self.caption, &self.legend(), row + pair_row);
        let area = |top: f64, height: f64| Rect::from_origin_size((LEFT_MARGIN, top), (PLOT_WIDTH, height));
        let plot = Plot::plan(area(top, height), low, high);
        self.dragon.draw(&mut drawing, &plot, self.marked(), HINGE_RADIUS);
        if let Some(circle) = &self.circle {
            circle.draw(&mut drawing, &plot);
        }
        if let Some(turn) = &self.turn {
            turn.draw(&mut drawing, &plot);
        }
        plot.draw_frame(&mut drawing);
        plot.label(&mut drawing, "x (m)", "y (m)");
        if let Some(pair) = &self.pair {
            pair.draw(&mut drawing, &self.dragon, &plot, area(top + row + PAIR_GAP, PAIR_HEIGHT));
        }
        drawing
    }

    fn marked(&self) -> &[usize] {
        self.pair.as_ref().map_or(&[], |pair| &pair.benches)
    }

    /// What the plan shows: all boards, and the circle.
    fn bounds(&self) -> [DVec2; 2] {
        let radius_m = self.circle.as_ref().map_or(0.0, |circle| circle.radius_m);
        let circle = [DVec2::splat(-radius_m), DVec2::splat(radius_m)];
        let [low, high] = bounds(self.dragon.boards.iter().flatten().copied().chain(circle), 0.0);
        let margin_m = MARGIN * (high - low).max_element();
        [low - margin_m, high + margin_m]
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let marked_as = self.pair.as_ref().map_or("", NearestPair::kind);
        let mut entries = self.dragon.legend(self.marked(), marked_as, HINGE_RADIUS);
        if let Some(circle) = &self.circle {
            let swatch = Swatch::Line { colour: BLACK, width: FINE_WIDTH, style: LineStyle::Dashed };
            entries.push(LegendEntry::new(swatch, circle.name.as_str()));
        }
        if self.turn.is_some() {
            entries.extend(TurnMarks::legend());
        }
        entries
    }
}

impl Circle {
    fn draw(&self, drawing: &mut Drawing, plot: &Plot) {
        let path = circle(plot.at(DVec2::ZERO), self.radius_m * plot.mm_per_x());
        drawing.push(Mark::stroked(path, BLACK, FINE_WIDTH).styled(LineStyle::Dashed).clipped(plot.area));
    }
}

impl TurnMarks {
    fn draw(&self, drawing: &mut Drawing, plot: &Plot) {
        for (arc, colour) in self.arcs.iter().zip([GREEN, PURPLE]) {
            drawing.push(plot.line(arc, colour, ARC_WIDTH));
        }
        for seam in self.seams {
            drawing.push(Mark::stroked(circle(plot.at(seam), SEAM_RADIUS), BLACK, FINE_WIDTH).clipped(plot.area));
        }
    }

    fn legend() -> [LegendEntry; 3] {
        let line = |colour| Swatch::Line { colour, width: ARC_WIDTH, style: LineStyle::Solid };
        [
            LegendEntry::new(line(GREEN), "first arc"),
            LegendEntry::new(line(PURPLE), "second arc"),
            LegendEntry::new(Swatch::Ring { colour: BLACK, radius: SEAM_RADIUS }, "joint"),
        ]
    }
}

impl NearestPair {
    /// What the two benches are, for the legend.
    fn kind(&self) -> &'static str {
        if self.touches() { "in touch" } else { "nearest pair" }
    }

    /// The pair as people read it.
    fn words(&self) -> String {
        let [first, second] = self.benches;
        if self.touches() {
            format!("Benches {first} and {second} touch")
        } else {
            format!("Benches {first} and {second}: clearance {:.3} mm", 1000.0 * self.clearance_m)
        }
    }

    fn touches(&self) -> bool {
        self.clearance_m < TOUCHING_M
    }

    /// Draws the pair's surroundings into an area below the plan that shows all, and the frame of it in that plan.
    fn draw(&self, drawing: &mut Drawing, dragon: &DragonInPlan, plan: &Plot, area: Rect) {
        let centre = 0.5 * (self.points[0] + self.points[1]);
        let height_m = HEIGHT_PER_WIDTH * width_m(&dragon.boards[self.benches[0]]) + 2.0 * self.clearance_m.max(0.0);
        let half = 0.5 * height_m * DVec2::new(area.width() / area.height(), 1.0);
        let plot = Plot::plan(area, centre - half, centre + half);
        dragon.draw(drawing, &plot, &self.benches, NEAR_HINGE_RADIUS);
        self.draw_measure(drawing, &plot);
        let obstacles: Vec<DVec2> = dragon.hinges.iter().chain(&self.points).copied().collect();
        write_names(drawing, &plot, &dragon.boards, &self.benches, &obstacles);
        plot.draw_frame(drawing);
        plot.label(drawing, "x (m)", "y (m)");
        let words = Text::new(self.words(), LABEL_SIZE).anchored(Anchor::Left);
        drawing.write(&words, area.origin() - (0.0, WORDS_RISE));
        let shown = Rect::from_points(plan.at(centre - half), plan.at(centre + half));
        let frame = Mark::stroked(shown.to_path(0.0), BLACK, LINE_WIDTH).clipped(plan.area);
        drawing.push(frame.labelled("shown larger below"));
    }

    /// Draws the clearance as a measure from point to point, or a ring where they are too near for one.
    fn draw_measure(&self, drawing: &mut Drawing, plot: &Plot) {
        let [from, to] = self.points.map(|point| plot.at(point));
        if from.distance(to) < LEAST_MEASURE {
            let ring = circle(from.midpoint(to), POINT_RADIUS);
            drawing.push(Mark::stroked(ring, BLACK, LINE_WIDTH).clipped(plot.area).labelled(self.words()));
            return;
        }
        let end = 0.5 * END_LENGTH * (to - from).normalize().turn_90();
        let mut path = polyline([from, to]);
        for point in [from, to] {
            path.extend(polyline([point - end, point + end]));
        }
        drawing.push(Mark::stroked(path, BLACK, 2.0 * AXIS_WIDTH).clipped(plot.area).labelled(self.words()));
    }
}
