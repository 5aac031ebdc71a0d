//! The body's handles behind one place of the route.
//!
//! All body links are alike, so each handle from the second on stands where the same function f of the place of the one
//! before puts it. Behind a place x the body stands on the orbit x, f(x), f(f(x))…, whichever handle stands at x: a
//! dragon that walks on by one bench stands on the same orbit, one station further on.

use super::Dragon;
use super::link::{Link, MAX_STEPS, RearEnd};
use crate::numerics::{Slope, rising_root};

/// How exactly handle 1 is brought to a place, in metres: a chain's own rounding is some 10⁻¹³ m.
const ROUNDING_M: f64 = 1e-12;

/// A place of an orbit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Station {
    /// Place on the route.
    pub(crate) place: f64,
    /// Speed of the handle here ÷ speed of the handle at the first station.
    pub(crate) speed_ratio: f64,
}

/// The head before handle 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Head {
    /// Place on the route.
    pub(crate) place: f64,
    /// Speed of handle 1 ÷ speed of the head.
    pub(crate) speed_ratio: f64,
}

impl Dragon {
    /// The stations behind `place`, which comes first. It ends at a link that nowhere behind meets the route.
    pub(crate) fn orbit(&self, place: f64) -> impl Iterator<Item = Station> {
        // A lone head has no body link; its own serves to cut the route into stations.
        let bench = 1.min(self.dimensions.benches() - 1);
        std::iter::successors(Some(Station { place, speed_ratio: 1.0 }), move |front| {
            let rear = self.rear(bench, front.place)?;
            Some(Station { place: rear.place, speed_ratio: front.speed_ratio * rear.speed_ratio() })
        })
    }

    /// Place of handle 1 with the head at `head_place`.
    pub(crate) fn first_handle(&self, head_place: f64) -> Option<f64> {
        self.rear(0, head_place).map(|rear| rear.place)
    }

    /// The head with handle 1 at `place`, which must lie on the way that handle 1 walks during the run.
    ///
    /// Newton's method on the place of handle 1, which grows with that of the head all through the run. In metres it is
    /// known to some 10⁻¹².
    pub(crate) fn head_before(&self, place: f64) -> Head {
        let end = self.route.place(self.end_travel_m()).max(place);
        let guess = self.route.place(self.route.travel(place) + self.dimensions.link_m(0));
        let mut speed_ratio = 1.0;
        let head_place = rising_root(place..=end, guess, ROUNDING_M, |head_place| {
            let rear = self.rear(0, head_place).expect("handle 1 stands all through the run");
            speed_ratio = rear.speed_ratio();
            Slope {
                value: (rear.place - place) * rear.point.pace_m,
                growth: speed_ratio * self.route.point(head_place).pace_m,
            }
        });
        Head { place: head_place, speed_ratio }
    }

    fn rear(&self, bench: usize, front_place: f64) -> Option<RearEnd> {
        let route = self.route();
        let link = Link { route, front: route.point(front_place), length_m: self.dimensions.link_m(bench) };
        let rear = link.rear(front_place);
        self.meter.add(u64::from(rear.map_or(MAX_STEPS, |rear| rear.looks)));
        rear
    }
}
