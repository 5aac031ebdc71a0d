//! Drawn curves: lines, circular arcs and rational Bézier curves, in metres.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DAffine2, DVec2};

/// Distance of a Bézier curve from the chords whose lengths are added up, relative to its extent.
const LENGTH_FLATNESS: f64 = 1e-6;
/// Deepest bisection of a Bézier curve: its parts are then 10⁻⁹ of its parameter long.
const MAX_DEPTH: u32 = 30;
/// Largest difference of the two stretches of a map, relative to the larger, at which circles are taken to stay circles.
const SIMILARITY: f64 = 1e-6;

/// A part of a drawing, walked from its beginning to its end.
#[derive(Clone, Debug, PartialEq)]
pub enum Piece {
    /// A straight line.
    Line {
        /// Where it begins.
        from: DVec2,
        /// Where it ends.
        to: DVec2,
    },
    /// A circular arc.
    Arc {
        /// Its centre.
        centre: DVec2,
        /// Its radius.
        radius_m: f64,
        /// Angle of the spoke at its beginning.
        from_angle: f64,
        /// Angle by which it turns; above 0 to the left, below 0 to the right.
        turn: f64,
    },
    /// A Bézier curve of any degree.
    Bezier(Bezier),
}

/// A rational Bézier curve. Weights are above 0, so the curve lies in the convex hull of its control points.
#[derive(Clone, Debug, PartialEq)]
pub struct Bezier {
    points: Vec<DVec2>,
    weights: Vec<f64>,
}

/// A point of a curve and the direction there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CurvePoint {
    pub(super) position: DVec2,
    pub(super) tangent: DVec2,
}

impl Bezier {
    /// The curve of these control points, all of weight 1.
    ///
    /// # Panics
    /// Panics with fewer than two points.
    pub fn new(points: Vec<DVec2>) -> Self {
        let weights = vec![1.0; points.len()];
        Self::rational(points, weights)
    }

    /// The curve of these control points and weights.
    ///
    /// # Panics
    /// Panics with fewer than two points, or if a weight is not above 0.
    pub fn rational(points: Vec<DVec2>, weights: Vec<f64>) -> Self {
        assert!(points.len() >= 2 && points.len() == weights.len() && weights.iter().all(|&weight| weight > 0.0));
        Self { points, weights }
    }

    fn begin(&self) -> DVec2 {
        self.points[0]
    }

    fn end(&self) -> DVec2 {
        self.points[self.points.len() - 1]
    }

    /// Direction towards the first control point that is apart from the beginning.
    fn begin_tangent(&self) -> Option<DVec2> {
        let far_m = self.extent_m() * 1e-9;
        let mut leads = self.points.iter().map(|&point| point - self.begin());
        leads.find(|lead| lead.length() > far_m).and_then(DVec2::try_normalize)
    }

    fn extent_m(&self) -> f64 {
        self.points.iter().map(|point| point.distance(self.begin())).fold(0.0, f64::max)
    }

    fn reversed(&self) -> Self {
        let (points, weights) = (self.points.iter().rev().copied(), self.weights.iter().rev().copied());
        Self { points: points.collect(), weights: weights.collect() }
    }

    fn mapped(&self, map: &DAffine2) -> Self {
        let points = self.points.iter().map(|&point| map.transform_point2(point)).collect();
        Self { points, weights: self.weights.clone() }
    }

    /// The two halves, by de Casteljau's algorithm.
    fn halves(&self) -> [Self; 2] {
        let (mut points, mut weights) = (self.points.clone(), self.weights.clone());
        let (mut left, mut right) = ((vec![], vec![]), (vec![], vec![]));
        while let (Some(&last), Some(&last_weight)) = (points.last(), weights.last()) {
            left.0.push(points[0]);
            left.1.push(weights[0]);
            right.0.push(last);
            right.1.push(last_weight);
            let count = points.len() - 1;
            for i in 0..count {
                let weight = weights[i] + weights[i + 1];
                points[i] = (points[i] * weights[i] + points[i + 1] * weights[i + 1]) / weight;
                weights[i] = 0.5 * weight;
            }
            points.truncate(count);
            weights.truncate(count);
        }
        right.0.reverse();
        right.1.reverse();
        [left, right].map(|(points, weights)| Self { points, weights })
    }

