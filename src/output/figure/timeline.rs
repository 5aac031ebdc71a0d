//! Plot of a show over the time of day: the least clearance, the states of the show, and its events.

use glam::DVec2;
use kurbo::{Point, Rect, Shape as _};

use super::drawing::{Drawing, Mark, polyline};
use super::page::{Caption, LegendEntry, Swatch, page};
use super::plot::{Plot, range_of};
use super::style::{
    AXIS_WIDTH, BLACK, BLUE, BOTTOM_MARGIN, Colour, FINE_WIDTH, GREEN, GREY, LEFT_MARGIN, LIGHT_GREY, LINE_WIDTH,
    LineStyle, ORANGE, PLOT_WIDTH, PURPLE, SKY_BLUE, TICK_SIZE, VERMILION, Y_TICK_GAP,
};
use super::text::{Anchor, Text};

/// A show over the time of day. Each lane is a row of events above the plot of the clearance.
#[derive(Clone, Debug, PartialEq)]
pub struct ShowTimeline {
    /// Caption above the plot.
    pub caption: Caption,
    /// Time of day at second 0, in seconds after midnight.
    pub clock_s: f64,
    /// The end in seconds after second 0.
    pub end_s: f64,
    /// Lines of the least clearance: seconds and metres. Between two lines it is unknown.
    pub clearance: Vec<Vec<DVec2>>,
    /// Limits of the clearance in metres, with their names.
    pub limits: Vec<(f64, String)>,
    /// States of the show, in order.
    pub states: Vec<StateSpan>,
    /// Names of kinds of events, with the seconds at which they happened.
    pub lanes: Vec<(String, Vec<f64>)>,
    /// The second and the clearance of the nearest approach.
    pub least: Option<DVec2>,
}

/// An interval in which the show has one state.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "the names of the fields describe them")]
pub struct StateSpan {
    pub from_s: f64,
    pub to_s: f64,
    pub look: StateLook,
}

/// How a state of the show looks in the lane of states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateLook {
    /// The show waits at its start.
    Ready,
    /// The head walks.
    Running,
    /// The show is paused, or the head brakes.
    Paused,
    /// The show is held.
    Held,
    /// The run is at its end.
    Finished,
}

const LANE_HEIGHT: f64 = 4.2;
/// Height of the bars of states, and of the strokes of events.
const MARK_HEIGHT: f64 = 2.6;
const LANE_GAP: f64 = 2.0;
const PLOT_HEIGHT: f64 = 62.0;
const LEAST_RADIUS: f64 = 0.9;

impl ShowTimeline {
    /// Draws the figure.
    pub fn draw(&self) -> Drawing {
        let lanes = LANE_HEIGHT * (self.lanes.len() + 1) as f64 + LANE_GAP;
        let (mut drawing, top) = page(&self.caption, &self.legend(), lanes + PLOT_HEIGHT + BOTTOM_MARGIN);
        let area = Rect::from_origin_size((LEFT_MARGIN, top + lanes), (PLOT_WIDTH, PLOT_HEIGHT));
        let plot = Plot::new(area, &(0.0..=self.end_s), &self.metres()).with_clock(self.clock_s);
        self.draw_lanes(&mut drawing, &plot, top);
        plot.draw_grid(&mut drawing);
        for (limit_m, name) in &self.limits {
            let line = Mark::stroked(plot.level_line(*limit_m), VERMILION, FINE_WIDTH).styled(LineStyle::Dashed);
            drawing.push(line.clipped(area).labelled(name.as_str()));
        }
        for line in &self.clearance {
            drawing.push(plot.line(line, BLUE, LINE_WIDTH).labelled("least clearance"));
        }
        plot.draw_frame(&mut drawing);
        if let Some(least) = self.least {
            drawing.push(plot.dot(least, LEAST_RADIUS, VERMILION).labelled("nearest approach"));
        }
        plot.label(&mut drawing, "time of day", "clearance (m)");
        drawing
    }

    /// Range of the clearance, which includes 0.
    fn metres(&self) -> std::ops::RangeInclusive<f64> {
        let points = self.clearance.iter().flatten().map(|point| point.y);
        let range = range_of(points.chain(self.least.map(|least| least.y)).chain([0.0]), 0.0);
        let room_m = 0.08 * (range.end() - range.start());
        let low_m = if *range.start() < 0.0 { range.start() - room_m } else { 0.0 };
        low_m..=range.end() + room_m
    }

