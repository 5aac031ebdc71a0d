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
        let rear = Place::of_rear(dragon, &loose.taut().rear(bench, self.rear)?);
        let front = Place::of_rear(dragon, &loose.compact().rear(bench, self.front)?);
        Some(Self::between(rear, front))
    }

    /// The two halves, the rear one first, each with the interval of the next pole [`behind`](Self::behind) it. `next` is that of the
    /// whole interval.
    pub(super) fn halves_with_next(&self, next: &Self, dragon: &Dragon, bench: usize) -> Option<[[Self; 2]; 2]> {
        let loose = dragon.loose()?;
        let middle = Place::at(dragon, 0.5 * (self.rear + self.front));
        let next_of = |chain: &Dragon| Some(Place::of_rear(dragon, &chain.rear(bench, middle.parameter)?));
        let (rearmost, foremost) = (next_of(loose.taut())?, next_of(loose.compact())?);
        let ([rear, front], [next_rear, next_front]) = (self.places(), next.places());
        Some([
            [Self::between(rear, middle), Self::between(next_rear, foremost)],
            [Self::between(middle, front), Self::between(rearmost, next_front)],
        ])
    }

    /// Centre in the plan of a circle of the radius `0.5 * length_m` that contains the interval: the sum of a point's distances from
    /// both ends is at most the arc.
    pub(super) fn middle(&self) -> DVec2 {
        0.5 * (self.ends[0].truncate() + self.ends[1].truncate())
    }
}
