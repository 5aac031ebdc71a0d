//! How many benches a dragon has and how big they are.

use std::ops::{Range, RangeInclusive};

use thiserror::Error;

use crate::number::Number;

/// Benches of the longest dragon.
pub const MAX_BENCHES: usize = 100_000;
/// Lengths of a board, in metres.
pub const LENGTH_M: RangeInclusive<f64> = 0.02..=100.0;
/// Widths of a board, in metres.
pub const WIDTH_M: RangeInclusive<f64> = 0.01..=100.0;
/// Least distance between the two hinges of a bench, in metres.
pub const LEAST_LINK_M: f64 = 0.01;
/// A board is at most this many times as long, and as wide, as its two hinges are apart.
pub const MOST_PER_LINK: f64 = 20.0;
/// A board is at most this many times as long as it is wide.
pub const MOST_PER_WIDTH: f64 = 100.0;

/// Why dimensions cannot be those of a dragon: the configuration's name of the value, the value, and what is allowed.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{0}")]
pub struct DimensionsError(String);

/// The benches of a dragon: a board each, with two hinge holes `hole_offset_m` from its ends. Bench 0 is the head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dimensions {
    benches: usize,
    head_length_m: f64,
    body_length_m: f64,
    width_m: f64,
    hole_offset_m: f64,
}

impl Dimensions {
    /// Benches at the head that do not repeat others: the head, and the first body bench. All benches behind them are alike, so each
    /// comes to stand where the one before it stood, with the same benches behind it.
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
    /// 1 to [`MAX_BENCHES`] benches; lengths of [`LENGTH_M`] and a width of [`WIDTH_M`]; hinges at least [`LEAST_LINK_M`]
    /// apart; proportions up to [`MOST_PER_LINK`] and [`MOST_PER_WIDTH`]. The proportions bound how many boards can lie
    /// near to one, and so the work of a search.
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
        Ok(Self { benches, head_length_m, body_length_m, width_m, hole_offset_m })
    }

    /// The same benches, but for their number, which must not be 0.
    pub(crate) fn with_benches(self, benches: usize) -> Self {
        assert!(benches > 0, "a dragon of no benches");
        Self { benches, ..self }
    }

    /// The same links under boards that reach further by half of `clearance_m` on every side. Boards within `clearance_m` of
    /// each other overlap when both are grown so; the converse need not hold, because the corners of a grown board are square.
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

    /// Whether two benches make a pair, whose clearance counts: neighbours on a hinge do not.
    pub(crate) fn is_pair(one: usize, other: usize) -> bool {
        one.abs_diff(other) > 1
    }

    /// The benches behind one that make a pair with it, among so many benches.
    pub(crate) fn partners(bench: usize, benches: usize) -> Range<usize> {
        bench + 2..benches
    }

    /// The pairs of which one is a leading bench, among so many benches.
    pub(crate) fn leading_pairs(benches: usize) -> impl Iterator<Item = [usize; 2]> {
        let partners = move |first| Self::partners(first, benches).map(move |second| [first, second]);
        (0..Self::LEADING).flat_map(partners)
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

    /// Distance of a hinge hole from its end of the board.
    pub fn hole_offset_m(&self) -> f64 {
        self.hole_offset_m
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
        self.hole_offset_m.hypot(0.5 * self.width_m)
    }
}
