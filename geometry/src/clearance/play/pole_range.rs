//! Intervals of the route that contain a pole, and the chains of such intervals.

use glam::{DVec2, DVec3};

use crate::dragon::Dragon;

/// An interval of the route that contains a pole.
#[derive(Clone, Copy, Debug)]
pub(super) struct PoleRange {
    /// Parameter of the rearmost place.
    pub(super) rear: f64,
    /// Parameter of the foremost place.
    pub(super) front: f64,
    /// Positions of the rearmost and the foremost place in space.
    pub(super) ends: [DVec3; 2],
    /// Arc from the rearmost place to the foremost one, in metres.
    pub(super) length_m: f64,
}

impl PoleRange {
    pub(super) fn new(dragon: &Dragon, rear: f64, front: f64) -> Self {
        let route = dragon.route();
        Self {
            rear,
            front,
            ends: [rear, front].map(|parameter| route.point(parameter).in_space()),
            length_m: (route.travel(front) - route.travel(rear)).max(0.0),
        }
    }

    /// The two halves, the rear one first.
    pub(super) fn halves(&self, dragon: &Dragon) -> [Self; 2] {
        let middle = 0.5 * (self.rear + self.front);
        [Self::new(dragon, self.rear, middle), Self::new(dragon, middle, self.front)]
    }

    /// The interval of the next pole behind, over the link of a bench.
    ///
    /// The chain rule finds the nearest point behind at a distance. It lies further behind for a longer link, and further ahead
    /// for a front pole further ahead, where the link walks. So the interval is from the rear end of the longest link at the
    /// rearmost place to that of the shortest link at the foremost one. [`Dragon`] has checked that both walk there.
    pub(super) fn behind(&self, dragon: &Dragon, bench: usize) -> Option<Self> {
        let loose = dragon.loose()?;
        let rear = loose.taut().rear(bench, self.rear)?.parameter;
        let front = loose.compact().rear(bench, self.front)?.parameter;
        Some(Self::new(dragon, rear, front.max(rear)))
    }

    /// Centre in the plan of a circle of the radius `0.5 * length_m` that contains the interval: the sum of a point's distances from
    /// both ends is at most the arc.
    pub(super) fn middle(&self) -> DVec2 {
        0.5 * (self.ends[0].truncate() + self.ends[1].truncate())
    }
}
