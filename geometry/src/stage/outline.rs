//! A simple polygon: the outline of a stage, or the edge of an area.

use glam::DVec2;
use thiserror::Error;

use super::edge::{Edge, GRAZE_M, least_distance_m, surround};
use crate::number::Number;

/// Least area of an outline, in m².
const LEAST_AREA_M2: f64 = 1e-6;

/// A simple polygon with either orientation.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    corners: Vec<DVec2>,
}

/// Reason why an outline, or a line, is invalid. Points are numbered from 1.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum OutlineError {
    /// There are too few or too many points.
    #[error("has {points} points, must have from 3 to {}", Outline::MAX_POINTS)]
    Points {
        /// Number of points.
        points: usize,
    },
    /// A line has too few or too many points.
    #[error("has {points} points, must have from 2 to {}", Outline::MAX_POINTS)]
    LinePoints {
        /// Number of points.
        points: usize,
    },
    /// A coordinate is out of range.
    #[error("point {point} has the coordinate {}, must be from -{max} to {max}", Number(*value), max = Outline::MAX_M)]
    Coordinate {
        /// Number of the point.
        point: usize,
        /// The coordinate in metres.
        value: f64,
    },
    /// Two neighbouring points are the same.
    #[error("points {first} and {second} are the same, must differ: leave out one of them")]
    Repeated {
        /// Number of the first point.
        first: usize,
        /// Number of the second point: the next one, or the last.
        second: usize,
    },
    /// Two edges cross or touch.
    #[error("crosses or touches itself: the edges from points {first} and {second} meet, must not")]
    Crossing {
        /// Number of the point at which the first edge begins.
        first: usize,
        /// Number of the point at which the second edge begins.
        second: usize,
    },
    /// All points lie on a line.
    #[error("encloses {} m², must enclose more than {LEAST_AREA_M2} m²", Number(*area_m2))]
    Area {
        /// The enclosed area.
        area_m2: f64,
    },
}

impl Outline {
    /// Greatest number of points.
    pub const MAX_POINTS: usize = 256;
    /// Greatest coordinate, in metres.
    pub const MAX_M: f64 = 1_000_000.0;

    /// The polygon with these corners, in metres.
    ///
    /// # Errors
    /// It needs 3 to [`MAX_POINTS`](Self::MAX_POINTS) points in range, an area, and edges that meet only at their common
    /// corners.
    pub fn new(points_m: &[[f64; 2]]) -> Result<Self, OutlineError> {
        let points = points_m.len();
        if !(3..=Self::MAX_POINTS).contains(&points) {
            return Err(OutlineError::Points { points });
        }
        let outline = Self { corners: points_in_range(points_m)? };
        outline.check_repeated()?;
        outline.check_crossings()?;
        let area_m2 = outline.area_m2();
        if area_m2 > LEAST_AREA_M2 { Ok(outline) } else { Err(OutlineError::Area { area_m2 }) }
    }

    /// The corners, in the given order.
    pub fn corners(&self) -> &[DVec2] {
        &self.corners
    }

    /// Whether a point lies inside. On an edge: either.
    pub fn contains(&self, point: DVec2) -> bool {
        surround(self.edges(), point)
    }

    /// Distance of a point from the outline.
    pub fn distance_m(&self, point: DVec2) -> f64 {
        least_distance_m(self.edges(), point)
    }

    pub(super) fn into_corners(self) -> Vec<DVec2> {
        self.corners
    }

    fn edges(&self) -> impl Iterator<Item = Edge> {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).map(|(&from, &to)| Edge { from, to })
    }

    fn area_m2(&self) -> f64 {
        let origin = self.corners[0];
        let doubled: f64 = self.edges().map(|edge| (edge.from - origin).perp_dot(edge.to - origin)).sum();
        0.5 * doubled.abs()
    }

    /// Checks that each edge has a length.
    fn check_repeated(&self) -> Result<(), OutlineError> {
        let count = self.corners.len();
        match self.edges().position(|edge| edge.from.distance(edge.to) <= GRAZE_M) {
            Some(last) if last + 1 == count => Err(OutlineError::Repeated { first: 1, second: count }),
            Some(i) => Err(OutlineError::Repeated { first: i + 1, second: i + 2 }),
            None => Ok(()),
        }
    }

    /// Checks that edges meet only at their common corners.
    fn check_crossings(&self) -> Result<(), OutlineError> {
        let edges: Vec<Edge> = self.edges().collect();
        for (second, other) in edges.iter().enumerate() {
            for (first, edge) in edges[..second].iter().enumerate() {
                let is_closing = first == 0 && second == edges.len() - 1;
                let meets = match (second - first, is_closing) {
                    (1, _) => edge.folds_onto(other),
                    (_, true) => other.folds_onto(edge),
                    _ => edge.touches(other),
                };
                if meets {
                    return Err(OutlineError::Crossing { first: first + 1, second: second + 1 });
                }
            }
        }
        Ok(())
    }
}

/// The points, whose coordinates must be in range.
pub(super) fn points_in_range(points_m: &[[f64; 2]]) -> Result<Vec<DVec2>, OutlineError> {
    for (point, coordinates) in (1..).zip(points_m) {
        let outlying = coordinates.iter().find(|value| value.is_nan() || value.abs() > Outline::MAX_M);
        outlying.map_or(Ok(()), |&value| Err(OutlineError::Coordinate { point, value }))?;
    }
    Ok(points_m.iter().map(|&point| point.into()).collect())
}
