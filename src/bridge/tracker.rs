//! A bench as a tracker, in PosiStageNet's axes.
//!
//! Its x is right, its y up, its z depth, away from the audience: our (x, y, z) is its (x, z, y). Two axes are exchanged, so
//! what is right-handed here is left-handed there, and a turn changes its sign. An orientation is the rotation that takes a
//! board which points along +x to where it points: a vector along the axis of rotation, as long as the angle in radians. So a
//! heading h is (0, −h, 0).
//!
//! An example: a bench at (3, 4, 0) that points and walks in +y at 1 m/s has heading π/2. As a tracker it is at (3, 0, 4),
//! its speed is (0, 0, 1), and its orientation (0, −π/2, 0) turns (1, 0, 0) into (0, 0, 1).

use bench_dragon_ipc::BenchState;

/// What a DATA packet says of one tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tracker {
    /// Its number: the bench's, 0 being the head.
    pub(super) id: u16,
    /// Centre of the board in metres.
    pub(super) position_m: [f32; 3],
    /// Velocity in metres per second of wall time.
    pub(super) speed_mps: [f32; 3],
    /// Rotation vector in radians.
    pub(super) orientation_rad: [f32; 3],
    /// 1 where it can be believed, 0 where the server is silent.
    pub(super) validity: f32,
    /// When the server sent it, in microseconds on the clock of the packet's header.
    pub(super) timestamp_us: u64,
}

impl Tracker {
    /// A bench. `speed_factor` turns its speed into wall time, or into 0.
    pub(super) fn of_bench(id: u16, bench: &BenchState, speed_factor: f64, validity: f32, timestamp_us: u64) -> Self {
        Self {
            id,
            position_m: to_psn(bench.centre_m),
            speed_mps: to_psn(bench.velocity_mps.map(|value| value * speed_factor)),
            orientation_rad: [0.0, -bench.heading_rad as f32, 0.0],
            validity,
            timestamp_us,
        }
    }
}

fn to_psn([x, y, z]: [f64; 3]) -> [f32; 3] {
    [x as f32, z as f32, y as f32]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use bench_dragon_ipc::HandleState;
    use glam::Vec3;

    use super::*;

    fn bench(front: [f64; 3], rear: [f64; 3], velocity_mps: [f64; 3]) -> BenchState {
        let handle = |position_m| HandleState { position_m, velocity_mps };
        BenchState::between(&handle(front), &handle(rear))
    }

    #[test]
    fn a_bench_that_walks_upstage_is_the_documented_tracker() {
        let walking = bench([3.0, 5.0, 0.0], [3.0, 3.0, 0.0], [0.0, 1.0, 0.0]);
        assert_eq!(walking.heading_rad, FRAC_PI_2);
        let tracker = Tracker::of_bench(7, &walking, 1.0, 1.0, 42);
        assert_eq!((tracker.id, tracker.validity, tracker.timestamp_us), (7, 1.0, 42));
        assert_eq!(tracker.position_m, [3.0, 0.0, 4.0]);
        assert_eq!(tracker.speed_mps, [0.0, 0.0, 1.0]);
        assert_eq!(tracker.orientation_rad, [0.0, -std::f32::consts::FRAC_PI_2, 0.0]);
    }

    #[test]
    fn height_is_its_y() {
        let raised = bench([2.0, 1.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 0.25]);
        let tracker = Tracker::of_bench(0, &raised, 1.0, 1.0, 0);
        assert_eq!((tracker.position_m, tracker.speed_mps), ([1.0, 0.5, 1.0], [0.0, 0.25, 0.0]));
    }

    #[test]
    fn the_orientation_turns_plus_x_into_the_direction_of_the_board() {
        for step in -8..=8 {
            let heading = f64::from(step) * PI / 8.0;
            let direction = [heading.cos(), heading.sin(), 0.0];
            let board = bench(direction, [0.0; 3], [0.0; 3]);
            let tracker = Tracker::of_bench(0, &board, 1.0, 1.0, 0);
            let rotation = glam::Quat::from_scaled_axis(Vec3::from(tracker.orientation_rad));
            let turned = rotation * Vec3::X;
            let apart = turned.distance(Vec3::from(to_psn(direction)));
            assert!(apart < 1e-6, "{heading}: {turned} instead of {direction:?}");
        }
    }

    #[test]
    fn speeds_are_told_in_wall_time() {
        let walking = bench([1.0, 0.0, 0.0], [0.0; 3], [0.5, 0.0, 0.0]);
        let speed = |factor| Tracker::of_bench(0, &walking, factor, 1.0, 0).speed_mps;
        assert_eq!((speed(20.0), speed(0.0)), ([10.0, 0.0, 0.0], [0.0; 3]));
    }
}
