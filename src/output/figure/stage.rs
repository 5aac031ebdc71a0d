//! The stage in a plan: its outline, hatched areas to keep out of, and the line that people stand behind.

use glam::DVec2;
use kurbo::{BezPath, Point};

use super::drawing::{Drawing, Mark, polygon, polyline};
use super::page::{LegendEntry, Swatch};
use super::plot::Plot;
use super::style::{BLACK, FINE_WIDTH, LineStyle, PURPLE};

/// Width of the line around the stage.
const STAGE_WIDTH: f64 = 0.5;
/// Width of the line of the crowd.
const CROWD_WIDTH: f64 = 0.7;
/// Distance of the lines of a hatched area, along an axis.
const HATCH_GAP: f64 = 2.0;

/// The borders of a stage. Each may be missing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StageInPlan {
    /// Corners of the outline.
    pub outline: Vec<DVec2>,
    /// Corners of each area that no board may enter.
    pub keep_out: Vec<Vec<DVec2>>,
    /// Points of the line that people stand behind.
    pub crowd: Vec<DVec2>,
}

impl StageInPlan {
    /// All corners and points.
    pub(super) fn points(&self) -> impl Iterator<Item = DVec2> {
        self.outline.iter().chain(self.keep_out.iter().flatten()).chain(&self.crowd).copied()
    }

    /// Draws the borders, clipped to the plot.
    pub(super) fn draw(&self, drawing: &mut Drawing, plot: &Plot) {
        let on_page = |points: &[DVec2]| points.iter().map(|&point| plot.at(point)).collect::<Vec<Point>>();
        for corners in self.keep_out.iter().map(|area| on_page(area)) {
            drawing.push(Mark::stroked(hatching(&corners), BLACK, FINE_WIDTH).clipped(plot.area));
            let edges = Mark::stroked(polygon(corners), BLACK, FINE_WIDTH);
            drawing.push(edges.clipped(plot.area).labelled("area to keep out of"));
        }
        if !self.outline.is_empty() {
            let edges = Mark::stroked(polygon(on_page(&self.outline)), BLACK, STAGE_WIDTH);
            drawing.push(edges.clipped(plot.area).labelled("stage"));
        }
        if !self.crowd.is_empty() {
            let line = Mark::stroked(polyline(on_page(&self.crowd)), PURPLE, CROWD_WIDTH).styled(LineStyle::Dashed);
            drawing.push(line.clipped(plot.area).labelled("line of the crowd"));
        }
    }

    /// Entries of the legend.
    pub(super) fn legend(&self) -> Vec<LegendEntry> {
        let line = |colour, width, style| Swatch::Line { colour, width, style };
        let entries = [
            (!self.outline.is_empty(), line(BLACK, STAGE_WIDTH, LineStyle::Solid), "stage"),
            (!self.keep_out.is_empty(), Swatch::Hatched, "keep out"),
            (!self.crowd.is_empty(), line(PURPLE, CROWD_WIDTH, LineStyle::Dashed), "crowd"),
        ];
        let shown = entries.into_iter().filter(|(is_shown, ..)| *is_shown);
        shown.map(|(_, swatch, words)| LegendEntry::new(swatch, words)).collect()
    }
}

/// Lines at 45° inside a polygon on the page.
pub(super) fn hatching(corners: &[Point]) -> BezPath {
    let level = |corner: &Point| (corner.x + corner.y) / HATCH_GAP;
    let levels = || corners.iter().map(level);
    let (low, high) = (levels().fold(f64::INFINITY, f64::min), levels().fold(f64::NEG_INFINITY, f64::max));
    let mut path = BezPath::new();
    let mut line = low.ceil();
    while line < high {
        let next = corners.iter().cycle().skip(1);
        let edges = corners.iter().zip(next).map(|(from, to)| (level(from), level(to), from, to));
        let crossed = edges.filter(|(from, to, ..)| (*from <= line) != (*to <= line));
        let mut crossings: Vec<Point> =
            crossed.map(|(begin, end, from, to)| from.lerp(*to, (line - begin) / (end - begin))).collect();
        crossings.sort_by(|one, other| one.x.total_cmp(&other.x));
        for ends in crossings.chunks_exact(2) {
            path.extend(polyline([ends[0], ends[1]]));
        }
        line += 1.0;
    }
    path
}

#[cfg(test)]
mod tests {
    use kurbo::{PathEl, Shape as _};

    use super::*;

    #[test]
    fn hatching_stays_inside_a_concave_area() {
        let corners = [(0.0, 0.0), (30.0, 0.0), (30.0, 30.0), (15.0, 8.0), (0.0, 30.0)].map(Point::from);
        let area = polygon(corners);
        let path = hatching(&corners);
        let ends: Vec<Point> = path.elements().iter().filter_map(PathEl::end_point).collect();
        assert!(ends.len() > 20 && ends.len().is_multiple_of(2), "{}", ends.len());
        for line in ends.chunks_exact(2) {
            assert!(area.contains(line[0].midpoint(line[1])), "{line:?}");
        }
    }
}