    /// Draws the states and the events above the plot.
    fn draw_lanes(&self, drawing: &mut Drawing, plot: &Plot, top: f64) {
        let names = std::iter::once("state").chain(self.lanes.iter().map(|(name, _)| name.as_str()));
        for (lane, name) in names.enumerate() {
            let at = Point::new(plot.area.x0 - Y_TICK_GAP, middle_of(lane, top));
            drawing.write(&Text::new(name, TICK_SIZE).anchored(Anchor::Right), at);
        }
        let rail =
            Rect::new(plot.area.x0, middle_of(0, top), plot.area.x1, middle_of(0, top)).inflate(0.0, 0.5 * MARK_HEIGHT);
        drawing.push(Mark::filled(rail.to_path(0.0), LIGHT_GREY));
        for span in &self.states {
            let x = |seconds: f64| plot.at(DVec2::new(seconds, 0.0)).x;
            let bar = Rect::new(x(span.from_s), rail.y0, x(span.to_s), rail.y1);
            drawing.push(Mark::filled(bar.to_path(0.0), span.look.colour()).clipped(rail).labelled(span.look.name()));
        }
        for (lane, (name, times_s)) in (1..).zip(&self.lanes) {
            let middle = middle_of(lane, top);
            let row = [plot.area.x0, plot.area.x1].map(|x| Point::new(x, middle));
            drawing.push(Mark::stroked(polyline(row), LIGHT_GREY, FINE_WIDTH));
            for seconds in times_s {
                let x = plot.at(DVec2::new(*seconds, 0.0)).x.clamp(plot.area.x0, plot.area.x1);
                let stroke = [-0.5, 0.5].map(|side| Point::new(x, middle + side * MARK_HEIGHT));
                drawing.push(Mark::stroked(polyline(stroke), BLACK, 1.5 * AXIS_WIDTH).labelled(name.as_str()));
            }
        }
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let line = |colour, width, style| Swatch::Line { colour, width, style };
        let mut entries =
            vec![LegendEntry::new(line(BLUE, LINE_WIDTH, LineStyle::Solid), "least clearance of all pairs")];
        if self.least.is_some() {
            entries.push(LegendEntry::new(Swatch::Dot { colour: VERMILION, radius: LEAST_RADIUS }, "nearest approach"));
        }
        for (_, name) in &self.limits {
            entries.push(LegendEntry::new(line(VERMILION, FINE_WIDTH, LineStyle::Dashed), name.as_str()));
        }
        let shown = StateLook::ALL.into_iter().filter(|look| self.states.iter().any(|span| span.look == *look));
        entries.extend(shown.map(|look| LegendEntry::new(Swatch::Area(look.colour()), look.name())));
        entries
    }
}

impl StateLook {
    const ALL: [Self; 5] = [Self::Ready, Self::Running, Self::Paused, Self::Held, Self::Finished];

    fn colour(self) -> Colour {
        match self {
            Self::Ready => SKY_BLUE,
            Self::Running => GREEN,
            Self::Paused => ORANGE,
            Self::Held => PURPLE,
            Self::Finished => GREY,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Ready => "ready, or waiting for GO",
            Self::Running => "running",
            Self::Paused => "paused or braking",
            Self::Held => "held",
            Self::Finished => "finished",
        }
    }
}

/// Height of the middle of a lane on the page.
fn middle_of(lane: usize, top: f64) -> f64 {
    top + LANE_HEIGHT * (lane as f64 + 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::figure::FigureFormat;

    fn timeline() -> ShowTimeline {
        ShowTimeline {
            caption: Caption::new("The night"),
            clock_s: 75_877.0,
            end_s: 600.0,
            clearance: vec![vec![DVec2::new(0.0, 0.3), DVec2::new(250.0, 0.05)], vec![DVec2::new(400.0, 0.2)]],
            limits: vec![(0.05, "margin of the guard".to_owned())],
            states: vec![StateSpan { from_s: 0.0, to_s: 600.0, look: StateLook::Running }],
            lanes: vec![("alerts".to_owned(), vec![12.0, 700.0])],
            least: Some(DVec2::new(250.0, 0.05)),
        }
    }

    fn svg(timeline: &ShowTimeline) -> String {
        String::from_utf8(timeline.draw().encode(FigureFormat::Svg)).expect("SVG is UTF-8")
    }

    #[test]
    fn events_states_and_limits_have_their_names_in_the_picture() {
        let text = svg(&timeline());
        for label in ["running", "alerts", "margin of the guard", "nearest approach", "21:06", "time of day"] {
            assert!(text.contains(&format!("aria-label=\"{label}\"")), "{label}");
        }
    }

    #[test]
    fn a_show_without_a_frame_and_an_overlap_can_be_drawn() {
        let empty = ShowTimeline { end_s: 0.0, clearance: Vec::new(), states: Vec::new(), least: None, ..timeline() };
        assert!(svg(&empty).contains("clearance (m)"));
        let overlap = ShowTimeline { least: Some(DVec2::new(1.0, -0.08)), ..timeline() };
        assert!(*overlap.metres().start() < -0.08);
        assert!(svg(&overlap).contains("nearest approach"));
    }
}
