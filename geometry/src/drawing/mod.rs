//! Drawings: curves of lines, arcs and Bézier curves, and the paths of lines and arcs that follow them.
//!
//! A route consists of lines and arcs with common tangents. [`Drawing::fit`] finds such a path within a tolerance of a drawn
//! curve. Lines and arcs that join with a common tangent stay as they are. Other curves become few arcs. Corners are rounded.
//!
//! A polyline may be a sampled curve. Its points are the samples of a smooth curve where arcs within the tolerance can follow
//! its edges from the middle of each to the middle of the next. Elsewhere they are corners, or points of a smooth curve if
//! [`FitSettings::joins_samples`] is set.

mod arc_spline;
mod biarc;
mod corner;
mod curve;
mod element;
mod error;
mod fit;
mod joint;
mod part;
mod runs;
mod samples;
mod simplify;
mod spline;

use glam::DVec2;

pub use curve::{Bezier, Piece};
pub use error::DrawingError;
pub use spline::Spline;

use crate::route::{PathSegment, Placement};

/// Largest coordinate of a drawing, in metres.
pub const MAX_COORDINATE_M: f64 = 100_000.0;

/// A drawn curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Its pieces. Each begins where the one before ends.
    pub pieces: Vec<Piece>,
    /// Whether its end joins its beginning.
    pub is_closed: bool,
}

/// How near a path must be to a drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitSettings {
    /// Largest distance between the path and the drawing outside rounded corners, in metres.
    pub tolerance_m: f64,
    /// Radius of rounded corners, in metres; without one, a corner is an error.
    pub corner_radius_m: Option<f64>,
    /// Whether the points of a polyline are samples of a smooth curve, even where the curve is further than the tolerance from
    /// the edges between them. Its distance from the path is then that of the curve.
    pub joins_samples: bool,
}

/// A path that follows a drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Where the path begins, and its direction there.
    pub begin: Placement,
    /// Its segments. Angles are whole results of a conversion from degrees, so a written path has the same bits.
    pub segments: Vec<PathSegment>,
    /// Bound on the distance between the path and the drawing outside rounded corners, in metres: from each to the other.
    pub error_m: f64,
    /// Number of rounded corners.
    pub corners: usize,
    /// Extent of the path along x and y, in metres.
    pub size_m: DVec2,
}

impl Drawing {
    /// The drawing of a polyline.
    pub fn polyline(points: &[DVec2], is_closed: bool) -> Self {
        let line = |pair: &[DVec2]| Piece::Line { from: pair[0], to: pair[1] };
        let mut pieces: Vec<Piece> = points.windows(2).map(line).collect();
        if let (true, Some(&first), Some(&last)) = (is_closed, points.first(), points.last()) {
            pieces.push(Piece::Line { from: last, to: first });
        }
        Self { pieces, is_closed }
    }

    /// Its length, in metres: that of Bézier curves to about a millionth of their extent.
    pub fn length_m(&self) -> f64 {
        self.pieces.iter().map(Piece::length_m).sum()
    }

    /// The path that follows the drawing with few segments.
    ///
    /// ```
    /// use bench_dragon_geometry::drawing::{Drawing, FitSettings};
    /// use glam::DVec2;
    ///
    /// let bend = Drawing::polyline(&[DVec2::ZERO, DVec2::new(9.0, 0.0), DVec2::new(9.0, 9.0)], false);
    /// let fit = bend.fit(&FitSettings { tolerance_m: 0.005, corner_radius_m: Some(3.0), joins_samples: false })?;
    /// assert_eq!((fit.segments.len(), fit.corners), (3, 1));
    /// # Ok::<(), bench_dragon_geometry::drawing::DrawingError>(())
    /// ```
    ///
    /// # Errors
    /// The drawing is empty, interrupted or too large, it has a corner that cannot be rounded, or it turns too sharply.
    pub fn fit(&self, settings: &FitSettings) -> Result<Fit, DrawingError> {
        fit::fit(self, settings)
    }
}
