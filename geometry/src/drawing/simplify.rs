//! Polylines with fewer points.
//!
//! Source: H. Imai and M. Iri, *Polygonal approximations of a curve* (1988): the cone from a point that meets the disc around
//! each point behind it. Here the longest step is taken each time.

use std::f64::consts::PI;

use glam::DVec2;

/// Numbers of the points to keep, in order, with the first and the last.
///
/// Every point that is left out is within `tolerance_m` of the line between the kept points around it. The work is
/// proportional to the number of points, unless many of them lie within `tolerance_m` of each other.
pub(super) fn kept_points(points: &[DVec2], tolerance_m: f64) -> Vec<usize> {
    let mut kept = vec![0];
    let mut at = 0;
    while at + 1 < points.len() {
        at += longest_step(&points[at..], tolerance_m);
        kept.push(at);
    }
    kept
}

/// Number of points to step from the first one, at least 1.
fn longest_step(points: &[DVec2], tolerance_m: f64) -> usize {
    let mut longest = 1;
    let mut cone: Option<Cone> = None;
    let mut farthest_m = 0.0;
    for (step, &point) in points.iter().enumerate().skip(1) {
        let lead = point - points[0];
        let lead_m = lead.length();
        if lead_m < farthest_m - tolerance_m {
            break;
        }
        if lead_m > tolerance_m {
            let disc = Cone::around(lead, tolerance_m / lead_m);
            let within = cone.is_none_or(|cone| cone.contains(lead));
            if within && lead_m >= farthest_m {
                longest = step;
            }
            let Some(narrowed) = cone.map_or(Some(disc), |cone| cone.meet(&disc)) else { break };
            cone = Some(narrowed);
        } else if cone.is_none() && lead_m >= farthest_m {
            longest = step;
        }
        farthest_m = f64::max(farthest_m, lead_m);
    }
    longest
}

/// The directions within an angle of another direction.
#[derive(Clone, Copy)]
struct Cone {
    /// A direction in it.
    axis: DVec2,
    /// Angles of its two sides from the axis: at most 0, and at least 0.
    sides: [f64; 2],
}

impl Cone {
    fn around(axis: DVec2, sine: f64) -> Self {
        let half = sine.asin();
        Self { axis, sides: [-half, half] }
    }

    fn contains(&self, direction: DVec2) -> bool {
        let angle = self.axis.angle_to(direction);
        self.sides[0] <= angle && angle <= self.sides[1]
    }

    /// The directions in both; `None` if there is none.
    fn meet(&self, other: &Self) -> Option<Self> {
        let shift = self.axis.angle_to(other.axis);
        if shift.abs() > 0.5 * PI {
            return None;
        }
        let sides = [self.sides[0].max(shift + other.sides[0]), self.sides[1].min(shift + other.sides[1])];
        (sides[0] <= sides[1]).then_some(Self { axis: self.axis, sides })
    }
}
