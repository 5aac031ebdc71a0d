//! Intervals of the route that contain a pole, and the chains of such intervals.

use glam::{DVec2, DVec3};

use crate::dragon::Dragon;
use crate::dragon::link::RearEnd;

/// A place on the route.
#[derive(Clone, Copy, Debug)]
struct Place {
    parameter: f64,
    position: DVec3,
    travel_m: f64,
}

impl Place {
    fn at(dragon: &Dragon, parameter: f64) -> Self {
        let route = dragon.route();
        Self { parameter, position: route.point(parameter).in_space(), travel_m: route.travel(parameter) }
    }

    fn of_rear(dragon: &Dragon, rear: &RearEnd) -> Self {
        let travel_m = dragon.route().travel(rear.parameter);
        Self { parameter: rear.parameter, position: rear.point.in_space(), travel_m }
    }
}

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
    travels_m: [f64; 2],
}

impl PoleRange {
    pub(super) fn new(dragon: &Dragon, rear: f64, front: f64) -> Self {
        Self::between(Place::at(dragon, rear), Place::at(dragon, front))
    }

    /// The interval from a place to another one; the first place alone if that is behind it.
    fn between(rear: Place, front: Place) -> Self {
        let front = if front.parameter < rear.parameter { rear } else { front };
        Self {
            rear: rear.parameter,
            front: front.parameter,
            ends: [rear.position, front.position],
            length_m: (front.travel_m - rear.travel_m).max(0.0),
            travels_m: [rear.travel_m, front.travel_m],
        }
    }

    fn places(&self) -> [Place; 2] {
        let place =
            |parameter, end: usize| Place { parameter, position: self.ends[end], travel_m: self.travels_m[end] };
        [place(self.rear, 0), place(self.front, 1)]
    }

    /// The interval of the next pole behind, over the link of a bench.
    ///
    /// The chain rule finds the nearest point behind at a distance. It lies further behind for a longer link, and further ahead
    /// for a front pole further ahead, where the link walks. So the interval is from the rear end of the longest link at the
    /// rearmost place to that of the shortest link at the foremost one. [`Dragon`] has checked that both walk there.
    pub(super) fn behind(&self, dragon: &Dragon, bench: usize) -> Option<Self> {
        let loose = dragon.loose()?;
        let rear = Place::of_rear(dragon, &loose.taut().rear(bench, self.rear)?);
        let front = Place::of_rear(dragon, &loose.compact().rear(bench, self.front)?);
        Some(Self::between(rear, front))
    }

    /// The intervals of a pole and of those [`behind`](Self::behind) it, if the first pole is in the rear half of its interval, and if it
    /// is in the front half. `poles` are those of the whole interval; its ends and its middle determine them. `bench` is the first bench.
    pub(super) fn halves(poles: &[Self], dragon: &Dragon, bench: usize) -> Option<[Vec<Self>; 2]> {
        let chains = [dragon.loose()?.taut(), dragon.loose()?.compact()];
        let mut middles = [Place::at(dragon, 0.5 * (poles[0].rear + poles[0].front)); 2];
        let mut halves = [Vec::with_capacity(poles.len()), Vec::with_capacity(poles.len())];
        for (number, pole) in poles.iter().enumerate() {
            if number > 0 {
                let next = |end: usize| chains[end].rear(bench + number - 1, middles[end].parameter);
                let (Some(rearmost), Some(foremost)) = (next(0), next(1)) else { break };
                middles = [rearmost, foremost].map(|rear| Place::of_rear(dragon, &rear));
            }
            let ([rear, front], [rearmost, foremost]) = (pole.places(), middles);
            halves[0].push(Self::between(rear, foremost));
            halves[1].push(Self::between(rearmost, front));
        }
        Some(halves)
    }

    /// Centre in the plan of a circle of the radius `0.5 * length_m` that contains the interval: the sum of a point's distances from
    /// both ends is at most the arc.
    pub(super) fn middle(&self) -> DVec2 {
        0.5 * (self.ends[0].truncate() + self.ends[1].truncate())
    }
}
