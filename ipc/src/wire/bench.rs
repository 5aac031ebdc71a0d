//! One bench of a frame: its board's centre, heading and velocity.
//!
//! A bench lies between its two handles, the hinges at its front and rear. Both handles have the same distance from the
//! board's ends. So the board's centre is the midpoint of the handles. The board is rigid, so the centre's velocity is
//! the mean of the handles' velocities.

use super::frame::HandleState;

/// Position and motion of one bench.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BenchState {
    /// Centre of the board in metres.
    pub centre_m: [f64; 3],
    /// Direction from the rear handle to the front one, in radians counter-clockwise from +x, −π to π.
    pub heading_rad: f64,
    /// Velocity of the centre in metres per show second; 0 while the head stands.
    pub velocity_mps: [f64; 3],
    /// Rate of the heading in radians per show second, counter-clockwise.
    pub turn_rate_radps: f64,
    /// Angle by which the front handle is above the rear one, seen from there, in radians: 0 on level ground.
    pub pitch_rad: f64,
}

impl BenchState {
    /// Returns the bench between two handles. Bench i lies between handles i and i + 1.
    ///
    /// ```
    /// use bench_dragon_ipc::{BenchState, HandleState};
    ///
    /// // The front handle is 2 m in +y of the rear one and walks to the left, so the bench turns counter-clockwise.
    /// let front = HandleState { position_m: [1.0, 3.0, 0.0], velocity_mps: [-0.5, 0.0, 0.0] };
    /// let rear = HandleState { position_m: [1.0, 1.0, 0.0], velocity_mps: [0.0, 0.0, 0.0] };
    /// let bench = BenchState::between(&front, &rear);
    /// assert_eq!((bench.centre_m, bench.velocity_mps), ([1.0, 2.0, 0.0], [-0.25, 0.0, 0.0]));
    /// assert_eq!((bench.heading_rad, bench.turn_rate_radps), (std::f64::consts::FRAC_PI_2, 0.25));
    ///
    /// let uphill = HandleState { position_m: [1.0, 3.0, 2.0], ..front };
    /// assert_eq!(BenchState::between(&uphill, &rear).pitch_rad, std::f64::consts::FRAC_PI_4);
    /// ```
    pub fn between(front: &HandleState, rear: &HandleState) -> Self {
        let middle = |[ax, ay, az]: [f64; 3], [bx, by, bz]: [f64; 3]| {
            [f64::midpoint(ax, bx), f64::midpoint(ay, by), f64::midpoint(az, bz)]
        };
        let along = |axis: usize| front.position_m[axis] - rear.position_m[axis];
        let against = |axis: usize| front.velocity_mps[axis] - rear.velocity_mps[axis];
        let (x, y) = (along(0), along(1));
        let squared = x * x + y * y;
        let turn = x * against(1) - y * against(0);
        Self {
            centre_m: middle(front.position_m, rear.position_m),
            heading_rad: y.atan2(x),
            velocity_mps: middle(front.velocity_mps, rear.velocity_mps),
            turn_rate_radps: if squared > 0.0 { turn / squared } else { 0.0 },
            pitch_rad: along(2).atan2(squared.sqrt()),
        }
    }

    /// Returns the benches between these handles of one dragon, the head first. There is one bench fewer than handles. For a frame
    /// of several dragons: [`FrameHeader::benches`](super::FrameHeader::benches).
    pub fn all(handles: &[HandleState]) -> impl ExactSizeIterator<Item = Self> {
        handles.windows(2).map(|pair| Self::between(&pair[0], &pair[1]))
    }

    /// Speed of the centre in metres per show second.
    pub fn speed_mps(&self) -> f64 {
        let [x, y, z] = self.velocity_mps;
        x.hypot(y).hypot(z)
    }
}
