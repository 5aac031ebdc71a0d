//! Orbits: the positions of the body's handles behind one parameter of the route.
//!
//! All body links are alike. So from handle 2 on, each handle's parameter is the same function f of the parameter of the handle
//! before it. Behind a parameter x, the body stands on the orbit x, f(x), f(f(x))…, whichever handle is at x. A dragon that
//! walks forward by one bench stands on the same orbit, one station further.

use super::Dragon;
use super::link::{Link, RearEnd};
use crate::numerics::{Slope, rising_root};
use crate::route::RoutePoint;

/// Accuracy of the search for the head's parameter, in metres at handle 1. The rounding of a chain is about 10⁻¹³ m.
const ROUNDING_M: f64 = 1e-12;

/// One parameter of an orbit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Station {
    /// Parameter on the route.
    pub(crate) parameter: f64,
    /// Speed of the handle here divided by the speed of the handle at the first station.
    pub(crate) speed_ratio: f64,
}

impl Dragon {
    /// Iterator over the stations of an orbit. `parameter` is the first. The orbit ends before the first link that finds no
    /// rear handle on the route.
    pub(crate) fn orbit(&self, parameter: f64) -> impl Iterator<Item = Station> {
        // A lone head has no body link. Its own link divides the route into stations.
        let bench = 1.min(self.dimensions.benches() - 1);
        let first = (Station { parameter, speed_ratio: 1.0 }, self.route.point(parameter));
        let stations = std::iter::successors(Some(first), move |&(front, point)| {
            let rear = self.rear_behind(bench, front.parameter, point)?;
            let speed_ratio = front.speed_ratio * rear.speed_ratio();
            Some((Station { parameter: rear.parameter, speed_ratio }, rear.point))
        });
        stations.map(|(station, _)| station)
    }

    /// Finds the head's parameter for which handle 1 is at `parameter`. Returns it with the speed of handle 1 divided by the
    /// speed of the head. `parameter` must be one that handle 1 passes on feasible travel.
    ///
    /// Newton's method on the parameter of handle 1, which grows with the head's parameter on all feasible travel. The result is
    /// exact to about 10⁻¹² m.
    pub(crate) fn head_before(&self, parameter: f64) -> (f64, f64) {
        self.front_before(0, parameter, [self.route.parameter(self.start_travel_m()), self.end_parameter])
    }

    /// The same for the front handle of any bench, whose rear handle is at `parameter`. `begin` and `end` are parameters that the
    /// front handle passes on feasible travel, before and after the result. On other parts of the route, the rear handle of a tight
    /// link may pass `parameter` too.
    pub(crate) fn front_before(&self, bench: usize, parameter: f64, ends: [f64; 2]) -> (f64, f64) {
        self.front_near(bench, parameter, ends, self.dimensions.link_m(bench))
    }

    /// The same, sooner found where the front handle is about `ahead_m` of arc ahead of the rear one.
    pub(crate) fn front_near(&self, bench: usize, parameter: f64, [begin, end]: [f64; 2], ahead_m: f64) -> (f64, f64) {
        let begin = begin.max(parameter);
        let near = parameter + ahead_m / self.route.point(parameter).speed_m_per_unit;
        let guess = self.route.parameter_near(self.route.travel(parameter) + ahead_m, near);
        let mut speed_ratio = 1.0;
        let front_parameter = rising_root(begin..=end.max(begin), guess, ROUNDING_M, |front_parameter| {
            let rear = self.rear(bench, front_parameter).expect("every handle has a position on all feasible travel");
            speed_ratio = rear.speed_ratio();
            Slope {
                value: (rear.parameter - parameter) * rear.point.speed_m_per_unit,
                growth: speed_ratio * self.route.point(front_parameter).speed_m_per_unit,
            }
        });
        (front_parameter, speed_ratio)
    }

    /// The rear handle of a bench whose front handle is at `front_parameter`.
    pub(crate) fn rear(&self, bench: usize, front_parameter: f64) -> Option<RearEnd> {
        self.rear_behind(bench, front_parameter, self.route.point(front_parameter))
    }

    /// The same, whose front handle is at this point of the route.
    fn rear_behind(&self, bench: usize, front_parameter: f64, front: RoutePoint) -> Option<RearEnd> {
        let length_m = self.dimensions.link_m(bench);
        Link { route: self.route(), front, length_m, meter: &self.meter }.rear(front_parameter)
    }
}
