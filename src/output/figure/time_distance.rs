//! Time–distance chart of several dragons: how far each has walked over plan time, and where it passes the others.

use glam::DVec2;
use kurbo::Rect;

use super::drawing::{Drawing, Mark, circle};
use super::formation::dragon_colour;
use super::page::{Caption, LegendEntry, Swatch, page};
use super::plot::{Plot, range_of};
use super::style::{BLACK, BOTTOM_MARGIN, Colour, FINE_WIDTH, LEFT_MARGIN, LINE_WIDTH, LineStyle, PLOT_WIDTH};

/// Dragons over plan time.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeDistanceChart {
    /// Caption above the chart.
    pub caption: Caption,
    /// The dragons, the leading one first.
    pub dragons: Vec<DragonLine>,
    /// Their crossings.
    pub passings: Vec<PassingMark>,
}

/// How far a dragon has walked since it left.
#[derive(Clone, Debug, PartialEq)]
pub struct DragonLine {
    /// Name in the legend.
    pub name: String,
    /// Red, green and blue of its line; without them, a colour of the palette.
    pub colour: Option<[u8; 3]>,
    /// Plan time in seconds and metres walked, in order.
    pub points: Vec<DVec2>,
}

/// A crossing of two dragons.
#[derive(Clone, Debug, PartialEq)]
pub struct PassingMark {
    /// Indices of the dragons.
    pub dragons: [usize; 2],
    /// The part of each dragon's line on which it is in the way of the other one.
    pub parts: [Vec<DVec2>; 2],
    /// From where the first dragon has passed to where the other one gets there; `None` if they meet.
    pub wait: Option<[DVec2; 2]>,
    /// Whether this is the tightest crossing of one of the dragons. Only then the wait is drawn.
    pub is_tightest: bool,
}

const HEIGHT: f64 = 110.0;
const MARGIN: f64 = 0.03;
const RING_RADIUS: f64 = 0.8;
const PART_WIDTH: f64 = 1.1;

impl TimeDistanceChart {
    /// Draws the figure.
    pub fn draw(&self) -> Drawing {
        let (mut drawing, top) = page(&self.caption, &self.legend(), HEIGHT + BOTTOM_MARGIN);
        let area = Rect::from_origin_size((LEFT_MARGIN, top), (PLOT_WIDTH, HEIGHT));
        let points = || self.dragons.iter().flat_map(|dragon| &dragon.points);
        let [times_s, walked_m] =
            [range_of(points().map(|point| point.x), MARGIN), range_of(points().map(|point| point.y), MARGIN)];
        let plot = Plot::new(area, &times_s, &walked_m);
        plot.draw_grid(&mut drawing);
        for passing in &self.passings {
            let [one, other] = passing.dragons.map(|dragon| &*self.dragons[dragon].name);
            for (dragon, part) in passing.dragons.into_iter().zip(&passing.parts) {
                let line = plot.line(part, self.colour(dragon), PART_WIDTH);
                drawing.push(line.labelled(format!("{one} and {other}")));
            }
        }
        for (number, dragon) in self.dragons.iter().enumerate() {
            let line = plot.line(&dragon.points, self.colour(number), LINE_WIDTH);
            drawing.push(line.labelled(dragon.name.as_str()));
        }
        for passing in &self.passings {
            let Some(ends) = passing.wait else { continue };
            if passing.is_tightest {
                drawing.push(plot.line(&ends, BLACK, FINE_WIDTH).styled(LineStyle::Dashed));
            }
            let ring = Mark::stroked(circle(plot.at(ends[0]), RING_RADIUS), BLACK, FINE_WIDTH);
            drawing.push(ring.clipped(area).labelled("has passed"));
        }
        plot.draw_frame(&mut drawing);
        plot.label(&mut drawing, "plan time (s)", "walked (m)");
        drawing
    }

    fn colour(&self, dragon: usize) -> Colour {
        dragon_colour(self.dragons[dragon].colour, dragon)
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let line = |colour: Colour, width: f64, style: LineStyle| Swatch::Line { colour, width, style };
        let names = self.dragons.iter().enumerate().map(|(number, dragon)| {
            LegendEntry::new(line(self.colour(number), LINE_WIDTH, LineStyle::Solid), dragon.name.as_str())
        });
        let mut entries: Vec<LegendEntry> = names.collect();
        if !self.passings.is_empty() {
            entries.push(LegendEntry::new(line(self.colour(0), PART_WIDTH, LineStyle::Solid), "in the way of another"));
            entries.push(LegendEntry::new(Swatch::Ring { colour: BLACK, radius: RING_RADIUS }, "has passed"));
            entries.push(LegendEntry::new(
                line(BLACK, FINE_WIDTH, LineStyle::Dashed),
                "until the other gets there, where tightest",
            ));
        }
        entries
    }
}
