//! A handle of a frame, in the layout of the bus.

use glam::DVec3;

/// A handle of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct HandleState {
    /// Position in metres.
    pub position_m: [f64; 3],
    /// Velocity in metres per second.
    pub velocity_mps: [f64; 3],
}

impl HandleState {
    /// The handle at a position, with a velocity.
    pub fn new(position_m: DVec3, velocity_mps: DVec3) -> Self {
        Self { position_m: position_m.into(), velocity_mps: velocity_mps.into() }
    }
}
