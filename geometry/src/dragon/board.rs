//! Boards of benches, and the distance between two boards.

use glam::{DVec2, DVec3};
use parry2d_f64::math::{Pose2, Rot2};
use parry2d_f64::query::sat::cuboid_cuboid_find_local_separating_normal_oneway;
use parry2d_f64::shape::Cuboid;

/// The board of a bench: a rectangle, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    /// Centre of the rectangle.
    pub centre: DVec2,
    /// Unit vector from the rear to the front hinge.
    pub heading: DVec2,
    /// Half of the length along the heading.
    pub half_length: f64,
    /// Half of the width across the heading.
    pub half_width: f64,
}

/// Clearance of two boards, with its point and its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Distance of the boards if they are apart, minus the penetration depth if they overlap.
    pub clearance_m: f64,
    /// Midpoint between the nearest points; a point inside the overlap if the boards overlap.
    pub point: DVec2,
    /// Unit vector from the first board to the second, along which the clearance is measured.
    pub direction: DVec2,
}

impl Board {
    /// The board of a bench whose hinges are at `front` and `rear`, which must not coincide.
    ///
    /// ```
    /// use bench_dragon_geometry::dragon::Board;
    /// use glam::{DVec2, DVec3};
    ///
    /// let board = Board::from_handles(DVec2::new(1.0, 0.0), DVec2::new(-1.0, 0.0), 2.4, 0.3);
    /// assert!((board.corners()[0] - DVec2::new(1.2, 0.15)).length() < 1e-15);
    /// ```
    pub fn from_handles(front: DVec2, rear: DVec2, length_m: f64, width_m: f64) -> Self {
        Self {
            centre: 0.5 * (front + rear),
            heading: (front - rear).normalize(),
            half_length: 0.5 * length_m,
            half_width: 0.5 * width_m,
        }
    }

    /// The same board, seen from above, if its hinges are at different heights. It is pitched along its link, and level across.
    #[must_use]
    pub(crate) fn pitched(self, front: DVec3, rear: DVec3) -> Self {
        let link = front - rear;
        Self { half_length: self.half_length * (link.truncate().length() / link.length()), ..self }
    }

    /// The corners, counter-clockwise: front left, rear left, rear right, front right.
    pub fn corners(&self) -> [DVec2; 4] {
        let along = self.half_length * self.heading;
        let left = self.half_width * self.heading.perp();
        [along + left, left - along, -along - left, along - left].map(|corner| self.centre + corner)
    }

    /// Distance from the centre to a corner.
    pub fn radius_m(&self) -> f64 {
        DVec2::new(self.half_length, self.half_width).length()
    }

    /// Half of the projection of the board onto a unit vector.
    pub(crate) fn half_extent_m(&self, direction: DVec2) -> f64 {
        self.half_length * self.heading.dot(direction).abs() + self.half_width * self.heading.perp_dot(direction).abs()
    }

    /// Whether the circumscribed circles of the boards are further apart than `reach_m`, so the boards are too.
    pub(crate) fn is_beyond(&self, other: &Self, reach_m: f64) -> bool {
        let sum_m = self.radius_m() + other.radius_m() + reach_m;
        self.centre.distance_squared(other.centre) > sum_m * sum_m.max(0.0)
    }

    /// Depth of a point in the board: its distance to the nearest edge, negative outside.
    pub(crate) fn depth_m(&self, point: DVec2) -> f64 {
        (DVec2::new(self.half_length, self.half_width) - self.local(point).abs()).min_element()
    }

    /// The largest gap between the projections of both boards onto the axes of either board. It is a fast lower bound on the
    /// clearance, and close to it for boards side by side.
    pub(crate) fn gap_m(&self, other: &Self) -> f64 {
        let offset = other.centre - self.centre;
        let (parallel, square) = (self.heading.dot(other.heading).abs(), self.heading.perp_dot(other.heading).abs());
        // Half of the projection of a board onto the axes of the other board.
        let along = |board: &Self| board.half_length * parallel + board.half_width * square;
        let across = |board: &Self| board.half_length * square + board.half_width * parallel;
        let ours_m = (self.heading.perp_dot(offset).abs() - self.half_width - across(other))
            .max(self.heading.dot(offset).abs() - self.half_length - along(other));
        let theirs_m = (other.heading.perp_dot(offset).abs() - other.half_width - across(self))
            .max(other.heading.dot(offset).abs() - other.half_length - along(self));
        ours_m.max(theirs_m)
    }