    /// Largest distance of a control point from the chord. The curve and its chord are no further apart than this.
    fn flatness_m(&self) -> f64 {
        let (begin, end) = (self.begin(), self.end());
        self.points.iter().map(|&point| to_segment_m(point, begin, end)).fold(0.0, f64::max)
    }

    /// Parts of the curve, by bisection, that are no further than `flatness_m` from their chords.
    pub(super) fn parts(&self, flatness_m: f64) -> Vec<Self> {
        let mut parts = vec![];
        self.divide(flatness_m, 0, &mut |part| parts.push(part.clone()));
        parts
    }

    /// Adds points of the curve behind its beginning, whose chords are no further than `flatness_m` from it.
    pub(super) fn flatten(&self, flatness_m: f64, points: &mut Vec<CurvePoint>) {
        self.divide(flatness_m, 0, &mut |part| {
            let tangent = part.reversed().begin_tangent();
            points.extend(tangent.map(|tangent| CurvePoint { position: part.end(), tangent: -tangent }));
        });
    }

    fn divide(&self, flatness_m: f64, depth: u32, take: &mut impl FnMut(&Self)) {
        if depth < MAX_DEPTH && self.flatness_m() > flatness_m {
            self.halves().iter().for_each(|half| half.divide(flatness_m, depth + 1, take));
        } else {
            take(self);
        }
    }
}

impl Piece {
    /// Its length, in metres.
    pub(super) fn length_m(&self) -> f64 {
        match self {
            Self::Line { from, to } => from.distance(*to),
            Self::Arc { radius_m, turn, .. } => radius_m * turn.abs(),
            Self::Bezier(_) => {
                let mut points = vec![];
                self.flatten(LENGTH_FLATNESS * self.extent_m(), &mut points);
                let mut at = self.begin();
                points.iter().map(|point| std::mem::replace(&mut at, point.position).distance(point.position)).sum()
            }
        }
    }

    /// Where it begins.
    pub fn begin(&self) -> DVec2 {
        match self {
            Self::Line { from, .. } => *from,
            Self::Arc { centre, radius_m, from_angle, .. } => *centre + *radius_m * DVec2::from_angle(*from_angle),
            Self::Bezier(bezier) => bezier.begin(),
        }
    }

    /// Where it ends.
    pub fn end(&self) -> DVec2 {
        match self {
            Self::Line { to, .. } => *to,
            Self::Arc { centre, radius_m, from_angle, turn } => {
                *centre + *radius_m * DVec2::from_angle(*from_angle + *turn)
            }
            Self::Bezier(bezier) => bezier.end(),
        }
    }

    /// Unit vector in walking direction at the beginning; `None` without a length.
    pub(super) fn begin_tangent(&self) -> Option<DVec2> {
        match self {
            Self::Line { from, to } => (*to - *from).try_normalize(),
            Self::Arc { from_angle, turn, .. } => Some(DVec2::from_angle(from_angle + FRAC_PI_2.copysign(*turn))),
            Self::Bezier(bezier) => bezier.begin_tangent(),
        }
    }

    /// Unit vector in walking direction at the end; `None` without a length.
    pub(super) fn end_tangent(&self) -> Option<DVec2> {
        self.reversed().begin_tangent().map(|tangent| -tangent)
    }

    /// The same piece, walked from its end.
    #[must_use]
    pub fn reversed(&self) -> Self {
        match self {
            Self::Line { from, to } => Self::Line { from: *to, to: *from },
            Self::Arc { centre, radius_m, from_angle, turn } => {
                Self::Arc { centre: *centre, radius_m: *radius_m, from_angle: from_angle + turn, turn: -turn }
            }
            Self::Bezier(bezier) => Self::Bezier(bezier.reversed()),
        }
    }

    /// Whether all its numbers are finite.
    pub(super) fn is_finite(&self) -> bool {
        match self {
            Self::Line { from, to } => from.is_finite() && to.is_finite(),
            Self::Arc { centre, radius_m, from_angle, turn } => {
                centre.is_finite() && [radius_m, from_angle, turn].iter().all(|number| number.is_finite())
            }
            Self::Bezier(bezier) => {
                bezier.points.iter().all(|point| point.is_finite()) && bezier.weights.iter().all(|w| w.is_finite())
            }
        }
    }

