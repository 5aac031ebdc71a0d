//! The body's handles behind one parameter of the route.
//!
//! All body links are alike, so each handle from the second on stands where the same function f of the parameter of the
//! one before puts it. Behind a parameter x the body stands on the orbit x, f(x), f(f(x))…, whichever handle stands at x: a
//! dragon that walks on by one bench stands on the same orbit, one station further on.

use super::Dragon;
use super::link::{Link, RearEnd};
use crate::numerics::{Slope, rising_root};

/// How exactly handle 1 is brought to a parameter, in metres: a chain's own rounding is some 10⁻¹³ m.
const ROUNDING_M: f64 = 1e-12;

/// A parameter of an orbit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Station {
    /// Parameter on the route.
    pub(crate) parameter: f64,
    /// Speed of the handle here ÷ speed of the handle at the first station.
    pub(crate) speed_ratio: f64,
}

impl Dragon {
    /// The stations behind `parameter`, which comes first. It ends at a link that nowhere behind meets the route.
    pub(crate) fn orbit(&self, parameter: f64) -> impl Iterator<Item = Station> {
        // A lone head has no body link; its own serves to cut the route into stations.
        let bench = 1.min(self.dimensions.benches() - 1);
        std::iter::successors(Some(Station { parameter, speed_ratio: 1.0 }), move |front| {
            let rear = self.rear(bench, front.parameter)?;
            Some(Station { parameter: rear.parameter, speed_ratio: front.speed_ratio * rear.speed_ratio() })
        })
    }

    /// The head's parameter with handle 1 at `parameter`, which must lie on the way that handle 1 walks during the run; and the
    /// speed of handle 1 ÷ that of the head.
    ///
    /// Newton's method on the parameter of handle 1, which grows with that of the head all through the run. In metres it is
    /// known to some 10⁻¹².
    pub(crate) fn head_before(&self, parameter: f64) -> (f64, f64) {
        let end = self.end_parameter.max(parameter);
        let ahead_m = self.dimensions.link_m(0);
        let near = parameter + ahead_m / self.route.point(parameter).speed_m_per_unit;
        let guess = self.route.parameter_near(self.route.travel(parameter) + ahead_m, near);
        let mut speed_ratio = 1.0;
        let head_parameter = rising_root(parameter..=end, guess, ROUNDING_M, |head_parameter| {
            let rear = self.rear(0, head_parameter).expect("handle 1 stands all through the run");
            speed_ratio = rear.speed_ratio();
            Slope {
                value: (rear.parameter - parameter) * rear.point.speed_m_per_unit,
                growth: speed_ratio * self.route.point(head_parameter).speed_m_per_unit,
            }
        });
        (head_parameter, speed_ratio)
    }

    /// The rear handle of a bench whose front handle stands at `front_parameter`.
    pub(crate) fn rear(&self, bench: usize, front_parameter: f64) -> Option<RearEnd> {
        let route = self.route();
        let (front, length_m) = (route.point(front_parameter), self.dimensions.link_m(bench));
        Link { route, front, length_m, meter: &self.meter }.rear(front_parameter)
    }
}
