//! A plot: an area of the page with axes around it, and the scales of the axes.

use std::f64::consts::FRAC_PI_2;
use std::ops::RangeInclusive;

use glam::DVec2;
use kurbo::{BezPath, Point, Rect, Shape as _, Vec2};

use super::drawing::{Drawing, Mark, circle, polygon, polyline};
use super::style::{
    AXIS_WIDTH, BLACK, CLOCK_TICK_SPACING, Colour, FINE_WIDTH, GRID_WIDTH, LABEL_SIZE, LIGHT_GREY, LineStyle,
    TICK_LENGTH, TICK_SIZE, X_LABEL_DROP, X_TICK_DROP, X_TICK_SPACING, Y_LABEL_GAP, Y_TICK_GAP, Y_TICK_SPACING,
};
use super::text::{Anchor, Text};

/// Maps values to an area of the page.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plot {
    pub(super) area: Rect,
    x: Scale,
    y: Scale,
    /// Whether the y axis is labelled at the right side.
    is_y_at_right: bool,
    y_tick_spacing: f64,
    /// Time of day at the x of 0, in seconds after midnight, where x is a time in seconds and its ticks are times of day.
    clock_s: Option<f64>,
}

/// A linear scale from a range of values to an interval of the page in millimetres. The range is never empty.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale {
    values: [f64; 2],
    page: [f64; 2],
}

/// A value at an axis, with its label.
#[derive(Clone, Debug, PartialEq)]
struct Tick {
    value: f64,
    label: String,
}

impl Plot {
    /// A plot whose axes span these ranges.
    pub(super) fn new(area: Rect, x: &RangeInclusive<f64>, y: &RangeInclusive<f64>) -> Self {
        let (x, y) = (Scale::new(x, [area.x0, area.x1]), Scale::new(y, [area.y1, area.y0]));
        Self { area, x, y, is_y_at_right: false, y_tick_spacing: Y_TICK_SPACING, clock_s: None }
    }

    /// A plan: a plot with equal scales on both axes, which shows everything between two corners.
    pub(super) fn plan(area: Rect, low: DVec2, high: DVec2) -> Self {
        let size = DVec2::new(area.width(), area.height());
        let mm_per_m = (size / (high - low)).min_element();
        let (centre, half) = (0.5 * (low + high), 0.5 * size / mm_per_m);
        let [x, y] = [(centre.x, half.x), (centre.y, half.y)].map(|(middle, half)| middle - half..=middle + half);
        Self { y_tick_spacing: X_TICK_SPACING, ..Self::new(area, &x, &y) }
    }

    pub(super) fn with_y_at_the_right(self) -> Self {
        Self { is_y_at_right: true, ..self }
    }

    /// Labels the x axis, which has seconds, with times of day. `clock_s` is that of second 0, in seconds after midnight.
    pub(super) fn with_clock(self, clock_s: f64) -> Self {
        Self { clock_s: Some(clock_s), ..self }
    }

    /// Position on the page of a point of the plot.
    pub(super) fn at(&self, point: DVec2) -> Point {
        Point::new(self.x.at(point.x), self.y.at(point.y))
    }

    pub(super) fn mm_per_x(&self) -> f64 {
        self.x.mm_per_unit()
    }

    /// Straight lines from point to point, clipped to the plot.
    pub(super) fn line(&self, points: &[DVec2], colour: Colour, width: f64) -> Mark {
        Mark::stroked(polyline(points.iter().map(|point| self.at(*point))), colour, width).clipped(self.area)
    }

    /// A filled area, clipped to the plot.
    pub(super) fn polygon(&self, points: &[DVec2], colour: Colour) -> Mark {
        Mark::filled(polygon(points.iter().map(|point| self.at(*point))), colour).clipped(self.area)
    }

    /// A dot with a radius in millimetres. It may extend over the edge of the plot.
    pub(super) fn dot(&self, point: DVec2, radius: f64, colour: Colour) -> Mark {
        Mark::filled(circle(self.at(point), radius), colour)
    }

    /// A dotted frame around the ranges of another plot.
    pub(super) fn window(&self, x: &RangeInclusive<f64>, y: &RangeInclusive<f64>) -> Mark {
        let min = self.at(DVec2::new(*x.start(), *y.end()));
        let max = self.at(DVec2::new(*x.end(), *y.start()));
        let frame = Rect::from_points(min, max).to_path(0.0);
        Mark::stroked(frame, BLACK, FINE_WIDTH).styled(LineStyle::Dotted).clipped(self.area)
    }

    /// A line across the plot at a value of y.
    pub(super) fn level_line(&self, y: f64) -> BezPath {
        polyline([self.area.x0, self.area.x1].map(|x| Point::new(x, self.y.at(y))))
    }

    pub(super) fn draw_grid(&self, drawing: &mut Drawing) {
        for tick in self.y_ticks() {
            drawing.push(Mark::stroked(self.level_line(tick.value), LIGHT_GREY, GRID_WIDTH));
        }
    }

