//! Ground that is not flat: a plane, or a map of heights. The handles walk at a fixed height above it.

mod height_map;

use glam::DVec2;
use thiserror::Error;

use crate::number::Number;

pub use height_map::{HEIGHT_M, HeightMap, HeightMapError, HeightRun, MAX_HEIGHTS, SPACING_M};

pub(crate) use height_map::{Patch, Slopes};

/// Steepest slope on which a dragon walks, as rise per metre: 45°.
pub const MAX_SLOPE: f64 = 1.0;
/// Largest height of the handles above the ground, in metres.
pub const MAX_CARRY_HEIGHT_M: f64 = 100.0;

/// Error of an invalid ground: the configuration key, the value, and what is allowed.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum GroundError {
    /// The plane is too steep.
    #[error("rise_x {} and rise_y {} are a slope of {}, must be at most {MAX_SLOPE}", Number(rise.x), Number(rise.y), Number(rise.length()))]
    TooSteep {
        /// Rise per metre in the directions of x and y.
        rise: DVec2,
    },
    /// The handles are too high, or a number is not finite.
    #[error("carry_height_m is {}, must be from -{MAX_CARRY_HEIGHT_M} to {MAX_CARRY_HEIGHT_M}", Number(*carry_height_m))]
    CarryHeight {
        /// Height of the handles above the ground, in metres.
        carry_height_m: f64,
    },
}

/// The ground, and the height at which the handles are carried above it.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    surface: Surface,
    carry_height_m: f64,
}

#[derive(Clone, Debug, PartialEq)]
enum Surface {
    Plane { rise: DVec2 },
    Map(HeightMap),
}

/// Indices of a cell of a map: column and row of its corner with the least x and y. A plane has one cell.
pub(crate) type Cell = [usize; 2];

impl Ground {
    /// The plane z = `rise.x`·x + `rise.y`·y.
    ///
    /// ```
    /// use bench_dragon_geometry::ground::Ground;
    /// use glam::DVec2;
    ///
    /// let slope = Ground::plane(DVec2::new(0.1, 0.0))?.carried_at(1.2)?;
    /// assert_eq!(slope.height_m(DVec2::new(3.0, 7.0)), Some(1.5));
    /// # Ok::<(), bench_dragon_geometry::ground::GroundError>(())
    /// ```
    ///
    /// # Errors
    /// The slope is above [`MAX_SLOPE`].
    pub fn plane(rise: DVec2) -> Result<Self, GroundError> {
        if rise.length() <= MAX_SLOPE {
            Ok(Self { surface: Surface::Plane { rise }, carry_height_m: 0.0 })
        } else {
            Err(GroundError::TooSteep { rise })
        }
    }

    /// The ground of a map of heights.
    pub fn map(map: HeightMap) -> Self {
        Self { surface: Surface::Map(map), carry_height_m: 0.0 }
    }

    /// The same ground with handles that are carried at another height above it.
    ///
    /// # Errors
    /// The height is more than [`MAX_CARRY_HEIGHT_M`] from 0.
    pub fn carried_at(self, carry_height_m: f64) -> Result<Self, GroundError> {
        if carry_height_m.abs() <= MAX_CARRY_HEIGHT_M {
            Ok(Self { carry_height_m, ..self })
        } else {
            Err(GroundError::CarryHeight { carry_height_m })
        }
    }

    /// The map of the heights; `None` for a plane.
    pub fn height_map(&self) -> Option<&HeightMap> {
        if let Surface::Map(map) = &self.surface { Some(map) } else { None }
    }

    /// Height of a handle at a position, in metres; `None` where the map has no heights.
    pub fn height_m(&self, position: DVec2) -> Option<f64> {
        let patch = self.patch(self.cell(position)?);
        Some(patch.base_m + patch.relief_m(position))
    }

    /// The cell at a position; `None` where the map has no heights.
    pub(crate) fn cell(&self, position: DVec2) -> Option<Cell> {
        match &self.surface {
            Surface::Plane { .. } => Some([0; 2]),
            Surface::Map(map) => map.cell(position),
        }
    }

    /// The heights of handles over a cell.
    pub(crate) fn patch(&self, cell: Cell) -> Patch {
        let mut patch = match &self.surface {
            Surface::Plane { rise } => Patch::plane(*rise),
            Surface::Map(map) => map.patch(cell),
        };
        patch.base_m += self.carry_height_m;
        patch
    }
}
