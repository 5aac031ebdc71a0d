//! A turnaround: an inward spiral, an S of two arcs, and the same spiral turned by half a turn, walked outward.
//!
//! The spiral r = b·θ reaches the turning circle, of radius R, at the point E, where θ = R/b. The way in has the direction v at
//! E. The way out is the way in, reflected in the centre and walked backwards. So it leaves the circle at −E with the same
//! direction v. Two arcs join E to −E, with a straight line of length ℓ between them that is tangent to both. Because the two
//! directions are equal, the arcs turn by the same angle 2ψ, in opposite directions.
//!
//! *Closed form.* Let α = atan θ, the angle between v and the chord from E to −E. Let λ = ℓ/2R, and let r be the sum of the
//! radii. In axes along v and to the right of it, the S adds up to the chord:
//!
//! ```text
//! r·sin 2ψ + ℓ·cos 2ψ = 2R·cos α,   r·(1 − cos 2ψ) + ℓ·sin 2ψ = 2R·sin α
//! ```
//!
//! With tan ψ = t, the second minus t times the first is 2R·(sin α − t·cos α) = ℓ·t. So tan ψ = sin α / (cos α + λ). Then ψ =
//! α − δ, with tan δ = λ·sin α / (1 + λ·cos α). The centres of the two circles are √(r² + ℓ²) apart, so r = (1 − λ²)·R / sin α.
//! The S has the length 2ψ·r + ℓ for every ratio of the radii. Without a line, δ = 0 and the arcs touch on the chord.
//!
//! *The S lies in the circle* if 0 ≤ ℓ < 2R:
//!
//! 1. With u the direction of the line, let Q = −E − ℓ·u. The entry arc ends on the chord from E to Q, because its end is
//!    linear in its radius: E for a radius of 0, and Q for a radius of r.
//! 2. Q lies in the circle: |Q|² − R² = ℓ·(ℓ − 2R·cos(2ψ − α)). From sin δ = λ·sin ψ follows δ ≤ ψ < π/2, and from 2ψ − α =
//!    ψ − δ follows sin ψ·cos(ψ − δ) − sin δ = cos ψ·sin(ψ − δ) ≥ 0. So λ ≤ cos(2ψ − α).
//! 3. So the entry arc ends in the circle. By symmetry the exit arc begins in the circle. A circle is convex, so the line
//!    between them lies in it.
//! 4. An arc that enters the circle at E and ends inside could leave the circle only through two more crossings. Two circles
//!    have at most two.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use super::capability::PlaneCurve;
use super::family::{RouteMeasure, SegmentVariation};
use super::{CircularArc, Line, Placement, Route, RouteError, Segment, Spiral, Turn};

/// Smallest radius of an arc, in metres.
const LEAST_RADIUS_M: f64 = 1e-9;

/// A turnaround: inward spiral, an S inside the turning circle, outward spiral. The S is two arcs, possibly with a straight
/// line between them that is tangent to both. At t = 0 the head enters the circle. The way in is walked clockwise.
///
/// The parameter of its route is −θ on the way in. Behind the way in, the parameter grows by the length of each arc and of the
/// line in metres, and by θ on the way out.
///
/// ```
/// use bench_dragon_geometry::route::Turnaround;
///
/// let turnaround = Turnaround::new(1.7, 9.0, 2.0)?;
/// let [entry_arc, exit_arc] = turnaround.arcs();
/// assert!((entry_arc.radius_m() - 3.005418).abs() < 5e-7 && (exit_arc.radius_m() - 1.502709).abs() < 5e-7);
/// assert!((turnaround.turn_length_m() - 13.621245).abs() < 5e-7);
/// let route = turnaround.route();
/// assert!((route.point(route.parameter(0.0)).position.length() - 4.5).abs() < 1e-12);
/// # Ok::<(), bench_dragon_geometry::route::RouteError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turnaround {
    pitch_m: f64,
    /// The inward spiral, which ends at the turning circle.
    way_in: Spiral,
    /// θ at the turning circle.
    circle_angle: f64,
    /// About the origin, like all of the above.
    arcs: [CircularArc; 2],
    /// Length of the line between the arcs; 0 without one.
    line_m: f64,
    placement: Placement,
    start_travel_m: f64,
    end_travel_m: f64,
}

