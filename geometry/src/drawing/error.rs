//! Errors of a drawing.

use glam::DVec2;
use thiserror::Error;

use crate::number::{Number, Place};

/// Reason why a drawing has no route.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum DrawingError {
    /// A coordinate is not a number, or too large.
    #[error(
        "part {part} of the path has a coordinate or a length of {} m, must be a number from -{limit_m} to {limit_m}",
        Number(*value_m)
    )]
    Coordinate {
        /// Number of the piece, from 1.
        part: usize,
        /// The coordinate, or the extent of the piece, in metres.
        value_m: f64,
        /// Largest allowed coordinate, in metres.
        limit_m: f64,
    },
    /// Nothing is drawn, or less than a micrometre.
    #[error("the path has no length")]
    Empty,
    /// A piece begins elsewhere than the one before ends.
    #[error("the path is interrupted at {}: the next part begins {} m further", Place::<3>(at.to_array()), Rounded(*gap_m))]
    Gap {
        /// Where the path is interrupted.
        at: DVec2,
        /// Distance to the next piece, in metres.
        gap_m: f64,
    },
    /// The path is to be closed, but its ends are apart.
    #[error(
        "closed: the path ends at {}, {} m from its beginning, at most {} m is allowed",
        Place::<3>(at.to_array()), Rounded(*gap_m), Rounded(*limit_m)
    )]
    Open {
        /// Where the path ends.
        at: DVec2,
        /// Distance to its beginning, in metres.
        gap_m: f64,
        /// Largest allowed distance, in metres.
        limit_m: f64,
    },
    /// The path runs back along itself.
    #[error("the path turns back on itself at {}, which no radius rounds", Place::<3>(at.to_array()))]
    TurnsBack {
        /// Where it turns.
        at: DVec2,
    },
    /// There is a corner, and no radius to round it.
    #[error("the path has a corner of {:.1}° at {}: set corner_radius_m to round it", turn.to_degrees(), Place::<3>(at.to_array()))]
    Corner {
        /// Where the corner is.
        at: DVec2,
        /// Angle by which the path turns there, above 0.
        turn: f64,
    },
    /// The radius of a corner is too large for the pieces next to it.
    #[error(
        "corner_radius_m is {}, does not fit into the corner of {:.1}° at {}: at most {largest_m:.3} m fits",
        Number(*radius_m), turn.to_degrees(), Place::<3>(at.to_array())
    )]
    Radius {
        /// Where the corner is.
        at: DVec2,
        /// Angle by which the path turns there, above 0.
        turn: f64,
        /// Radius that does not fit, in metres.
        radius_m: f64,
        /// Largest radius that fits, in metres.
        largest_m: f64,
    },
    /// The path turns more tightly than arcs within the tolerance can follow.
    #[error("the path turns back or too sharply near {}", Place::<3>(at.to_array()))]
    Sharp {
        /// Where it turns.
        at: DVec2,
    },
    /// The path needs too many segments.
    #[error("the path needs more than {limit} segments: set tolerance_m to more")]
    Segments {
        /// Most segments of a fit.
        limit: usize,
    },
    /// The curve that was found is too far from the drawing.
    #[error("no arcs within {} m of the drawing were found, the nearest are {error_m:.6} m away", Number(*tolerance_m))]
    Tolerance {
        /// Allowed distance, in metres.
        tolerance_m: f64,
        /// Distance of the best fit, in metres.
        error_m: f64,
    },
}

/// A length in metres, for a message: in whole millimetres, below a centimetre in whole micrometres.
struct Rounded(f64);

impl std::fmt::Display for Rounded {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let parts = if self.0 < 0.01 { 1e6 } else { 1e3 };
        Number((self.0 * parts).round() / parts).fmt(f)
    }
}
