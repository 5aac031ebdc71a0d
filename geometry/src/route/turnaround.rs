//! A turnaround: an inward spiral, an S of two arcs, and the same spiral turned by half a turn, walked outward.
//!
//! The spiral r = b·θ reaches the turning circle, of radius R, at the point E, where θ = R/b. The way in has the direction v at
//! E. The way out is the way in, reflected in the centre and walked backwards. So it leaves the circle at −E with the same
//! direction v. Two arcs that touch each other join E to −E. Because the two directions are equal, the arcs turn by the same
//! angle, in opposite directions. They touch on the chord from E to −E, which makes the angle α = atan θ with v. So each arc
//! turns by 2·α, and its part of the chord is 2·radius·sin α. The radii sum to R / sin α, and the S has the length 2·α·R / sin
//! α for every ratio of the radii. The S lies in the circle. An arc that enters the circle at E and ends inside could leave the
//! circle only through two more crossings. Two circles have at most two.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use super::family::SegmentVariation;
use super::{CircularArc, Placement, Route, RouteError, Segment, Spiral, Turn};

/// A turnaround: inward spiral, two tangent arcs in an S inside the turning circle, outward spiral. At t = 0 the head enters
/// the circle. The way in is walked clockwise.
///
/// The parameter of its route is −θ on the way in. Behind the way in, the parameter grows by the length of each arc in metres,
/// and by θ on the way out.
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
    placement: Placement,
    start_travel_m: f64,
    end_travel_m: f64,
}

impl Turnaround {
    /// The turnaround inside a circle of this diameter. `radius_ratio` is the entry arc's radius divided by the exit arc's
    /// radius.
    ///
    /// It is walked from 100 m before the entry into the circle to 100 m past the entry. [`between`](Self::between) sets other
    /// travels.
    ///
    /// # Errors
    /// The pitch must be above 0 and at most 1000 m. The diameter must be above 0 and at most 20 000 pitches. The ratio must be
    /// from 0.01 to 100. The sum of the arcs' radii must be a normal number.
    pub fn new(pitch_m: f64, turn_diameter_m: f64, radius_ratio: f64) -> Result<Self, RouteError> {
        RouteError::check_pitch(pitch_m)?;
        RouteError::check_turn_diameter(turn_diameter_m, pitch_m)?;
        RouteError::check_radius_ratio(radius_ratio)?;
        let circle_angle = 0.5 * turn_diameter_m / (pitch_m / TAU);
        let (turn_angle, radii_sum_m) = (2.0 * circle_angle.atan(), 0.5 * turn_diameter_m / circle_angle.atan().sin());
        // Values near the limits of `f64` give no arcs.
        if !(circle_angle.is_normal() && radii_sum_m.is_normal()) {
            return Err(RouteError::TurnDiameter { turn_diameter_m, pitch_m });
        }
        let way_in = Spiral::new(pitch_m, f64::INFINITY, circle_angle);
        let entry = Segment::Spiral(way_in).point(-circle_angle);
        let exit_radius_m = radii_sum_m / (1.0 + radius_ratio);
        let entry_radius_m = radii_sum_m - exit_radius_m;
        Ok(Self {
            pitch_m,
            way_in,
            circle_angle,
            arcs: [
                CircularArc::from_begin(entry.position, entry.tangent, entry_radius_m, turn_angle, Turn::Clockwise),
                CircularArc::to_end(-entry.position, entry.tangent, exit_radius_m, turn_angle, Turn::CounterClockwise),
            ],
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

    /// Centre of the turning circle.
    pub fn centre(&self) -> DVec2 {
        self.placement.position
    }

    /// The route: four segments. The last one has no end.
    pub fn route(&self) -> Route {
        let [entry_arc, exit_arc] = self.arcs;
        let way_out = Spiral::new(self.pitch_m, self.circle_angle, f64::INFINITY);
        let way_out = way_out.about(DVec2::ZERO, PI, Turn::CounterClockwise);
        let segments =
            [Segment::Spiral(self.way_in), Segment::Arc(entry_arc), Segment::Arc(exit_arc), Segment::Spiral(way_out)];
        let route = Route::new(&segments, 0.0, [self.start_travel_m, self.end_travel_m]);
        route.expect("the arcs join the spirals, and the span was checked").placed(&self.placement)
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
        self.arcs.map(|arc| arc.placed(&self.placement))
    }

    /// Arc length of the S, in metres.
    pub fn turn_length_m(&self) -> f64 {
        self.arcs[0].length_m() + self.arcs[1].length_m()
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

    /// Change of the S per metre of pitch.
    ///
    /// The radius R is fixed. The way in reaches the circle at θ = R/b, which falls by θ/p per metre of pitch. The direction at
    /// the entry falls with θ and α. The length of the arcs is 2·α times the sum of the radii, R / sin α.
    fn turn_variation(&self) -> TurnVariation {
        let (angle, radii_sum_m) = (self.circle_angle, self.arcs[0].radius_m() + self.arcs[1].radius_m());
        let entry_angle = -angle / self.pitch_m;
        let arc_half_angle = entry_angle / (1.0 + angle * angle);
        let scale = -arc_half_angle / angle;
        TurnVariation {
            entry_angle,
            turn: entry_angle + arc_half_angle,
            scale,
            length: 2.0 * arc_half_angle * radii_sum_m + scale * self.turn_length_m(),
        }
    }

    /// Change of the segment that contains a point with this travel.
    ///
    /// At a fixed angle, the spirals are proportional to the pitch. At a fixed angle from its end on the turning circle, each
    /// arc moves, turns and grows with that end.
    pub(super) fn variation(&self, position: DVec2, travel_m: f64) -> SegmentVariation {
        let position = self.placement.unplace(position);
        let (length_m, middle_m) = (self.turn_length_m(), self.arcs[0].length_m());
        let turn = self.turn_variation();
        let circle_speed = self.way_in.speed_m_per_unit(-self.circle_angle) * turn.entry_angle;
        let on_arc = |end: DVec2, travel: f64| {
            let spoke = position - end;
            let position = turn.entry_angle * end.perp() + turn.scale * spoke + turn.turn * spoke.perp();
            SegmentVariation { position, turn: turn.turn, travel }
        };
        let on_spiral = |travel: f64| SegmentVariation { position: position / self.pitch_m, turn: 0.0, travel };
        let variation = if travel_m <= 0.0 {
            on_spiral(travel_m / self.pitch_m + circle_speed)
        } else if travel_m <= middle_m {
            on_arc(self.unplaced_entry(), turn.scale * travel_m)
        } else if travel_m <= length_m {
            on_arc(-self.unplaced_entry(), turn.length - turn.scale * (length_m - travel_m))
        } else {
            on_spiral(turn.length + (travel_m - length_m) / self.pitch_m - circle_speed)
        };
        SegmentVariation { position: self.placement.turn(variation.position), ..variation }
    }

    /// Change of the travel of each seam, in metres per metre of pitch. Each arc keeps its share of the length of the S.
    pub(super) fn seam_variations(&self) -> Vec<f64> {
        let per_metre = self.turn_variation().length / self.turn_length_m();
        [0.0, self.arcs[0].length_m(), self.turn_length_m()].map(|seam_m| per_metre * seam_m).to_vec()
    }
}

/// Change of the S per metre of pitch.
#[derive(Clone, Copy, Debug)]
struct TurnVariation {
    /// Change of the polar angle of the entry.
    entry_angle: f64,
    /// Change of the direction at entry and exit, in radians.
    turn: f64,
    /// Change of the radii, relative to them.
    scale: f64,
    /// Change of the length of the arcs.
    length: f64,
}
