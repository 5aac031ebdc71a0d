//! How many benches a dragon has and how big they are.

use thiserror::Error;

use crate::number::Number;

/// Benches of the longest dragon.
pub const MAX_BENCHES: usize = 100_000;

/// Why dimensions cannot be those of a dragon.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum DimensionsError {
    /// Not a number of benches.
    #[error("benches is {0}, must be from 1 to {MAX_BENCHES}")]
    Benches(usize),
    /// Not a length.
    #[error("{key} is {}, must be above 0 and finite", Number(*value))]
    Length {
        /// The configuration's name of the value.
        key: &'static str,
        /// Metres.
        value: f64,
    },
    /// Not a place for a hole.
    #[error(
        "hole_offset_m is {}, must be at least 0 and under {}, half of the shortest bench",
        Number(*value),
        Number(*limit)
    )]
    HoleOffset {
        /// Metres.
        value: f64,
        /// Metres.
        limit: f64,
    },
}

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
    /// Dimensions of a dragon, in metres.
    ///
    /// ```
    /// use bench_dragon::dragon::Dimensions;
    ///
    /// let paper = Dimensions::new(223, 3.41, 2.20, 0.30, 0.275)?;
    /// assert_eq!(paper.handles(), 224);
    /// assert!((paper.link_m(0) - 2.86).abs() < 1e-15);
    ///
    /// let error = Dimensions::new(223, 3.41, 2.20, 0.30, 1.2).unwrap_err();
    /// let text = "hole_offset_m is 1.2, must be at least 0 and under 1.1, half of the shortest bench";
    /// assert_eq!(error.to_string(), text);
    /// # Ok::<(), bench_dragon::dragon::DimensionsError>(())
    /// ```
    ///
    /// # Errors
    /// 1 to 100 000 benches; lengths and width above 0 and finite; the two holes of every bench apart.
    pub fn new(
        benches: usize,
        head_length_m: f64,
        body_length_m: f64,
        width_m: f64,
        hole_offset_m: f64,
    ) -> Result<Self, DimensionsError> {
        if !(1..=MAX_BENCHES).contains(&benches) {
            return Err(DimensionsError::Benches(benches));
        }
        for (key, value) in [("head_length_m", head_length_m), ("body_length_m", body_length_m), ("width_m", width_m)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(DimensionsError::Length { key, value });
            }
        }
        let limit = 0.5 * head_length_m.min(body_length_m);
        if !(hole_offset_m >= 0.0 && hole_offset_m < limit) {
            return Err(DimensionsError::HoleOffset { value: hole_offset_m, limit });
        }
        Ok(Self { benches, head_length_m, body_length_m, width_m, hole_offset_m })
    }

    /// The same benches, but for their number, which must not be 0.
    pub(crate) fn with_benches(self, benches: usize) -> Self {
        assert!(benches > 0, "a dragon of no benches");
        Self { benches, ..self }
    }

    /// Number of benches, N.
    pub fn benches(&self) -> usize {
        self.benches
    }

    /// Number of handles, N + 1.
    pub fn handles(&self) -> usize {
        self.benches + 1
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