    /// Largest distance between two of its points, within a factor of two.
    pub(super) fn extent_m(&self) -> f64 {
        match self {
            Self::Line { from, to } => from.distance(*to),
            Self::Arc { radius_m, turn, .. } => radius_m * turn.abs().min(PI),
            Self::Bezier(bezier) => bezier.extent_m(),
        }
    }

    /// The piece after an affine map. Arcs stay arcs where circles stay circles; elsewhere they become rational Bézier
    /// curves, which are the same ellipse.
    pub fn mapped(&self, map: &DAffine2) -> Vec<Self> {
        match self {
            Self::Line { from, to } => {
                vec![Self::Line { from: map.transform_point2(*from), to: map.transform_point2(*to) }]
            }
            Self::Bezier(bezier) => vec![Self::Bezier(bezier.mapped(map))],
            Self::Arc { centre, radius_m, from_angle, turn } => {
                let [x, y] = [map.matrix2.x_axis, map.matrix2.y_axis];
                let scale = x.length().max(y.length());
                let mirror = x.perp_dot(y).signum();
                if (x.perp() * mirror).distance(y) > SIMILARITY * scale {
                    return conics(*centre, *radius_m, *from_angle, *turn)
                        .map(|conic| Self::Bezier(conic.mapped(map)))
                        .collect();
                }
                let spoke = map.transform_vector2(DVec2::from_angle(*from_angle));
                vec![Self::Arc {
                    centre: map.transform_point2(*centre),
                    radius_m: radius_m * scale,
                    from_angle: spoke.to_angle(),
                    turn: turn * mirror,
                }]
            }
        }
    }

    /// Adds points of the piece behind its beginning, whose chords are no further than `flatness_m` from it.
    pub(super) fn flatten(&self, flatness_m: f64, points: &mut Vec<CurvePoint>) {
        match self {
            Self::Line { to, .. } => {
                let tangent = self.begin_tangent();
                points.extend(tangent.map(|tangent| CurvePoint { position: *to, tangent }));
            }
            Self::Arc { centre, radius_m, from_angle, turn } => {
                // The sagitta of a chord over the angle a is r·(1 − cos a/2), at most r·a²/8.
                let step = (8.0 * flatness_m / radius_m).sqrt().min(FRAC_PI_2);
                let count = (turn.abs() / step).ceil().clamp(1.0, 1e6) as usize;
                points.extend((1..=count).map(|i| {
                    let spoke = DVec2::from_angle(from_angle + turn * i as f64 / count as f64);
                    CurvePoint { position: *centre + *radius_m * spoke, tangent: spoke.perp() * turn.signum() }
                }));
            }
            Self::Bezier(bezier) => bezier.flatten(flatness_m, points),
        }
    }
}

/// The arc as rational Bézier curves of at most a quarter of a turn each.
fn conics(centre: DVec2, radius_m: f64, from_angle: f64, turn: f64) -> impl Iterator<Item = Bezier> {
    let count = (turn.abs() / FRAC_PI_2).ceil().clamp(1.0, 4000.0);
    let half = 0.5 * turn / count;
    (0..count as usize).map(move |i| {
        let middle = from_angle + half * (2 * i + 1) as f64;
        let [from, corner, to] = [(-half, 1.0), (0.0, half.cos()), (half, 1.0)]
            .map(|(angle, cosine)| centre + radius_m / cosine * DVec2::from_angle(middle + angle));
        Bezier::rational(vec![from, corner, to], vec![1.0, half.cos(), 1.0])
    })
}

/// Distance of a point from a line segment, in metres.
pub(super) fn to_segment_m(point: DVec2, from: DVec2, to: DVec2) -> f64 {
    let edge = to - from;
    let square = edge.length_squared();
    let at = if square > 0.0 { ((point - from).dot(edge) / square).clamp(0.0, 1.0) } else { 0.0 };
    point.distance(from + at * edge)
}
