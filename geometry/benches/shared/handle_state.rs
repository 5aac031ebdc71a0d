//! A handle of a frame, in the layout of the bus.

use glam::DVec2;

/// A handle of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct HandleState {
    /// Position in metres.
    pub position_m: [f64; 3],
    /// Velocity in metres per second.
    pub velocity_mps: [f64; 3],
}

impl HandleState {
    /// The handle on level ground.
    pub fn new(position_m: DVec2, velocity_mps: DVec2) -> Self {
        Self { position_m: [position_m.x, position_m.y, 0.0], velocity_mps: [velocity_mps.x, velocity_mps.y, 0.0] }
    }
}
