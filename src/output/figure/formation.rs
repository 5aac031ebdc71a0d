//! Plan of several dragons on one stage, each in its own colour.

use glam::DVec2;
use kurbo::Rect;

use super::boards::DragonInPlan;
use super::drawing::{Drawing, Mark, circle};
use super::page::{Caption, LegendEntry, Swatch, page};
use super::plot::Plot;
use super::style::{BLACK, BOTTOM_MARGIN, Colour, FINE_WIDTH, LEFT_MARGIN, LINE_WIDTH, LINES, LineStyle, PLOT_WIDTH};
use crate::output::visible_box;

/// Several dragons on their routes at one plan time. Both axes have the same scale.
#[derive(Clone, Debug, PartialEq)]
pub struct FormationView {
    /// Caption above the plan.
    pub caption: Caption,
    /// The dragons, the leading one first.
    pub dragons: Vec<NamedInPlan>,
    /// A point at which two boards touch or are near.
    pub mark: Option<DVec2>,
    /// Whether the plan shows all of the routes, and not only what is near boards.
    pub shows_routes: bool,
}

/// A dragon of several, with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedInPlan {
    /// Name in the legend.
    pub name: String,
    /// Red, green and blue of its boards; without them, a colour of the palette.
    pub colour: Option<[u8; 3]>,
    /// The dragon.
    pub dragon: DragonInPlan,
}

/// Free margin around the dragons ÷ their extent.
const MARGIN: f64 = 0.03;
/// Least and greatest height of the plan.
const HEIGHTS: [f64; 2] = [50.0, 160.0];
const OUTLINE_WIDTH: f64 = 0.1;
const MARK_RADIUS: f64 = 2.0;

impl FormationView {
    /// Draws the figure.
    ///
    /// # Panics
    /// Panics without a dragon.
    pub fn draw(&self) -> Drawing {
        let [low, high] = self.bounds();
        let height = (PLOT_WIDTH * (high.y - low.y) / (high.x - low.x)).clamp(HEIGHTS[0], HEIGHTS[1]);
        let (mut drawing, top) = page(&self.caption, &self.legend(), height + BOTTOM_MARGIN);
        let plot = Plot::plan(Rect::from_origin_size((LEFT_MARGIN, top), (PLOT_WIDTH, height)), low, high);
        self.dragons[0].dragon.stage.draw(&mut drawing, &plot);
        for (number, named) in self.dragons.iter().enumerate() {
            drawing.push(plot.line(&named.dragon.route, named.colour(number), FINE_WIDTH));
        }
        for (number, named) in self.dragons.iter().enumerate() {
            named.draw(&mut drawing, &plot, named.colour(number));
        }
        if let Some(point) = self.mark {
            drawing
                .push(Mark::stroked(circle(plot.at(point), MARK_RADIUS), BLACK, LINE_WIDTH).labelled("nearest boards"));
        }
        plot.draw_frame(&mut drawing);
        plot.label(&mut drawing, "x (m)", "y (m)");
        drawing
    }

    /// Low and high corner of the plan, which shows all boards, the routes if they are to be seen, and the corners of the stage near
    /// them.
    fn bounds(&self) -> [DVec2; 2] {
        let core = self.dragons.iter().flat_map(|named| named.dragon.boards.iter().flatten().copied());
        let routes =
            self.dragons.iter().filter(|_| self.shows_routes).flat_map(|named| named.dragon.route.iter().copied());
        let stage = self.dragons[0].dragon.stage.points();
        let [low, high] = visible_box(core.chain(routes), stage).expect("a dragon has boards");
        let margin_m = MARGIN * (high - low).max_element();
        [low - margin_m, high + margin_m]
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let name = |(number, named): (usize, &NamedInPlan)| {
            LegendEntry::new(Swatch::Area(named.colour(number)), named.name.as_str())
        };
        let mut entries: Vec<LegendEntry> = self.dragons.iter().enumerate().map(name).collect();
        entries.push(LegendEntry::new(Swatch::Area(BLACK), "heads"));
        let route = Swatch::Line { colour: self.dragons[0].colour(0), width: FINE_WIDTH, style: LineStyle::Solid };
        entries.push(LegendEntry::new(route, "route"));
        entries.extend(self.dragons[0].dragon.stage.legend());
        entries
    }
}

impl NamedInPlan {
    fn colour(&self, number: usize) -> Colour {
        dragon_colour(self.colour, number)
    }

    /// Draws the boards from the tail to the head, which is black.
    fn draw(&self, drawing: &mut Drawing, plot: &Plot, colour: Colour) {
        for (bench, corners) in self.dragon.boards.iter().enumerate().rev() {
            let board = plot.polygon(corners, if bench == 0 { BLACK } else { colour });
            drawing.push(board.outlined(BLACK, OUTLINE_WIDTH).labelled(format!("{} bench {bench}", self.name)));
        }
    }
}

/// The colour of a dragon: its own, or that of its number.
pub(super) fn dragon_colour(own: Option<[u8; 3]>, number: usize) -> Colour {
    // The last colour of lines is black, as the heads are.
    let palette = &LINES[..LINES.len() - 1];
    own.map_or(palette[number % palette.len()], Colour)
}
