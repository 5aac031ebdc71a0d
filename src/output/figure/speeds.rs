//! Plot of the speeds of handles over time.

use std::ops::RangeInclusive;

use bench_dragon_geometry::number::Fixed;
use glam::DVec2;
use kurbo::{Point, Rect};

use super::drawing::{Drawing, Mark, circle, contains};
use super::notes::Notes;
use super::page::{Caption, LegendEntry, Swatch, page};
use super::plot::{Plot, range_of};
use super::style::{
    AXIS_WIDTH, BLACK, BOTTOM_MARGIN, FINE_WIDTH, LEFT_MARGIN, LINE_WIDTH, LineStyle, PALE_BLUE, PLOT_WIDTH, ROW_GAP,
    line_look,
};

/// Speeds of some handles over time, with the largest speed of all handles.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedsOverTime {
    /// Caption above the plots.
    pub caption: Caption,
    /// Least and greatest speed of all handles, in order of time.
    pub all: Vec<SpeedRange>,
    /// The handles with a line, the head first.
    pub handles: Vec<HandleSpeed>,
    /// The largest speed of any handle, if it is marked.
    pub largest: Option<LargestSpeed>,
    /// Speed limit of all handles, if any.
    pub limit_mps: Option<f64>,
    /// Times of a second, larger plot. The first plot then shows only the range of all handles and the head: the other lines
    /// would fill it.
    pub detail_s: Option<RangeInclusive<f64>>,
}

/// Speeds of the slowest and the fastest handle at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedRange {
    /// Seconds of show time.
    pub time_s: f64,
    /// Speed of the slowest handle, in metres per second.
    pub least_mps: f64,
    /// Speed of the fastest handle, in metres per second.
    pub most_mps: f64,
}

/// A handle's speed over time.
#[derive(Clone, Debug, PartialEq)]
pub struct HandleSpeed {
    /// Name of the handle.
    pub name: String,
    /// Time in seconds and speed in metres per second, in order.
    pub samples: Vec<DVec2>,
}

/// The largest speed of all handles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LargestSpeed {
    /// Seconds of show time.
    pub time_s: f64,
    /// Metres per second.
    pub speed_mps: f64,
    /// Index of the handle.
    pub handle: usize,
}

const ALL: &str = "all handles";
const HEIGHT: f64 = 65.0;
const MARGIN: f64 = 0.08;
const RING_RADIUS: f64 = 0.9;
/// Width of a page column in millimetres. The range of all handles is combined for each column. In a plot of a whole show, a
/// column covers more time than a link needs to pass a point, so that the range is smooth.
const COLUMN: f64 = 0.3;
const WIDE_COLUMN: f64 = 0.6;

/// The samples inside a plot, and the next sample at either side.
fn visible<'a>(samples: &'a [DVec2], plot: &Plot) -> &'a [DVec2] {
    let x = |sample: &DVec2| plot.at(*sample).x;
    let first = samples.partition_point(|sample| x(sample) < plot.area.x0).saturating_sub(1);
    let end = samples.partition_point(|sample| x(sample) <= plot.area.x1) + 1;
    &samples[first..end.min(samples.len())]
}

impl SpeedsOverTime {
    /// Draws the figure.
    pub fn draw(&self) -> Drawing {
        let row = HEIGHT + BOTTOM_MARGIN;
        let height = if self.detail_s.is_some() { 2.0 * row + ROW_GAP } else { row };
        let (mut drawing, top) = page(&self.caption, &self.legend(), height);
        let area = |top: f64| Rect::from_origin_size((LEFT_MARGIN, top), (PLOT_WIDTH, HEIGHT));
        let times_s = range_of(self.samples().map(|sample| sample.x), 0.0);
        let speeds_mps = self.speeds_mps(&times_s);
        let whole = Plot::new(area(top), &times_s, &speeds_mps);
        match self.detail_s {
            Some(_) => self.draw_plot(&mut drawing, &whole, WIDE_COLUMN, 1),
            None => self.draw_plot(&mut drawing, &whole, COLUMN, self.handles.len()),
        }
        let mut noted = whole.clone();
        if let Some(detail_s) = &self.detail_s {
            let speeds_mps = self.speeds_mps(detail_s);
            drawing.push(whole.window(detail_s, &speeds_mps));
            noted = Plot::new(area(top + row + ROW_GAP), detail_s, &speeds_mps);
            self.draw_plot(&mut drawing, &noted, COLUMN, self.handles.len());
        }
        self.draw_note(&mut drawing, &noted);
        drawing
    }

