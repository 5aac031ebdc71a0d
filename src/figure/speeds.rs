//! Speeds of handles over time.

use std::ops::RangeInclusive;

use glam::DVec2;

use super::drawing::Drawing;
use super::legend::{Entry, Sample};
use super::mark::{LineStyle, Mark};
use super::notes::Notes;
use super::page::{PLOT_WIDTH, head_height, page};
use super::palette::BLACK;
use super::path::{Path, Rect};
use super::plot::Plot;
use super::scale::range_of;
use super::style::{AXIS_WIDTH, BOTTOM_MARGIN, FINE_WIDTH, LEFT_MARGIN, LINE_WIDTH, ROW_GAP, line_look};

/// Speeds of some handles over time, with the largest of all handles.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedsOverTime {
    /// Stands over the plot.
    pub title: String,
    /// The handles shown.
    pub handles: Vec<HandleSpeed>,
    /// The largest speed of any handle, if it is to be marked.
    pub largest: Option<LargestSpeed>,
    /// The speed that no handle may exceed, if there is one.
    pub limit_mps: Option<f64>,
    /// Times that a second plot shows larger.
    pub detail_s: Option<RangeInclusive<f64>>,
}

/// A handle's speed over time.
#[derive(Clone, Debug, PartialEq)]
pub struct HandleSpeed {
    /// What the handle is called.
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

const HEIGHT: f64 = 65.0;
const MARGIN: f64 = 0.08;
const RING_RADIUS: f64 = 0.9;

impl SpeedsOverTime {
    /// Draws it.
    pub fn draw(&self) -> Drawing {
        let entries = self.legend();
        let top = head_height(&entries);
        let row = HEIGHT + BOTTOM_MARGIN;
        let height = if self.detail_s.is_some() { 2.0 * row + ROW_GAP } else { row };
        let mut drawing = page(&self.title, &entries, height);
        let area = |top: f64| Rect::new(LEFT_MARGIN, top, PLOT_WIDTH, HEIGHT);
        let times_s = range_of(self.samples().map(|sample| sample.x), 0.0);
        let speeds_mps = self.speeds_mps(&times_s);
        let whole = Plot::new(area(top), &times_s, &speeds_mps);
        self.draw_plot(&mut drawing, &whole);
        let mut noted = whole.clone();
        if let Some(detail_s) = &self.detail_s {
            let speeds_mps = self.speeds_mps(detail_s);
            drawing.push(whole.window(detail_s, &speeds_mps));
            noted = Plot::new(area(top + row + ROW_GAP), detail_s, &speeds_mps);
            self.draw_plot(&mut drawing, &noted);
        }
        self.draw_note(&mut drawing, &noted);
        drawing
    }

    fn draw_plot(&self, drawing: &mut Drawing, plot: &Plot) {
        plot.draw_grid(drawing);
        // The head's line, which is the plainest, over the others.
        for (index, handle) in self.handles.iter().enumerate().rev() {
            let (colour, style) = line_look(index);
            let line = plot.line(&handle.samples, colour, LINE_WIDTH).styled(style);
            drawing.push(line.labelled(handle.name.as_str()));
        }
        if let Some(limit_mps) = self.limit_mps {
            let y = plot.at(DVec2::new(0.0, limit_mps)).y;
            let ends = [plot.area.min.x, plot.area.max.x].map(|x| DVec2::new(x, y));
            let line =
                Mark::stroked(Path::line(ends), BLACK, FINE_WIDTH).styled(LineStyle::DashDotted).clipped(plot.area);
            drawing.push(line.labelled("limit"));
        }
        if let Some(LargestSpeed { time_s, speed_mps, .. }) = self.largest {
            let ring = Path::circle(plot.at(DVec2::new(time_s, speed_mps)), RING_RADIUS);
            drawing.push(Mark::stroked(ring, BLACK, AXIS_WIDTH).clipped(plot.area).labelled("largest speed"));
        }
        plot.draw_frame(drawing);
        plot.label_x(drawing, "show time (s)");
        plot.label_y(drawing, "speed (m/s)");
    }

    /// Tells the largest speed in words.
    fn draw_note(&self, drawing: &mut Drawing, plot: &Plot) {
        let Some(LargestSpeed { time_s, speed_mps, handle }) = self.largest else { return };
        let inside = |samples: &[DVec2]| {
            let points = samples.iter().map(|sample| plot.at(*sample));
            points.filter(|point| plot.area.contains(*point)).collect()
        };
        let lines: Vec<Vec<DVec2>> = self.handles.iter().map(|handle| inside(&handle.samples)).collect();
        let words = [format!("{speed_mps:.6} m/s at {time_s:.3} s"), format!("handle {handle}")];
        Notes::new(plot.area, &lines).write(drawing, &words, plot.at(DVec2::new(time_s, speed_mps)));
    }

    fn samples(&self) -> impl Iterator<Item = &DVec2> {
        self.handles.iter().flat_map(|handle| handle.samples.iter())
    }

    /// What a plot of these times shows.
    fn speeds_mps(&self, times_s: &RangeInclusive<f64>) -> RangeInclusive<f64> {
        let largest = self.largest.filter(|largest| times_s.contains(&largest.time_s));
        let marked = largest.map(|largest| largest.speed_mps).into_iter().chain(self.limit_mps);
        let inside = self.samples().filter(|sample| times_s.contains(&sample.x));
        range_of(inside.map(|sample| sample.y).chain(marked), MARGIN)
    }

    fn legend(&self) -> Vec<Entry> {
        let handles = self.handles.iter().enumerate().map(|(index, handle)| {
            let (colour, style) = line_look(index);
            Entry::new(Sample::Line { colour, width: LINE_WIDTH, style }, handle.name.as_str())
        });
        let mut entries: Vec<Entry> = handles.collect();
        if self.largest.is_some() {
            let ring = Sample::Ring { colour: BLACK, radius: RING_RADIUS };
            entries.push(Entry::new(ring, "largest of all handles"));
        }
        if let Some(limit_mps) = self.limit_mps {
            let line = Sample::Line { colour: BLACK, width: FINE_WIDTH, style: LineStyle::DashDotted };
            entries.push(Entry::new(line, format!("limit {limit_mps} m/s")));
        }
        entries
    }
}
