//! Boards, hinges and the route in a plan.

use glam::DVec2;

use super::drawing::Drawing;
use super::legend::{Entry, Sample};
use super::mark::LineStyle;
use super::palette::{BLACK, Colour, GREY, ORANGE, SKY_BLUE, VERMILION};
use super::plot::Plot;
use super::style::FINE_WIDTH;

/// Width of a board's outline.
const OUTLINE_WIDTH: f64 = 0.1;

/// What stands on the route, head first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Standing<'a> {
    pub(super) route: &'a [DVec2],
    pub(super) boards: &'a [[DVec2; 4]],
    pub(super) hinges: &'a [DVec2],
    /// Benches that are set apart by their colour.
    pub(super) marked: &'a [usize],
    /// What they are, for the legend.
    pub(super) marked_as: &'static str,
    /// Radius of a hinge on the page.
    pub(super) hinge_radius: f64,
}

impl Standing<'_> {
    /// Draws all that lies in the plot: the route, the boards over it from the tail on, the hinges over them.
    pub(super) fn draw(&self, drawing: &mut Drawing, plot: &Plot) {
        drawing.push(plot.line(self.route, GREY, FINE_WIDTH));
        for (bench, corners) in self.boards.iter().enumerate().rev() {
            let board = plot.polygon(corners, self.colour(bench)).outlined(BLACK, OUTLINE_WIDTH);
            drawing.push(board.labelled(format!("bench {bench}")));
        }
        for hinge in self.hinges {
            drawing.push(plot.dot(*hinge, self.hinge_radius, BLACK).clipped(plot.area));
        }
    }

    fn colour(&self, bench: usize) -> Colour {
        match bench {
            0 => VERMILION,
            _ if self.marked.contains(&bench) => ORANGE,
            _ => SKY_BLUE,
        }
    }

    pub(super) fn legend(&self) -> Vec<Entry> {
        let line = Sample::Line { colour: GREY, width: FINE_WIDTH, style: LineStyle::Solid };
        let mut entries = vec![Entry::new(Sample::Area(VERMILION), "head")];
        if self.marked.iter().any(|bench| *bench > 0) {
            entries.push(Entry::new(Sample::Area(ORANGE), self.marked_as));
        }
        if self.boards.len() > 1 {
            entries.push(Entry::new(Sample::Area(SKY_BLUE), "bench"));
        }
        entries.push(Entry::new(Sample::Dot { colour: BLACK, radius: self.hinge_radius.max(0.3) }, "hinge"));
        entries.push(Entry::new(line, "route"));
        entries
    }
}

/// Width of a board in metres.
pub(super) fn width_m([front_left, _, _, front_right]: &[DVec2; 4]) -> f64 {
    front_left.distance(*front_right)
}

/// The corners between which all points lie, with a margin in metres.
pub(super) fn bounds(points: impl IntoIterator<Item = DVec2>, margin_m: f64) -> [DVec2; 2] {
    let empty = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    let [low, high] = points.into_iter().fold(empty, |[low, high], point| [low.min(point), high.max(point)]);
    [low - margin_m, high + margin_m]
}