impl Turnaround {
    /// The turnaround inside a circle of this diameter, without a line between its arcs. `radius_ratio` is the entry arc's
    /// radius divided by the exit arc's radius.
    ///
    /// It is walked from 100 m before the entry into the circle to 100 m past the entry. [`between`](Self::between) sets other
    /// travels.
    ///
    /// # Errors
    /// The pitch must be above 0 and at most 1000 m. The diameter must be above 0 and at most 20 000 pitches. The ratio must be
    /// from 0.01 to 100. The sum of the arcs' radii must be a normal number.
    pub fn new(pitch_m: f64, turn_diameter_m: f64, radius_ratio: f64) -> Result<Self, RouteError> {
        Self::with_line(pitch_m, turn_diameter_m, radius_ratio, 0.0)
    }

    /// The same with a line of the length `line_m` between its arcs.
    ///
    /// # Errors
    /// Those of [`new`](Self::new). The line must be 0 m long or longer, and shorter than the diameter.
    pub fn with_line(pitch_m: f64, turn_diameter_m: f64, radius_ratio: f64, line_m: f64) -> Result<Self, RouteError> {
        RouteError::check_pitch(pitch_m)?;
        RouteError::check_turn_diameter(turn_diameter_m, pitch_m)?;
        RouteError::check_radius_ratio(radius_ratio)?;
        RouteError::check_turn_line(line_m, turn_diameter_m)?;
        let circle_angle = 0.5 * turn_diameter_m / (pitch_m / TAU);
        let Bend { turn_angle, radii_sum_m } = Bend::new(circle_angle, turn_diameter_m, line_m);
        let exit_radius_m = radii_sum_m / (1.0 + radius_ratio);
        let entry_radius_m = radii_sum_m - exit_radius_m;
        // Values near the limits of `f64` give no arcs.
        if !(circle_angle.is_normal() && entry_radius_m.min(exit_radius_m) >= LEAST_RADIUS_M) {
            return Err(RouteError::TurnDiameter { turn_diameter_m, pitch_m });
        }
        let way_in = Spiral::new(pitch_m, f64::INFINITY, circle_angle);
        let entry = Segment::Spiral(way_in).point(-circle_angle);
        Ok(Self {
            pitch_m,
            way_in,
            circle_angle,
            arcs: [
                CircularArc::from_begin(entry.position, entry.tangent, entry_radius_m, turn_angle, Turn::Clockwise),
                CircularArc::to_end(-entry.position, entry.tangent, exit_radius_m, turn_angle, Turn::CounterClockwise),
            ],
            line_m,
            placement: Placement::default(),
            start_travel_m: -100.0,
            end_travel_m: 100.0,
        })
    }

    /// The same turnaround, walked between two travels, in metres from the entry into the circle.
    ///
    /// # Errors
    /// Both travels must be finite, and the start must be before the end.
    pub fn between(self, start_travel_m: f64, end_travel_m: f64) -> Result<Self, RouteError> {
        RouteError::check_span(start_travel_m, end_travel_m)?;
        Ok(Self { start_travel_m, end_travel_m, ..self })
    }

    /// The same turnaround about another centre.
    #[must_use]
    pub fn placed(self, placement: Placement) -> Self {
        Self { placement, ..self }
    }

    /// Where the turnaround lies.
    pub fn placement(&self) -> Placement {
        self.placement
    }

    /// Centre of the turning circle.
    pub fn centre(&self) -> DVec2 {
        self.placement.position
    }

    /// The route: four segments, or five with a line. The last one has no end.
    pub fn route(&self) -> Route {
        let [entry_arc, exit_arc] = self.arcs;
        let way_out = Spiral::new(self.pitch_m, self.circle_angle, f64::INFINITY);
        let way_out = way_out.about(DVec2::ZERO, PI, Turn::CounterClockwise);
        let mut segments = vec![Segment::Spiral(self.way_in), Segment::Arc(entry_arc)];
        segments.extend(self.unplaced_line().map(Segment::Line));
        segments.extend([Segment::Arc(exit_arc), Segment::Spiral(way_out)]);
        let route = Route::new(&segments, 0.0, [self.start_travel_m, self.end_travel_m]);
        route.expect("the S joins the spirals, and the span was checked").placed(&self.placement)
    }

    fn unplaced_line(&self) -> Option<Line> {
        let arc = Segment::Arc(self.arcs[0]);
        let end = arc.point(arc.span().1);
        (self.line_m > 0.0).then(|| Line::from_begin(end.position, end.tangent, self.line_m))
    }

    /// Distance between neighbouring turns of the spirals.
    pub fn pitch_m(&self) -> f64 {
        self.pitch_m
    }

    /// Travel at which the route starts.
    pub fn start_travel_m(&self) -> f64 {
        self.start_travel_m
    }

    /// Travel at which the route ends.
    pub fn end_travel_m(&self) -> f64 {
        self.end_travel_m
    }

