//! Number and dimensions of the benches of a dragon.

use std::ops::{Range, RangeInclusive};

use glam::DVec2;
use thiserror::Error;

use crate::number::Number;

/// Largest number of benches.
pub const MAX_BENCHES: usize = 100_000;
/// Allowed lengths of a board, in metres.
pub const LENGTH_M: RangeInclusive<f64> = 0.02..=100.0;
/// Allowed widths of a board, in metres.
pub const WIDTH_M: RangeInclusive<f64> = 0.01..=100.0;
/// Smallest distance between the two hinges of a bench, in metres.
pub const LEAST_LINK_M: f64 = 0.01;
/// Largest ratio of a board's length, and of its width, to the distance between its hinges.
pub const MOST_PER_LINK: f64 = 20.0;
/// Largest play of a hinge, as a share of the shortest link.
pub const MOST_PLAY_PER_LINK: f64 = 0.05;
/// Largest ratio of a board's length to its width.
pub const MOST_PER_WIDTH: f64 = 100.0;

/// Error of invalid dimensions: the configuration key, the value, and the allowed range.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{0}")]
pub struct DimensionsError(String);

/// The benches of a dragon. Each is a board with two hinge holes, `hole_offset_m` from its ends. Bench 0 is the head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dimensions {
    benches: usize,
    head_length_m: f64,
    body_length_m: f64,
    width_m: f64,
    hole_offset_m: f64,
    /// Diameter of the holes; 0 for hinges without play.
    hole_diameter_m: f64,
    /// Diameter of the poles; 0 for hinges without play.
    pole_diameter_m: f64,
}

impl Dimensions {
    /// Number of leading benches: the head and the first body bench. All benches behind them are alike. Each of those reaches
    /// the earlier position of the bench before it, with identical benches behind it.
    pub(crate) const LEADING: usize = 2;

    /// Dimensions of a dragon, in metres.
    ///
    /// ```
    /// use bench_dragon_geometry::dragon::Dimensions;
    ///
    /// let paper = Dimensions::new(223, 3.41, 2.20, 0.30, 0.275)?;
    /// assert_eq!(paper.handles(), 224);
    /// assert!((paper.link_m(0) - 2.86).abs() < 1e-15);
    ///
    /// let error = Dimensions::new(223, 3.41, 2.20, 0.30, 1.2).unwrap_err();
    /// let text = "hole_offset_m is 1.2, must be at least 0 and under 1.1, half of the shortest bench";
    /// assert_eq!(error.to_string(), text);
    /// # Ok::<(), bench_dragon_geometry::dragon::DimensionsError>(())
    /// ```
    ///
    /// # Errors
    /// The number of benches must be from 1 to [`MAX_BENCHES`], the lengths in [`LENGTH_M`], the width in [`WIDTH_M`]. The
    /// hinges must be at least [`LEAST_LINK_M`] apart, the proportions at most [`MOST_PER_LINK`] and [`MOST_PER_WIDTH`]. The
    /// proportions bound the number of boards near one board, and with it the work of a search.
    pub fn new(
        benches: usize,
        head_length_m: f64,
        body_length_m: f64,
        width_m: f64,
        hole_offset_m: f64,
    ) -> Result<Self, DimensionsError> {
        let refuse = |message: String| Err(DimensionsError(message));
        if !(1..=MAX_BENCHES).contains(&benches) {
            return refuse(format!("benches is {benches}, must be from 1 to {MAX_BENCHES}"));
        }
        let lengths = [("head_length_m", head_length_m), ("body_length_m", body_length_m)];
        let [head, body] = lengths;
        for ((key, value), allowed) in [(head, LENGTH_M), (body, LENGTH_M), (("width_m", width_m), WIDTH_M)] {
            if !allowed.contains(&value) {
                let (value, lowest, highest) = (Number(value), allowed.start(), allowed.end());
                return refuse(format!("{key} is {value}, must be from {lowest} to {highest}"));
            }
        }
        let limit = 0.5 * head_length_m.min(body_length_m);
        if !(hole_offset_m >= 0.0 && hole_offset_m < limit) {
            let (offset_m, limit) = (Number(hole_offset_m), Number(limit));
            return refuse(format!(
                "hole_offset_m is {offset_m}, must be at least 0 and under {limit}, half of the shortest bench"
            ));
        }
        for (key, length_m) in lengths {
            let link_m = length_m - 2.0 * hole_offset_m;
            let least_m = LEAST_LINK_M.max(length_m.max(width_m) / MOST_PER_LINK);
            if link_m < least_m {
                let [offset_m, length_m, link_m, least_m] = [hole_offset_m, length_m, link_m, least_m].map(Number);
                return refuse(format!(
                    "hole_offset_m is {offset_m}: the hinges of a bench with {key} {length_m} are {link_m} m apart, \
                     must be at least {least_m}"
                ));
            }
            if length_m > MOST_PER_WIDTH * width_m {
                let [width_m, least_m, length_m] = [width_m, length_m / MOST_PER_WIDTH, length_m].map(Number);
                return refuse(format!(
                    "width_m is {width_m}, must be at least {least_m}, a hundredth of {key} {length_m}"
                ));
            }
        }
        let (hole_diameter_m, pole_diameter_m) = (0.0, 0.0);
        Ok(Self { benches, head_length_m, body_length_m, width_m, hole_offset_m, hole_diameter_m, pole_diameter_m })
    }