    /// Whether the boards have at least one common point.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.separation(other).0 <= 0.0
    }

    /// Distance of the boards if they are apart, minus the penetration depth if they overlap.
    ///
    /// It is the largest gap between the projections of the boards over all directions. So it changes by at most the sum of the
    /// boards' displacements.
    pub fn clearance(&self, other: &Self) -> f64 {
        let (separation_m, _) = self.separation(other);
        if separation_m <= 0.0 { separation_m } else { self.nearest_points(other).distance_m() }
    }

    /// The clearance, with its point and its direction.
    pub fn approach(&self, other: &Self) -> Approach {
        let (separation_m, axis) = self.separation(other);
        if separation_m <= 0.0 {
            return Approach { clearance_m: separation_m, point: self.overlap_point(other), direction: axis };
        }
        let nearest = self.nearest_points(other);
        let distance_m = nearest.distance_m();
        Approach {
            clearance_m: distance_m,
            point: 0.5 * (nearest.first + nearest.second),
            // A corner that is nearest to an edge lies across that edge, whose normal is exact. The difference of two points
            // that almost touch has few exact digits.
            direction: if distance_m - separation_m <= nearest.rounding_m() {
                axis
            } else {
                (nearest.second - nearest.first) / distance_m
            },
        }
    }

    /// The largest gap between the projections of the boards that the separating axis test finds, and its direction from this
    /// board to the other. The gap is a lower bound on the clearance. It is above 0 exactly if the boards are apart, and equals
    /// the clearance if they overlap.
    pub fn separation(&self, other: &Self) -> (f64, DVec2) {
        let (ours, theirs) = (self.cuboid(), other.cuboid());
        let relative = self.pose().inv_mul(&other.pose());
        let (gap_m, axis) = cuboid_cuboid_find_local_separating_normal_oneway(&ours, &theirs, &relative);
        let (other_gap_m, other_axis) =
            cuboid_cuboid_find_local_separating_normal_oneway(&theirs, &ours, &relative.inverse());
        if gap_m >= other_gap_m {
            (gap_m, self.heading.rotate(axis))
        } else {
            (other_gap_m, -other.heading.rotate(other_axis))
        }
    }

    fn cuboid(&self) -> Cuboid {
        Cuboid::new(DVec2::new(self.half_length, self.half_width))
    }

    fn pose(&self) -> Pose2 {
        Pose2::from_parts(self.centre, Rot2::from_cos_sin_unchecked(self.heading.x, self.heading.y))
    }

    /// The nearest points of two boards that are apart. At least one of the points is a corner.
    fn nearest_points(&self, other: &Self) -> NearestPoints {
        let from_ours = self.corners().map(|corner| NearestPoints { first: corner, second: other.clamp(corner) });
        let from_theirs = other.corners().map(|corner| NearestPoints { first: self.clamp(corner), second: corner });
        from_ours.into_iter().chain(from_theirs).reduce(NearestPoints::nearer).expect("a board has corners")
    }

    /// The point of the board that is nearest to `point`.
    pub(crate) fn clamp(&self, point: DVec2) -> DVec2 {
        let half = DVec2::new(self.half_length, self.half_width);
        self.centre + self.heading.rotate(self.local(point).clamp(-half, half))
    }

    /// Coordinates of a point relative to the centre, with x along the heading.
    pub(crate) fn local(&self, point: DVec2) -> DVec2 {
        (point - self.centre).rotate(DVec2::new(self.heading.x, -self.heading.y))
    }

    /// Mean of the corners of the overlap, which is convex: the other board, clipped at each edge of this board.
    fn overlap_point(&self, other: &Self) -> DVec2 {
        let mut overlap = Polygon::new(&other.corners().map(|corner| self.local(corner)));
        for (normal, half_size) in [
            (DVec2::X, self.half_length),
            (DVec2::Y, self.half_width),
            (DVec2::NEG_X, self.half_length),
            (DVec2::NEG_Y, self.half_width),
        ] {
            overlap = overlap.cut(normal, half_size);
        }
        let middle = overlap.mean().unwrap_or_else(|| 0.5 * self.local(other.centre));
        self.centre + self.heading.rotate(middle)
    }
}

/// A point on each of two boards.
#[derive(Clone, Copy)]
struct NearestPoints {
    first: DVec2,
    second: DVec2,
}

impl NearestPoints {
    fn distance_m(&self) -> f64 {
        self.first.distance(self.second)
    }

    /// Rounding of the distance: each coordinate is the sum of a few products.
    fn rounding_m(&self) -> f64 {
        const STEPS: f64 = 8.0;
        STEPS * f64::EPSILON * (self.first.abs().max_element() + self.second.abs().max_element())
    }

    fn nearer(self, other: Self) -> Self {
        let closer = other.first.distance_squared(other.second) < self.first.distance_squared(self.second);
        if closer { other } else { self }
    }
}

/// A convex polygon with space for a rectangle clipped by four lines. Each line adds at most one corner.
#[derive(Clone, Copy)]
struct Polygon {
    corners: [DVec2; 8],
    count: usize,
}

impl Polygon {
    fn new(corners: &[DVec2]) -> Self {
        let mut polygon = Self { corners: [DVec2::ZERO; 8], count: 0 };
        for &corner in corners {
            polygon.push(corner);
        }
        polygon
    }

    fn push(&mut self, corner: DVec2) {
        self.corners[self.count] = corner;
        self.count += 1;
    }

    /// The part of the polygon with `normal · point <= limit` (Sutherland and Hodgman 1974, CACM 17).
    fn cut(&self, normal: DVec2, limit: f64) -> Self {
        let mut kept = Self::new(&[]);
        for i in 0..self.count {
            let (here, next) = (self.corners[i], self.corners[(i + 1) % self.count]);
            let (out_here, out_next) = (here.dot(normal) - limit, next.dot(normal) - limit);
            if out_here <= 0.0 {
                kept.push(here);
            }
            if (out_here < 0.0 && out_next > 0.0) || (out_here > 0.0 && out_next < 0.0) {
                kept.push(here.lerp(next, out_here / (out_here - out_next)));
            }
        }
        kept
    }

    /// Mean of the corners; `None` for an empty polygon.
    fn mean(&self) -> Option<DVec2> {
        (self.count > 0).then(|| self.corners[..self.count].iter().sum::<DVec2>() / self.count as f64)
    }
}