    /// Draws the frame with its ticks, over the data.
    pub(super) fn draw_frame(&self, drawing: &mut Drawing) {
        drawing.push(Mark::stroked(self.area.to_path(0.0), BLACK, AXIS_WIDTH));
        for tick in self.x_ticks() {
            let at = Point::new(self.x.at(tick.value), self.area.y1);
            drawing.push(Mark::stroked(polyline([at, at + (0.0, TICK_LENGTH)]), BLACK, AXIS_WIDTH));
            drawing.write(&Text::new(tick.label, TICK_SIZE), at + (0.0, X_TICK_DROP));
        }
        let (edge, outward, anchor) = self.y_edge();
        for tick in self.y_ticks() {
            let at = Point::new(edge, self.y.at(tick.value));
            drawing.push(Mark::stroked(polyline([at, at + TICK_LENGTH * outward]), BLACK, AXIS_WIDTH));
            drawing.write(&Text::new(tick.label, TICK_SIZE).anchored(anchor), at + Y_TICK_GAP * outward);
        }
    }

    /// Writes the labels of the axes.
    pub(super) fn label(&self, drawing: &mut Drawing, x: &str, y: &str) {
        let below = Point::new(self.area.center().x, self.area.y1 + X_LABEL_DROP);
        drawing.write(&Text::new(x, LABEL_SIZE), below);
        let widths = self.y_ticks().into_iter().map(|tick| Text::new(tick.label, TICK_SIZE).width());
        let distance = Y_TICK_GAP + widths.fold(0.0, f64::max) + Y_LABEL_GAP;
        let (edge, outward, _) = self.y_edge();
        let beside = Point::new(edge, self.area.center().y) + distance * outward;
        drawing.write(&Text::new(y, LABEL_SIZE).turned(-FRAC_PI_2), beside);
    }

    fn x_ticks(&self) -> Vec<Tick> {
        match self.clock_s {
            Some(clock_s) => self.x.clock_ticks(CLOCK_TICK_SPACING, clock_s),
            None => self.x.ticks(X_TICK_SPACING),
        }
    }

    fn y_ticks(&self) -> Vec<Tick> {
        self.y.ticks(self.y_tick_spacing)
    }

    /// The edge for the labels of the y axis: its x, the direction away from the plot, and the anchor of its numbers.
    fn y_edge(&self) -> (f64, Vec2, Anchor) {
        if self.is_y_at_right {
            (self.area.x1, Vec2::new(1.0, 0.0), Anchor::Left)
        } else {
            (self.area.x0, Vec2::new(-1.0, 0.0), Anchor::Right)
        }
    }
}

impl Scale {
    /// The scale that maps the ends of `values` to the two positions on the page. An empty, reversed or infinite range becomes
    /// a wider one around it: a figure of a single point has axes too.
    fn new(values: &RangeInclusive<f64>, page: [f64; 2]) -> Self {
        let [low, high] = [*values.start(), *values.end()];
        let widened = range_of([low, high].into_iter().filter(|value| value.is_finite()), 0.0);
        let has_extent = |range: &RangeInclusive<f64>| {
            let extent = range.end() - range.start();
            extent > 0.0 && extent.is_finite()
        };
        let range = [values.clone(), widened, 0.0..=1.0].into_iter().find(has_extent).expect("0 to 1 is not empty");
        Self { values: [*range.start(), *range.end()], page }
    }

    fn at(&self, value: f64) -> f64 {
        self.page[0] + (value - self.values[0]) * self.mm_per_unit()
    }

    /// Millimetres of page per unit; negative if the values grow towards the top of the page.
    fn mm_per_unit(&self) -> f64 {
        (self.page[1] - self.page[0]) / (self.values[1] - self.values[0])
    }

    /// Ticks at multiples of 1, 2 or 5 times a power of ten: the smallest step of at least `gap` millimetres.
    fn ticks(&self, gap: f64) -> Vec<Tick> {
        let least = gap / self.mm_per_unit().abs();
        let magnitude = least.log10().floor();
        let steps = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * 10_f64.powf(magnitude));
        let step = steps.into_iter().find(|step| *step >= least).unwrap_or(steps[3]);
        let decimals = (-(step * 1.000_001).log10().floor()).max(0.0) as usize;
        // The tolerance of a billionth of a step keeps a tick that rounding moves over the end of the axis.
        let [first, last] = [self.values[0] / step - 1e-9, self.values[1] / step + 1e-9];
        let indices = first.ceil() as i64..=last.floor() as i64;
        let values = indices.map(|index| index as f64 * step);
        values.map(|value| Tick { value, label: number(value, decimals) }).collect()
    }
}

/// Seconds from tick to tick of a clock.
const CLOCK_STEPS: [f64; 18] = [
    1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0, 7200.0, 10_800.0, 21_600.0,
    43_200.0, DAY_S,
];
const DAY_S: f64 = 86_400.0;

