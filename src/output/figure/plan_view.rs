//! Plan of the dragon on its route, and a larger plan of two of its benches.

use bench_dragon_geometry::number::Fixed;
use glam::DVec2;
use kurbo::{Rect, Shape as _};

use super::boards::{DragonInPlan, width_m, write_names};
use super::drawing::{Drawing, Mark, circle, polyline};
use super::page::{Caption, LegendEntry, Swatch, page};
use super::plot::Plot;
use super::style::{
    AXIS_WIDTH, BLACK, BOTTOM_MARGIN, FINE_WIDTH, GREEN, LABEL_SIZE, LEFT_MARGIN, LINE_WIDTH, LineStyle, ORANGE,
    PLOT_WIDTH, PURPLE,
};
use super::text::{Anchor, Text};
use crate::output::visible_box;

/// The dragon on its route at one time. Both axes have the same scale.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanView {
    /// Caption above the plan.
    pub caption: Caption,
    /// The dragon.
    pub dragon: DragonInPlan,
    /// A circle.
    pub circle: Option<Circle>,
    /// The S of a turnaround.
    pub turn: Option<TurnMarks>,
    /// Two benches, shown larger in a second plan.
    pub pair: Option<NearestPair>,
}

/// A circle in a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Circle {
    /// Centre in metres.
    pub centre: DVec2,
    /// Radius in metres.
    pub radius_m: f64,
    /// Name in the legend.
    pub name: String,
}

/// The S of a turnaround.
#[derive(Clone, Debug, PartialEq)]
pub struct TurnMarks {
    /// Points of the two arcs.
    pub arcs: [Vec<DVec2>; 2],
    /// Points of the line between the arcs; empty without one.
    pub line: Vec<DVec2>,
    /// The seams between the spiral in, the arcs, the line and the spiral out.
    pub seams: Vec<DVec2>,
}

/// Two benches, with their clearance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestPair {
    /// The two benches.
    pub benches: [usize; 2],
    /// Their clearance in metres; 0 or less if they touch.
    pub clearance_m: f64,
    /// The nearest points of their boards: the same point twice if they touch.
    pub points: [DVec2; 2],
}

/// Free margin around the dragon ÷ its extent.
const MARGIN: f64 = 0.03;
/// Least and greatest height of a plan without a pair below it.
const HEIGHTS: [f64; 2] = [50.0, 160.0];
/// Least and greatest height of a plan with a pair below it. Both fit on a page of A4.
const HEIGHTS_OVER_PAIR: [f64; 2] = [50.0, 128.0];
const PAIR_HEIGHT: f64 = 50.0;
/// Room for the words above the pair.
const PAIR_GAP: f64 = 6.0;
const HINGE_RADIUS: f64 = 0.25;
const SEAM_RADIUS: f64 = 0.9;
const ARC_WIDTH: f64 = 0.5;
/// Height of the pair's plan, without the clearance, ÷ width of a board.
const HEIGHT_PER_WIDTH: f64 = 4.5;
/// Clearance below which the print shows 0: half of a micrometre.
const TOUCHING_M: f64 = 5e-7;
/// Least distance of the two points on the page for a measure. Nearer points are drawn as a ring.
const LEAST_MEASURE: f64 = 1.5;
/// Length of the strokes at the ends of a measure.
const END_LENGTH: f64 = 3.0;
const POINT_RADIUS: f64 = 2.0;
const NEAR_HINGE_RADIUS: f64 = 0.8;
/// Distance from the words to the plot below.
const WORDS_RISE: f64 = 3.2;

impl PlanView {
    /// Draws the figure.
    ///
    /// # Panics
    /// If a bench of the pair has no board.
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

    /// Low and high corner of the plan, which shows all boards, the circle, and the corners of the stage near them.
    fn bounds(&self) -> [DVec2; 2] {
        let circle =
            self.circle.iter().flat_map(|circle| [-1.0, 1.0].map(|side| circle.centre + side * circle.radius_m));
        let core = self.dragon.boards.iter().flatten().copied().chain(circle);
        let [low, high] = visible_box(core, self.dragon.stage.points()).expect("a dragon has boards");
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
        if let Some(turn) = &self.turn {
            entries.extend(turn.legend());
        }
        entries
    }
}

impl Circle {
    fn draw(&self, drawing: &mut Drawing, plot: &Plot) {
        let path = circle(plot.at(self.centre), self.radius_m * plot.mm_per_x());
        drawing.push(Mark::stroked(path, BLACK, FINE_WIDTH).styled(LineStyle::Dashed).clipped(plot.area));
    }
}

impl TurnMarks {
    fn draw(&self, drawing: &mut Drawing, plot: &Plot) {
        for (arc, colour) in self.arcs.iter().zip([GREEN, PURPLE]) {
            drawing.push(plot.line(arc, colour, ARC_WIDTH));
        }
        if !self.line.is_empty() {
            drawing.push(plot.line(&self.line, ORANGE, ARC_WIDTH));
        }
        for &seam in &self.seams {
            drawing.push(Mark::stroked(circle(plot.at(seam), SEAM_RADIUS), BLACK, FINE_WIDTH).clipped(plot.area));
        }
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let line = |colour| Swatch::Line { colour, width: ARC_WIDTH, style: LineStyle::Solid };
        let mut entries = vec![LegendEntry::new(line(GREEN), "first arc")];
        if !self.line.is_empty() {
            entries.push(LegendEntry::new(line(ORANGE), "line"));
        }
        entries.push(LegendEntry::new(line(PURPLE), "second arc"));
        entries.push(LegendEntry::new(Swatch::Ring { colour: BLACK, radius: SEAM_RADIUS }, "joint"));
        entries
    }
}

impl NearestPair {
    /// Name of the two benches in the legend.
    pub(super) fn kind(&self) -> &'static str {
        if self.touches() { "in touch" } else { "nearest pair" }
    }

    /// Description of the pair.
    fn words(&self) -> String {
        let [first, second] = self.benches;
        if self.touches() {
            format!("Benches {first} and {second} touch")
        } else {
            format!("Benches {first} and {second}: clearance {} mm", Fixed::<3>(1000.0 * self.clearance_m))
        }
    }

    pub(super) fn touches(&self) -> bool {
        self.clearance_m < TOUCHING_M
    }

    /// The point midway between the nearest points.
    pub(super) fn middle(&self) -> DVec2 {
        0.5 * (self.points[0] + self.points[1])
    }

    /// Draws the surroundings of the pair into an area below the plan, and their frame in the plan.
    fn draw(&self, drawing: &mut Drawing, dragon: &DragonInPlan, plan: &Plot, area: Rect) {
        let centre = self.middle();
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

    /// Draws the clearance as a measure from point to point, or as a ring if the points are too near.
    pub(super) fn draw_measure(&self, drawing: &mut Drawing, plot: &Plot) {
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
