//! Plot of the least clearance over time, with near misses and the contact.

use std::ops::RangeInclusive;

use bench_dragon_geometry::number::Fixed;
use glam::DVec2;
use kurbo::{Rect, Size};

use super::drawing::{Drawing, Mark, circle, contains};
use super::notes::Notes;
use super::page::{Caption, LegendEntry, Swatch, page};
use super::plot::{Plot, range_of};
use super::style::{
    AXIS_WIDTH, BLACK, BLUE, BOTTOM_MARGIN, LEFT_MARGIN, LINE_WIDTH, LineStyle, PLOT_WIDTH, ROW_GAP, VERMILION,
};

/// The least clearance of all pairs over time. The upper plot shows the whole run. The lower plot shows the time around the
/// deepest near misses and the contact, in millimetres.
#[derive(Clone, Debug, PartialEq)]
pub struct ClearanceOverTime {
    /// Caption above the plots.
    pub caption: Caption,
    /// Time in seconds and clearance in metres, in order.
    pub samples: Vec<DVec2>,
    /// Local minima above 0, in order.
    pub near_misses: Vec<NearMissMark>,
    /// The contact, if there is one.
    pub contact: Option<ContactMark>,
}

/// Two benches that approach and separate again without contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearMissMark {
    /// Seconds of show time.
    pub time_s: f64,
    /// Their least clearance in metres.
    pub clearance_m: f64,
    /// The two benches.
    pub benches: [usize; 2],
}

/// Two benches that touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactMark {
    /// Seconds of show time.
    pub time_s: f64,
    /// The two benches.
    pub benches: [usize; 2],
}

const WHOLE_HEIGHT: f64 = 45.0;
const PART_HEIGHT: f64 = 55.0;
/// Greatest number of near misses with a note.
const NAMED: usize = 4;
const RING_RADIUS: f64 = 0.8;
/// Margin of the lower plot at either side ÷ time from the first to the last named near miss or contact.
const PART_MARGIN: f64 = 0.15;

impl ClearanceOverTime {
    /// Draws the figure.
    pub fn draw(&self) -> Drawing {
        let [whole_row, part_row] = [WHOLE_HEIGHT + BOTTOM_MARGIN + ROW_GAP, PART_HEIGHT + BOTTOM_MARGIN];
        let (mut drawing, top) = page(&self.caption, &self.legend(), whole_row + part_row);
        let area = |top: f64, height: f64| Rect::from_origin_size((LEFT_MARGIN, top), (PLOT_WIDTH, height));
        let times = range_of(self.line().iter().map(|point| point.x), 0.0);
        let highest_m = self.samples.iter().map(|sample| sample.y).fold(0.0, f64::max);
        let whole = Plot::new(area(top, WHOLE_HEIGHT), &times, &(0.0..=1.1 * highest_m));
        let part_times = self.part_times(&times);
        self.draw_plot(&mut drawing, &whole, 1.0);
        let part_metres = 0.0..=self.part_millimetres(&part_times).end() / 1000.0;
        drawing.push(whole.window(&part_times, &part_metres));
        whole.label(&mut drawing, "show time (s)", "clearance (m)");

        let part = Plot::new(area(top + whole_row, PART_HEIGHT), &part_times, &self.part_millimetres(&part_times));
        self.draw_plot(&mut drawing, &part, 1000.0);
        self.draw_notes(&mut drawing, &part);
        part.label(&mut drawing, "show time (s)", "clearance (mm)");
        drawing
    }

    /// The clearance over time, including the lowest point of every near miss, and the contact.
    fn line(&self) -> Vec<DVec2> {
        let misses = self.near_misses.iter().map(|miss| DVec2::new(miss.time_s, miss.clearance_m));
        let contact = self.contact.iter().map(|contact| DVec2::new(contact.time_s, 0.0));
        let mut line: Vec<DVec2> = self.samples.iter().copied().chain(misses).chain(contact).collect();
        line.sort_by(|a, b| a.x.total_cmp(&b.x));
        line
    }