impl Scale {
    /// Ticks at round times of day, for values in seconds: the smallest step of at least `gap` millimetres, from a second to a
    /// number of days.
    fn clock_ticks(&self, gap: f64, clock_s: f64) -> Vec<Tick> {
        let least = gap / self.mm_per_unit().abs();
        let days = DAY_S * (least / DAY_S).ceil();
        let step = CLOCK_STEPS.into_iter().find(|step| *step >= least).unwrap_or(days);
        let [first, last] = self.values.map(|value| (value + clock_s) / step);
        let times_s = (first.ceil() as i64..=last.floor() as i64).map(|index| index as f64 * step);
        times_s.map(|time_s| Tick { value: time_s - clock_s, label: time_of_day(time_s, step < 60.0) }).collect()
    }
}

/// A time of day, after midnight counted from 0 again.
fn time_of_day(time_s: f64, has_seconds: bool) -> String {
    let seconds = time_s.rem_euclid(DAY_S).round() as u64;
    let (hours, minutes) = (seconds / 3600 % 24, seconds / 60 % 60);
    if has_seconds {
        format!("{hours:02}:{minutes:02}:{:02}", seconds % 60)
    } else {
        format!("{hours:02}:{minutes:02}")
    }
}

/// Prints a number. The minus sign is as wide as a plus sign; a zero has no sign.
fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.contains(|digit| ('1'..='9').contains(&digit)) => format!("−{digits}"),
        Some(digits) => digits.to_owned(),
        None => text,
    }
}

/// Least range that contains all values, plus `margin` times its extent at both ends. Equal values get a range around them.
pub(super) fn range_of(values: impl IntoIterator<Item = f64>, margin: f64) -> RangeInclusive<f64> {
    let (low, high) = values
        .into_iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return 0.0..=1.0;
    }
    let extent = high - low;
    // An extent within rounding would show noise.
    let noise = 1e-9 * low.abs().max(high.abs());
    let spread = if extent > noise { margin * extent } else { (0.1 * low.abs()).max(0.1) };
    low - spread..=high + spread
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(values: RangeInclusive<f64>, gap: f64) -> Vec<String> {
        Scale::new(&values, [0.0, 100.0]).ticks(gap).into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn ticks_are_round_numbers_with_room_between_them() {
        assert_eq!(labels(-12.3..=11.0, 15.0), ["−10", "−5", "0", "5", "10"]);
        assert_eq!(labels(0.0..=0.18, 20.0), ["0.00", "0.05", "0.10", "0.15"]);
        assert_eq!(labels(0.0..=412.5, 15.0), ["0", "100", "200", "300", "400"]);
        assert_eq!(labels(0.3..=0.6, 30.0), ["0.3", "0.4", "0.5", "0.6"]);
    }

    #[test]
    fn ticks_of_a_clock_are_round_times_of_day() {
        let labels = |seconds: f64, clock_s: f64| -> Vec<String> {
            let ticks = Scale::new(&(0.0..=seconds), [0.0, 100.0]).clock_ticks(20.0, clock_s);
            ticks.into_iter().map(|tick| tick.label).collect()
        };
        assert_eq!(labels(30.0, 21.0 * 3600.0 + 4.0), ["21:00:10", "21:00:20", "21:00:30"]);
        assert_eq!(labels(3600.0, 23.0 * 3600.0 + 1.0), ["23:15", "23:30", "23:45", "00:00"]);
        assert_eq!(labels(4.0 * 86_400.0, 0.0), ["00:00"; 5]);
        assert!(labels(1e9, 0.0).len() <= 6);
    }

    #[test]
    fn scale_may_grow_towards_the_top_of_the_page() {
        let scale = Scale::new(&(0.0..=10.0), [90.0, 10.0]);
        assert_eq!((scale.at(0.0), scale.at(10.0), scale.at(2.5)), (90.0, 10.0, 70.0));
    }

    #[test]
    fn scale_of_an_empty_or_infinite_range_is_widened() {
        for values in [0.0..=0.0, 3.0..=3.0, f64::NAN..=1.0, f64::INFINITY..=f64::NEG_INFINITY, -1e308..=1e308] {
            let scale = Scale::new(&values, [0.0, 100.0]);
            assert!(scale.mm_per_unit().is_finite() && scale.mm_per_unit() > 0.0, "{values:?}: {scale:?}");
            assert!((1..100).contains(&scale.ticks(15.0).len()), "{values:?}: {scale:?}");
        }
    }

    #[test]
    fn range_of_equal_values_is_widened() {
        assert_eq!(range_of([2.0, 2.0], 0.05), 1.8..=2.2);
        assert_eq!(range_of([0.0, 1.0], 0.05), -0.05..=1.05);
        assert_eq!(range_of([], 0.05), 0.0..=1.0);
    }
}
