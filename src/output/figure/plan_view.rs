//! The dragon on its route, seen from above.

use glam::DVec2;

use super::boards::{Standing, bounds};
use super::caption::Caption;
use super::drawing::Drawing;
use super::legend::{Entry, Sample};
use super::mark::{LineStyle, Mark};
use super::page::{head_height, page};
use super::pair::Pair;
use super::palette::{BLACK, GREEN, PURPLE};
use super::path::{Path, Rect};
use super::plot::Plot;
use super::style::{BOTTOM_MARGIN, FINE_WIDTH, LEFT_MARGIN, PLOT_WIDTH};

/// The dragon on its route at one time. A metre is as long on either axis.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanView {
    /// Stands over it.
    pub caption: Caption,
    /// The route from point to point; what lies far off the dragon is left out.
    pub route: Vec<DVec2>,
    /// Corners of every board, the head's first.
    pub boards: Vec<[DVec2; 4]>,
    /// Every hinge.
    pub hinges: Vec<DVec2>,
    /// A circle around the origin.
    pub circle: Option<Circle>,
    /// What a turnaround has besides.
    pub turn: Option<TurnMarks>,
    /// Two benches that a second plan shows larger.
    pub pair: Option<Pair>,
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
    /// Where the way in, the two arcs and the way out join.
    pub joints: [DVec2; 3],
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
const JOINT_RADIUS: f64 = 0.9;
const ARC_WIDTH: f64 = 0.5;

impl PlanView {
    /// Draws it.
    ///
    /// # Panics
    /// The two benches of a pair must have boards.
    pub fn draw(&self) -> Drawing {
        let [low, high] = self.bounds();
        let [least, most] = if self.pair.is_some() { HEIGHTS_OVER_PAIR } else { HEIGHTS };
        let height = (PLOT_WIDTH * (high.y - low.y) / (high.x - low.x)).clamp(least, most);
        let entries = self.legend();
        let row = height + BOTTOM_MARGIN;
        let pair_row = if self.pair.is_some() { PAIR_GAP + PAIR_HEIGHT + BOTTOM_MARGIN } else { 0.0 };
        let mut drawing = page(&self.caption, &entries, row + pair_row);
        let top = head_height(&self.caption, &entries);
        let plot = Plot::plan(Rect::new(LEFT_MARGIN, top, PLOT_WIDTH, height), low, high);
        self.standing().draw(&mut drawing, &plot);
        if let Some(circle) = &self.circle {
            circle.draw(&mut drawing, &plot);
        }
        if let Some(turn) = &self.turn {
            turn.draw(&mut drawing, &plot);
        }
        plot.draw_frame(&mut drawing);
        plot.label_x(&mut drawing, "x (m)");
        plot.label_y(&mut drawing, "y (m)");
        if let Some(pair) = &self.pair {
            let area = Rect::new(LEFT_MARGIN, top + row + PAIR_GAP, PLOT_WIDTH, PAIR_HEIGHT);
            pair.draw(&mut drawing, &self.standing(), &plot, area);
        }
        drawing
    }

    fn standing(&self) -> Standing<'_> {
        let Self { route, boards, hinges, .. } = self;
        let marked = self.pair.as_ref().map_or(&[][..], |pair| &pair.benches);
        let marked_as = self.pair.as_ref().map_or("", Pair::kind);
        Standing { route, boards, hinges, marked, marked_as, hinge_radius: HINGE_RADIUS }
    }

    /// What the plan shows: all boards, and the circle.
    fn bounds(&self) -> [DVec2; 2] {
        let radius_m = self.circle.as_ref().map_or(0.0, |circle| circle.radius_m);
        let circle = [DVec2::splat(-radius_m), DVec2::splat(radius_m)];
        let [low, high] = bounds(self.boards.iter().flatten().copied().chain(circle), 0.0);
        let margin_m = MARGIN * (high - low).max_element();
        [low - margin_m, high + margin_m]
    }

    fn legend(&self) -> Vec<Entry> {
        let mut entries = self.standing().legend();
        if let Some(circle) = &self.circle {
            let sample = Sample::Line { colour: BLACK, width: FINE_WIDTH, style: LineStyle::Dashed };
            entries.push(Entry::new(sample, circle.name.as_str()));
        }
        if self.turn.is_some() {
            entries.extend(TurnMarks::legend());
        }
        entries
    }
}

impl Circle {
    fn draw(&self, drawing: &mut Drawing, plot: &Plot) {
        let circle = Path::circle(plot.at(DVec2::ZERO), self.radius_m * plot.mm_per_x());
        drawing.push(Mark::stroked(circle, BLACK, FINE_WIDTH).styled(LineStyle::Dashed).clipped(plot.area));
    }
}

impl TurnMarks {
    fn draw(&self, drawing: &mut Drawing, plot: &Plot) {
        for (arc, colour) in self.arcs.iter().zip([GREEN, PURPLE]) {
            drawing.push(plot.line(arc, colour, ARC_WIDTH));
        }
        for joint in self.joints {
            drawing
                .push(Mark::stroked(Path::circle(plot.at(joint), JOINT_RADIUS), BLACK, FINE_WIDTH).clipped(plot.area));
        }
    }

    fn legend() -> [Entry; 3] {
        let line = |colour| Sample::Line { colour, width: ARC_WIDTH, style: LineStyle::Solid };
        [
            Entry::new(line(GREEN), "first arc"),
            Entry::new(line(PURPLE), "second arc"),
            Entry::new(Sample::Ring { colour: BLACK, radius: JOINT_RADIUS }, "joint"),
        ]
    }
}