    /// The entry arc and the exit arc.
    pub fn arcs(&self) -> [CircularArc; 2] {
        self.arcs.map(|mut arc| {
            arc.place(&self.placement);
            arc
        })
    }

    /// Length of the line between the arcs, in metres; 0 without one.
    pub fn line_m(&self) -> f64 {
        self.line_m
    }

    /// Travel at the ends of the entry arc, of the line, and of the exit arc, in metres.
    pub fn ends_m(&self) -> [f64; 3] {
        let [entry_m, exit_m] = self.arcs.map(|arc| arc.length_m());
        [entry_m, entry_m + self.line_m, entry_m + self.line_m + exit_m]
    }

    /// Arc length of the S, in metres.
    pub fn turn_length_m(&self) -> f64 {
        self.ends_m()[2]
    }

    /// Diameter of the turning circle, in metres.
    pub fn turn_diameter_m(&self) -> f64 {
        2.0 * self.way_in.radius_per_radian_m() * self.circle_angle
    }

    /// The point on the turning circle at which the S begins.
    pub fn entry(&self) -> DVec2 {
        self.placement.place(self.unplaced_entry())
    }

    fn unplaced_entry(&self) -> DVec2 {
        Segment::Spiral(self.way_in).point(-self.circle_angle).position
    }

    /// The point on the turning circle at which the S ends, opposite the entry.
    pub fn exit(&self) -> DVec2 {
        self.placement.place(-self.unplaced_entry())
    }

    /// Change of the S per unit of a measure.
    ///
    /// The way in reaches the circle at θ = R/b = 2π·R/p. The direction at the entry changes with θ and α. The sum of the radii,
    /// (1 − λ²)·R / sin α, changes by −cot α = −1/θ of itself per radian of α, and by −2λ/(1 − λ²) of itself per unit of λ. Half the
    /// angle of the arcs is ψ = α − δ. With q = 1 + 2λ·cos α + λ², dδ/dα = (λ·cos α + λ²) / q and dδ/dλ = sin α / q. A ratio k of
    /// the radii makes the entry arc k/(1 + k) of the sum.
    fn turn_variation(&self, measure: RouteMeasure) -> TurnVariation {
        let per = |other: RouteMeasure| if measure == other { 1.0 } else { 0.0 };
        let (pitch, radius, longer) =
            (per(RouteMeasure::Pitch), 0.5 * per(RouteMeasure::TurnDiameter), per(RouteMeasure::TurnLine));
        let (angle, diameter_m) = (self.circle_angle, self.turn_diameter_m());
        let [entry_radius_m, exit_radius_m] = self.arcs.map(|arc| arc.radius_m());
        let ratio = entry_radius_m / exit_radius_m;
        let growth = radius / (0.5 * diameter_m);
        let entry_angle = angle * growth - angle * pitch / self.pitch_m;
        let chord_angle = entry_angle / (1.0 + angle * angle);
        let (line, cosine) = (self.line_m / diameter_m, (1.0 + angle * angle).sqrt().recip());
        let line_change = longer / diameter_m - line * growth;
        let square = 1.0 + 2.0 * line * cosine + line * line;
        let bend = line * (cosine + line) / square;
        let less_turn = bend * chord_angle + line_change * angle * cosine / square;
        let arc_angle = 2.0 * (chord_angle - less_turn);
        let scale = growth - 2.0 * line * line_change / (1.0 - line * line) - chord_angle / angle;
        let exit_share = -per(RouteMeasure::RadiusRatio) / (1.0 + ratio);
        TurnVariation {
            entry_angle,
            growth,
            turn: entry_angle + chord_angle,
            arc_angle,
            scale,
            shares: [-exit_share / ratio, exit_share],
            length: arc_angle * (entry_radius_m + exit_radius_m)
                + scale * (self.turn_length_m() - self.line_m)
                + longer,
            longer,
        }
    }

