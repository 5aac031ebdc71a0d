//! Bench poses for viewers: centre and heading of every board, thirty times a second.

use bench_dragon_ipc::{BenchState, HandleState};
use serde::Serialize;

/// Thirty poses a second of wall time.
const PERIOD_NS: u64 = 1_000_000_000 / 30;

/// Where one bench lies: `geometry_msgs/msg/Pose`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Pose {
    /// Centre of the board, in metres.
    pub position: [f64; 3],
    /// Heading from the rear handle to the front one, as the quaternion x, y, z, w of a turn about z.
    pub orientation: [f64; 4],
}

impl Pose {
    /// The pose of a bench: a heading of +π/2, in which its front handle lies in direction +y of its rear one, is a
    /// quarter turn about z.
    pub fn of(bench: &BenchState) -> Self {
        let (sine, cosine) = (bench.heading_rad / 2.0).sin_cos();
        Self { position: bench.centre_m, orientation: [0.0, 0.0, sine, cosine] }
    }
}

/// The poses of all benches, the head first: one fewer than handles.
pub fn bench_poses(handles: &[HandleState]) -> impl ExactSizeIterator<Item = Pose> {
    BenchState::all(handles).map(|bench| Pose::of(&bench))
}

/// Chooses the frames whose poses are recorded.
///
/// A pose is due every thirtieth of a second, and the first frame no more than half of that before it is chosen. So the
/// mean rate is 30 Hz at any higher frame rate, every frame is chosen at 30 Hz and below however it jitters, and a pause
/// is not made up for.
#[derive(Clone, Copy, Debug, Default)]
pub struct PoseRate {
    due_ns: u64,
}

impl PoseRate {
    /// Whether the frame sent at `published_ns`, later than the one asked for before, is chosen.
    pub fn is_due(&mut self, published_ns: u64) -> bool {
        let is_due = published_ns + PERIOD_NS / 2 >= self.due_ns;
        if is_due {
            self.due_ns = (self.due_ns + PERIOD_NS).max(published_ns + PERIOD_NS / 2);
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_1_SQRT_2;

    use super::*;

    fn handle(x: f64, y: f64) -> HandleState {
        HandleState { position_m: [x, y, 0.0], velocity_mps: [0.0; 3] }
    }

    #[test]
    fn heading_points_from_the_rear_handle_to_the_front_handle() {
        let pose = Pose::of(&BenchState::between(&handle(1.0, 3.0), &handle(1.0, 1.0)));
        assert_eq!(pose.position, [1.0, 2.0, 0.0]);
        let [x, y, z, w] = pose.orientation;
        assert_eq!([x, y], [0.0, 0.0]);
        assert!((z - FRAC_1_SQRT_2).abs() < f64::EPSILON && (w - FRAC_1_SQRT_2).abs() < f64::EPSILON);
    }

    #[test]
    fn every_bench_has_one_pose() {
        assert_eq!(bench_poses(&[handle(0.0, 0.0); 224]).len(), 223);
        assert_eq!(bench_poses(&[]).len(), 0);
    }

    fn chosen_in(seconds: u64, rate_hz: u64, rate: &mut PoseRate) -> u64 {
        let published = |tick: u64| 1_000_000_000_000 + tick * 1_000_000_000 / rate_hz;
        (0..seconds * rate_hz).map(|tick| u64::from(rate.is_due(published(tick)))).sum()
    }

    #[test]
    fn thirty_frames_a_second_are_chosen_at_any_higher_rate() {
        for rate_hz in [31, 50, 59, 60, 100, 1_000, 10_000] {
            let chosen = chosen_in(10, rate_hz, &mut PoseRate::default());
            assert!((299..=301).contains(&chosen), "{chosen} poses in 10 s at {rate_hz} Hz");
        }
    }

    #[test]
    fn every_frame_is_chosen_at_thirty_hertz_and_below() {
        for rate_hz in [1, 20, 29, 30] {
            assert_eq!(chosen_in(10, rate_hz, &mut PoseRate::default()), 10 * rate_hz, "at {rate_hz} Hz");
        }
    }

    #[test]
    fn a_pause_is_not_made_up_for() {
        let mut rate = PoseRate::default();
        rate.is_due(0);
        let chosen = chosen_in(1, 1_000, &mut rate);
        assert!((30..=31).contains(&chosen), "{chosen} poses in the second after a pause");
    }
}