    /// The near misses with a note, the deepest first.
    fn named(&self) -> Vec<NearMissMark> {
        let mut named = self.near_misses.clone();
        named.sort_by(|a, b| a.clearance_m.total_cmp(&b.clearance_m));
        named.truncate(NAMED);
        named
    }

    fn part_times(&self, whole: &RangeInclusive<f64>) -> RangeInclusive<f64> {
        let named = self.named().into_iter().map(|miss| miss.time_s);
        let times: Vec<f64> = named.chain(self.contact.map(|contact| contact.time_s)).collect();
        if times.is_empty() {
            return whole.clone();
        }
        let around = range_of(times, PART_MARGIN);
        around.start().max(*whole.start())..=around.end().min(*whole.end())
    }

    /// Range of the lower plot: from 0 to above the highest clearance at these times.
    fn part_millimetres(&self, times: &RangeInclusive<f64>) -> RangeInclusive<f64> {
        let inside = self.line().into_iter().filter(|point| times.contains(&point.x));
        let highest_m = inside.map(|point| point.y).fold(0.0, f64::max);
        0.0..=1.35 * 1000.0 * if highest_m > 0.0 { highest_m } else { 0.001 }
    }

    fn draw_plot(&self, drawing: &mut Drawing, plot: &Plot, units_per_m: f64) {
        plot.draw_grid(drawing);
        let scaled = |point: DVec2| DVec2::new(point.x, point.y * units_per_m);
        let line: Vec<DVec2> = self.line().into_iter().map(scaled).collect();
        drawing.push(plot.line(&line, BLUE, LINE_WIDTH).labelled("clearance"));
        plot.draw_frame(drawing);
        for miss in &self.near_misses {
            let at = plot.at(scaled(DVec2::new(miss.time_s, miss.clearance_m)));
            if contains(plot.area, at) {
                drawing.push(Mark::stroked(circle(at, RING_RADIUS), BLACK, AXIS_WIDTH));
            }
        }
        if let Some(contact) = self.contact {
            drawing.push(plot.dot(DVec2::new(contact.time_s, 0.0), RING_RADIUS, VERMILION));
        }
    }

    fn draw_notes(&self, drawing: &mut Drawing, plot: &Plot) {
        let at = |time_s: f64, clearance_m: f64| plot.at(DVec2::new(time_s, 1000.0 * clearance_m));
        let line = self.line().into_iter().map(|point| at(point.x, point.y)).collect();
        let mut notes = Notes::new(plot.area, &[line]);
        for miss in &self.near_misses {
            let ring = at(miss.time_s, miss.clearance_m);
            notes.keep_off(Rect::from_center_size(ring, Size::new(2.0 * RING_RADIUS, 2.0 * RING_RADIUS)));
        }
        if let Some(contact) = self.contact {
            let words = [format!("contact at {} s", Fixed::<6>(contact.time_s)), pair(contact.benches)];
            notes.write(drawing, &words, at(contact.time_s, 0.0));
        }
        for miss in self.named() {
            let (millimetres, time_s) = (1000.0 * miss.clearance_m, miss.time_s);
            let words = [format!("{} mm at {} s", Fixed::<3>(millimetres), Fixed::<3>(time_s)), pair(miss.benches)];
            notes.write(drawing, &words, at(miss.time_s, miss.clearance_m));
        }
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let line = Swatch::Line { colour: BLUE, width: LINE_WIDTH, style: LineStyle::Solid };
        let mut entries = vec![LegendEntry::new(line, "least clearance of all pairs")];
        if !self.near_misses.is_empty() {
            entries.push(LegendEntry::new(Swatch::Ring { colour: BLACK, radius: RING_RADIUS }, "near miss"));
        }
        if self.contact.is_some() {
            entries.push(LegendEntry::new(Swatch::Dot { colour: VERMILION, radius: RING_RADIUS }, "contact"));
        }
        entries
    }
}

fn pair([first, second]: [usize; 2]) -> String {
    format!("benches {first} and {second}")
}
