//! The benches as parry2d shapes.

use bench_dragon_geometry::dragon::Dragon;
use glam::DVec2;
use parry2d_f64::math::{Pose2, Rot2};
use parry2d_f64::shape::Cuboid;

use crate::shared::HandleState;

/// A cuboid and a pose for each bench.
pub(crate) struct BenchShapes {
    pub(crate) cuboids: Vec<Cuboid>,
    pub(crate) poses: Vec<Pose2>,
}

impl BenchShapes {
    pub(crate) fn new(dragon: &Dragon) -> Self {
        let dimensions = dragon.dimensions();
        let cuboid = |bench| Cuboid::new(0.5 * DVec2::new(dimensions.length_m(bench), dimensions.width_m()));
        Self { cuboids: (0..dimensions.benches()).map(cuboid).collect(), poses: Vec::new() }
    }

    /// Places the cuboids between the handles of a frame.
    pub(crate) fn place(&mut self, handles: &[HandleState]) {
        self.poses.clear();
        self.poses.extend(handles.windows(2).map(|ends| {
            let [front, rear] = [&ends[0], &ends[1]].map(|end| DVec2::new(end.position_m[0], end.position_m[1]));
            let heading = (front - rear).normalize();
            Pose2::from_parts(0.5 * (front + rear), Rot2::from_cos_sin_unchecked(heading.x, heading.y))
        }));
    }
}