    /// The same benches with loose hinges: poles of `pole_diameter_m` in holes of `hole_diameter_m`. A hole may be anywhere within
    /// the play, half of the difference, of its pole.
    ///
    /// ```
    /// use bench_dragon_geometry::dragon::Dimensions;
    ///
    /// let paper = Dimensions::new(223, 3.41, 2.20, 0.30, 0.275)?;
    /// assert!((paper.with_poles(0.055, 0.050)?.play_m() - 0.0025).abs() < 1e-15);
    ///
    /// let error = paper.with_poles(0.055, 0.056).unwrap_err();
    /// assert_eq!(error.to_string(), "pole_diameter_m is 0.056, must be above 0 and at most hole_diameter_m 0.055");
    /// # Ok::<(), bench_dragon_geometry::dragon::DimensionsError>(())
    /// ```
    ///
    /// # Errors
    /// A hole must be within its board, a pole within its hole, and the play at most [`MOST_PLAY_PER_LINK`] of the shortest link.
    pub fn with_poles(self, hole_diameter_m: f64, pole_diameter_m: f64) -> Result<Self, DimensionsError> {
        let refuse = |message: String| Err(DimensionsError(message));
        let [hole, pole] = [hole_diameter_m, pole_diameter_m].map(Number);
        let room_m = self.width_m.min(2.0 * self.hole_offset_m);
        if !(hole_diameter_m > 0.0 && hole_diameter_m <= room_m) {
            let [width, twice] = [self.width_m, 2.0 * self.hole_offset_m].map(Number);
            return refuse(format!(
                "hole_diameter_m is {hole}, must be above 0, and at most width_m {width} and twice hole_offset_m, {twice}"
            ));
        }
        if !(pole_diameter_m > 0.0 && pole_diameter_m <= hole_diameter_m) {
            return refuse(format!("pole_diameter_m is {pole}, must be above 0 and at most hole_diameter_m {hole}"));
        }
        let loose = Self { hole_diameter_m, pole_diameter_m, ..self };
        let most_m = MOST_PLAY_PER_LINK * self.link_m(0).min(self.link_m(1));
        if loose.play_m() > most_m {
            let least = Number(hole_diameter_m - 2.0 * most_m);
            return refuse(format!(
                "pole_diameter_m is {pole}, must be at least {least}: the play of a hinge is at most {MOST_PLAY_PER_LINK} of the \
                 shortest link"
            ));
        }
        Ok(if loose.play_m() > 0.0 { loose } else { self.without_play() })
    }