    /// Draws the range of all handles, and the lines of the first `lines` handles.
    fn draw_plot(&self, drawing: &mut Drawing, plot: &Plot, column: f64, lines: usize) {
        plot.draw_grid(drawing);
        drawing.push(plot.polygon(&self.band(plot, column), PALE_BLUE).labelled(ALL));
        // Draws the head's line last, over the others.
        for (index, handle) in self.handles.iter().enumerate().take(lines).rev() {
            let (colour, style) = line_look(index);
            let line = plot.line(visible(&handle.samples, plot), colour, LINE_WIDTH).styled(style);
            drawing.push(line.labelled(handle.name.as_str()));
        }
        if let Some(limit_mps) = self.limit_mps {
            let line = Mark::stroked(plot.level_line(limit_mps), BLACK, FINE_WIDTH).styled(LineStyle::DashDotted);
            drawing.push(line.clipped(plot.area).labelled("limit"));
        }
        if let Some(LargestSpeed { time_s, speed_mps, .. }) = self.largest {
            let ring = circle(plot.at(DVec2::new(time_s, speed_mps)), RING_RADIUS);
            drawing.push(Mark::stroked(ring, BLACK, AXIS_WIDTH).clipped(plot.area).labelled("largest speed"));
        }
        plot.draw_frame(drawing);
        plot.label(drawing, "show time (s)", "speed (m/s)");
    }

    /// Outline of the range of all handles: the least and greatest speed in each column of the page.
    fn band(&self, plot: &Plot, column: f64) -> Vec<DVec2> {
        let number = |range: &SpeedRange| (plot.at(DVec2::new(range.time_s, 0.0)).x / column).floor();
        let joined = self.all.chunk_by(|a, b| number(a) == number(b)).map(|ranges| {
            let time_s = 0.5 * (ranges[0].time_s + ranges[ranges.len() - 1].time_s);
            let least_mps = ranges.iter().map(|range| range.least_mps).fold(f64::INFINITY, f64::min);
            let most_mps = ranges.iter().map(|range| range.most_mps).fold(f64::NEG_INFINITY, f64::max);
            SpeedRange { time_s, least_mps, most_mps }
        });
        let ends = [self.all.first().copied(), self.all.last().copied()];
        let joined: Vec<SpeedRange> = ends[0].into_iter().chain(joined).chain(ends[1]).collect();
        let upper = joined.iter().map(|range| DVec2::new(range.time_s, range.most_mps));
        let lower = joined.iter().rev().map(|range| DVec2::new(range.time_s, range.least_mps));
        upper.chain(lower).collect()
    }

    fn draw_note(&self, drawing: &mut Drawing, plot: &Plot) {
        let Some(LargestSpeed { time_s, speed_mps, handle }) = self.largest else { return };
        let inside = |samples: &[DVec2]| {
            let points = samples.iter().map(|sample| plot.at(*sample));
            points.filter(|point| contains(plot.area, *point)).collect()
        };
        let lines: Vec<Vec<Point>> = self.handles.iter().map(|handle| inside(&handle.samples)).collect();
        let words = [format!("{speed_mps:.6} m/s at {} s", Fixed::<3>(time_s)), format!("handle {handle}")];
        Notes::new(plot.area, &lines).write(drawing, &words, plot.at(DVec2::new(time_s, speed_mps)));
    }

    fn samples(&self) -> impl Iterator<Item = &DVec2> {
        self.handles.iter().flat_map(|handle| handle.samples.iter())
    }

    /// Range of speeds for a plot of these times.
    fn speeds_mps(&self, times_s: &RangeInclusive<f64>) -> RangeInclusive<f64> {
        let largest = self.largest.filter(|largest| times_s.contains(&largest.time_s));
        let marked = largest.map(|largest| largest.speed_mps).into_iter().chain(self.limit_mps);
        let inside = self.samples().filter(|sample| times_s.contains(&sample.x)).map(|sample| sample.y);
        let all = self.all.iter().filter(|range| times_s.contains(&range.time_s));
        let all = all.flat_map(|range| [range.least_mps, range.most_mps]);
        range_of(inside.chain(all).chain(marked), MARGIN)
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let handles = self.handles.iter().enumerate().map(|(index, handle)| {
            let (colour, style) = line_look(index);
            LegendEntry::new(Swatch::Line { colour, width: LINE_WIDTH, style }, handle.name.as_str())
        });
        let mut entries: Vec<LegendEntry> = handles.collect();
        if !self.all.is_empty() {
            entries.push(LegendEntry::new(Swatch::Area(PALE_BLUE), ALL));
        }
        if self.largest.is_some() {
            let ring = Swatch::Ring { colour: BLACK, radius: RING_RADIUS };
            entries.push(LegendEntry::new(ring, "largest of all handles"));
        }
        if let Some(limit_mps) = self.limit_mps {
            let line = Swatch::Line { colour: BLACK, width: FINE_WIDTH, style: LineStyle::DashDotted };
            entries.push(LegendEntry::new(line, format!("limit {limit_mps} m/s")));
        }
        entries
    }
}
