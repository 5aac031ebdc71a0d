//! Baseline: every pair through parry2d.

use bench_dragon_geometry::dragon::Dragon;
use parry2d_f64::query;

use super::bench_shapes::BenchShapes;
use super::contestant::{Contestant, Found, Near};
use crate::shared::HandleState;

pub(crate) struct AllPairs {
    reach_m: f64,
    shapes: BenchShapes,
    within: Vec<Near>,
}

impl AllPairs {
    pub(crate) fn new(dragon: &Dragon, reach_m: f64) -> Self {
        Self { reach_m, shapes: BenchShapes::new(dragon), within: Vec::new() }
    }
}

impl Contestant for AllPairs {
    fn measure(&mut self, handles: &[HandleState]) -> Found<'_> {
        self.shapes.place(handles);
        self.within.clear();
        let BenchShapes { cuboids, poses } = &self.shapes;
        let mut nearest = Near { benches: [0, 0], clearance_m: f64::INFINITY };
        for first in 0..poses.len() {
            for second in first + 2..poses.len() {
                let clearance_m = query::distance(&poses[first], &cuboids[first], &poses[second], &cuboids[second])
                    .expect("parry supports cuboids")
                    .distance;
                let near = Near { benches: [first, second], clearance_m };
                if clearance_m < nearest.clearance_m {
                    nearest = near;
                }
                if clearance_m <= self.reach_m {
                    self.within.push(near);
                }
            }
        }
        Found { nearest, within: &self.within }
    }
}