    /// Change of the segment that contains a point with this travel.
    ///
    /// At a fixed angle, the spirals are proportional to the pitch, and do not change with other measures. At a fixed angle from its
    /// end on the turning circle, each arc moves, turns and grows with that end. At a fixed distance from its beginning, the
    /// line moves and turns with the end of the entry arc.
    pub(super) fn variation(&self, measure: RouteMeasure, position: DVec2, travel_m: f64) -> SegmentVariation {
        let position = self.placement.unplace(position);
        let [entry_end_m, line_end_m, length_m] = self.ends_m();
        let turn = self.turn_variation(measure);
        let circle_speed = self.way_in.speed_m_per_unit(-self.circle_angle) * turn.entry_angle;
        let pitch = if measure == RouteMeasure::Pitch { 1.0 } else { 0.0 };
        let on_spiral = |travel: f64| SegmentVariation { position: pitch * position / self.pitch_m, turn: 0.0, travel };
        let [entry_scale, exit_scale] = turn.shares.map(|share| turn.scale + share);
        let variation = if travel_m <= 0.0 {
            on_spiral(pitch * travel_m / self.pitch_m + circle_speed)
        } else if travel_m <= entry_end_m {
            turn.on_arc(position, self.unplaced_entry(), entry_scale, entry_scale * travel_m)
        } else if travel_m <= line_end_m {
            self.line_variation(&turn, travel_m - entry_end_m)
        } else if travel_m <= length_m {
            let travel = turn.length - exit_scale * (length_m - travel_m);
            turn.on_arc(position, -self.unplaced_entry(), exit_scale, travel)
        } else {
            on_spiral(turn.length + pitch * (travel_m - length_m) / self.pitch_m - circle_speed)
        };
        SegmentVariation { position: self.placement.turn(variation.position), ..variation }
    }

    /// Change of the line at a fixed distance from its beginning. The end of the entry arc moves with the arc, and along it as
    /// the arc's angle grows.
    fn line_variation(&self, turn: &TurnVariation, from_begin_m: f64) -> SegmentVariation {
        let arc = Segment::Arc(self.arcs[0]);
        let end = arc.point(arc.span().1);
        let (grown_m, turned) = (turn.arc_angle * self.arcs[0].radius_m(), turn.turn - turn.arc_angle);
        let scale = turn.scale + turn.shares[0];
        let begin = turn.on_arc(end.position, self.unplaced_entry(), scale, scale * self.arcs[0].length_m());
        let position = begin.position + grown_m * end.tangent + turned * from_begin_m * end.tangent.perp();
        SegmentVariation { position, turn: turned, travel: begin.travel + grown_m }
    }

    /// Change of the travel of each seam, in metres per unit of a measure. At a fixed ratio of the radii, each arc keeps its share of
    /// the length of both.
    pub(super) fn seam_variations(&self, measure: RouteMeasure) -> Vec<f64> {
        let turn = self.turn_variation(measure);
        let [entry_m, exit_m] = self.arcs.map(|arc| arc.length_m());
        let per_metre = (turn.length - turn.longer) / (entry_m + exit_m);
        let entry_end = (per_metre + turn.shares[0]) * entry_m;
        let line_end = (self.line_m > 0.0).then_some(entry_end + turn.longer);
        let exit_end = per_metre * (entry_m + exit_m) + turn.longer;
        [0.0, entry_end].into_iter().chain(line_end).chain([exit_end]).collect()
    }
}

/// The arcs of an S.
struct Bend {
    /// 2ψ: the angle of each arc.
    turn_angle: f64,
    /// Sum of the radii, in metres.
    radii_sum_m: f64,
}

impl Bend {
    /// The arcs of an S that begins where the spiral has the angle θ, in a circle of this diameter.
    fn new(circle_angle: f64, turn_diameter_m: f64, line_m: f64) -> Self {
        let (line, (sine, cosine)) = (line_m / turn_diameter_m, circle_angle.atan().sin_cos());
        let less_turn = (line * sine).atan2(1.0 + line * cosine);
        Self {
            turn_angle: 2.0 * (circle_angle.atan() - less_turn),
            radii_sum_m: (1.0 - line) * (1.0 + line) * (0.5 * turn_diameter_m / sine),
        }
    }
}

/// Change of the S per unit of a measure.
#[derive(Clone, Copy, Debug)]
struct TurnVariation {
    /// Change of the polar angle of the entry.
    entry_angle: f64,
    /// Change of the turning circle's radius, relative to it.
    growth: f64,
    /// Change of the direction at entry and exit, in radians.
    turn: f64,
    /// Change of the angle of each arc.
    arc_angle: f64,
    /// Change of the sum of the radii, relative to it.
    scale: f64,
    /// Change of the radii of the entry arc and of the exit arc at a fixed sum, relative to them.
    shares: [f64; 2],
    /// Change of the length of the S.
    length: f64,
    /// Change of the length of the line.
    longer: f64,
}

impl TurnVariation {
    /// Change of a point of an arc at a fixed angle from the arc's end on the turning circle. `scale` is the change of its radius,
    /// relative to it, and `travel` that of its travel.
    fn on_arc(&self, position: DVec2, end: DVec2, scale: f64, travel: f64) -> SegmentVariation {
        let spoke = position - end;
        let position = self.entry_angle * end.perp() + self.growth * end + scale * spoke + self.turn * spoke.perp();
        SegmentVariation { position, turn: self.turn, travel }
    }
}