    /// The same benches with hinges without play.
    #[must_use]
    pub fn without_play(self) -> Self {
        Self { hole_diameter_m: 0.0, pole_diameter_m: 0.0, ..self }
    }

    /// The same boards without play, with links that are longer by `by_m`.
    pub(super) fn with_longer_links(self, by_m: f64) -> Self {
        Self { hole_offset_m: self.hole_offset_m - 0.5 * by_m, ..self.without_play() }
    }

    /// The same benches, but `benches` of them, which must not be 0.
    pub(crate) fn with_benches(self, benches: usize) -> Self {
        assert!(benches > 0, "a dragon without benches");
        Self { benches, ..self }
    }

    /// The same links with boards that extend half of `clearance_m` further on every side. Two boards within `clearance_m` of
    /// each other overlap once both are grown. The converse need not hold, because the corners of a grown board are square.
    pub(crate) fn grown(self, clearance_m: f64) -> Self {
        Self {
            head_length_m: self.head_length_m + clearance_m,
            body_length_m: self.body_length_m + clearance_m,
            width_m: self.width_m + clearance_m,
            hole_offset_m: self.hole_offset_m + 0.5 * clearance_m,
            ..self
        }
    }

    /// Number of benches, N.
    pub fn benches(&self) -> usize {
        self.benches
    }

    /// Number of handles, N + 1.
    pub fn handles(&self) -> usize {
        self.benches + 1
    }

    /// The benches behind `bench` that form a pair with it, in a dragon of `benches` benches.
    pub(crate) fn partners(bench: usize, benches: usize) -> Range<usize> {
        bench + 2..benches
    }

    /// The pairs that contain a leading bench, in a dragon of `benches` benches.
    pub(crate) fn leading_pairs(benches: usize) -> impl Iterator<Item = [usize; 2]> {
        let partners = move |first| Self::partners(first, benches).map(move |second| [first, second]);
        (0..Self::LEADING).flat_map(partners)
    }

    /// Length of all links together, in metres.
    pub fn links_m(&self) -> f64 {
        self.link_m(0) + (self.benches() - 1) as f64 * self.link_m(1)
    }

    /// Length of the head's board.
    pub fn head_length_m(&self) -> f64 {
        self.head_length_m
    }

    /// Length of every other board.
    pub fn body_length_m(&self) -> f64 {
        self.body_length_m
    }

    /// Width of every board.
    pub fn width_m(&self) -> f64 {
        self.width_m
    }

    /// Distance of a hinge hole from the nearer end of the board.
    pub fn hole_offset_m(&self) -> f64 {
        self.hole_offset_m
    }

    /// Diameter of the holes of loose hinges; 0 for hinges without play.
    pub fn hole_diameter_m(&self) -> f64 {
        self.hole_diameter_m
    }

    /// Diameter of the poles of loose hinges; 0 for hinges without play.
    pub fn pole_diameter_m(&self) -> f64 {
        self.pole_diameter_m
    }

    /// Play c of the hinges: how far the middle of a hole may be from that of its pole, in metres. 0 for hinges without play.
    pub fn play_m(&self) -> f64 {
        0.5 * (self.hole_diameter_m - self.pole_diameter_m)
    }

    /// Length of all links together with all of their play, in metres.
    pub fn longest_m(&self) -> f64 {
        self.links_m() + 2.0 * self.play_m() * self.benches as f64
    }

    /// Length of a bench's board.
    pub fn length_m(&self, bench: usize) -> f64 {
        if bench == 0 { self.head_length_m } else { self.body_length_m }
    }

    /// Distance between the two hinges of a bench.
    pub fn link_m(&self, bench: usize) -> f64 {
        self.length_m(bench) - 2.0 * self.hole_offset_m
    }

    /// Distance between a hinge and the nearest corners of its board.
    pub fn overhang_m(&self) -> f64 {
        DVec2::new(self.hole_offset_m, 0.5 * self.width_m).length()
    }
}
