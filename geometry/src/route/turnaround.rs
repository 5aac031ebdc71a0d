//! In on a spiral, round in an S, out on the same spiral turned by half a turn.
//!
//! The spiral r = b·θ comes to the turning circle, of radius R, at the point E, where θ = R/b. The way out is the way in
//! reflected in the centre and walked backwards, so it leaves the circle at −E in the direction v that the way in has at
//! E. Two arcs that touch each other join E to −E. Both directions being equal, the arcs turn by the same angle, one to
//! and one fro, and they touch on the chord from E to −E, which makes the angle α = atan θ with v. So each turns by 2·α,
//! its part of the chord is 2·radius·sin α, the radii sum to R / sin α, and the S is 2·α·R / sin α long, whatever the
//! ratio of the radii. It lies in the circle: an arc that enters the circle at E, and ends within, could leave it only
//! through a second crossing, of which two circles have no more.

use std::f64::consts::TAU;

use glam::DVec2;

use super::arc::{CircularArc, Turn};
use super::archimedean::Archimedean;
use super::variation::PieceVariation;
use super::{Coil, PitchFamily, PolarStretch, Route, RouteError, RoutePoint, RouteVariation};

/// Inward spiral, two tangent arcs in an S inside the turning circle, outward spiral. t = 0 is where the head enters the
/// circle; the way in is walked clockwise.
///
/// Its place is −θ on the way in; from there on it grows by the angle by which an arc has turned, and by θ on the way
/// out.
///
/// ```
/// use bench_dragon_geometry::route::{Route, Turnaround};
///
/// let turnaround = Turnaround::new(1.7, 9.0, 2.0)?;
/// let [entry_arc, exit_arc] = turnaround.arcs();
/// assert!((entry_arc.radius_m() - 3.005418).abs() < 5e-7 && (exit_arc.radius_m() - 1.502709).abs() < 5e-7);
/// assert!((turnaround.turn_length_m() - 13.621245).abs() < 5e-7);
/// assert!((turnaround.point(turnaround.place(0.0)).position.length() - 4.5).abs() < 1e-12);
/// # Ok::<(), crate::route::RouteError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turnaround {
    pitch_m: f64,
    curve: Archimedean,
    /// θ at the turning circle.
    circle_angle: f64,
    /// Arc length from the centre to the turning circle on the spiral.
    circle_length_m: f64,
    arcs: [CircularArc; 2],
    /// Places at entry, between the arcs, and at exit.
    joints: [f64; 3],
    start_travel_m: f64,
    end_travel_m: f64,
}

impl Turnaround {
    /// The turnaround inside a circle of this diameter, `radius_ratio` being the entry arc's radius ÷ the exit arc's.
    ///
    /// It is walked from 100 m before the circle to 100 m past its entry, unless [`between`](Self::between) says
    /// otherwise.
    ///
    /// # Errors
    /// The pitch must be above 0 and at most 1000 m, the diameter above 0 and at most 20 000 pitches, the ratio from
    /// 0.01 to 100.
    pub fn new(pitch_m: f64, turn_diameter_m: f64, radius_ratio: f64) -> Result<Self, RouteError> {
        RouteError::check_pitch(pitch_m)?;
        RouteError::check_turn_diameter(turn_diameter_m, pitch_m)?;
        RouteError::check_radius_ratio(radius_ratio)?;
        let curve = Archimedean { radius_per_radian_m: pitch_m / TAU };
        let circle_angle = 0.5 * turn_diameter_m / curve.radius_per_radian_m;
        let entry = curve.inward(circle_angle);
        let (turn_angle, radii_sum_m) = (2.0 * circle_angle.atan(), 0.5 * turn_diameter_m / circle_angle.atan().sin());
        let exit_radius_m = radii_sum_m / (1.0 + radius_ratio);
        let entry_radius_m = radii_sum_m - exit_radius_m;
        Ok(Self {
            pitch_m,
            curve,
            circle_angle,
            circle_length_m: curve.length_m(circle_angle),
            arcs: [
                CircularArc::from_begin(entry.position, entry.tangent, entry_radius_m, turn_angle, Turn::Clockwise),
                CircularArc::to_end(-entry.position, entry.tangent, exit_radius_m, turn_angle, Turn::CounterClockwise),
            ],
            joints: [-circle_angle, turn_angle - circle_angle, 2.0 * turn_angle - circle_angle],
            start_travel_m: -100.0,
            end_travel_m: 100.0,
        })
    }

    /// The same turnaround, walked from one travel to another, in metres from the entry into the circle.
    ///
    /// # Errors
    /// Both must be finite, and the start before the end.
    pub fn between(self, start_travel_m: f64, end_travel_m: f64) -> Result<Self, RouteError> {
        RouteError::check_span(start_travel_m, end_travel_m)?;
        Ok(Self { start_travel_m, end_travel_m, ..self })
    }

    /// The entry arc and the exit arc.
    pub fn arcs(&self) -> [CircularArc; 2] {
        self.arcs
    }

    /// Length of the two arcs.
    pub fn turn_length_m(&self) -> f64 {
        self.arcs[0].length_m() + self.arcs[1].length_m()
    }

    /// Diameter of the turning circle.
    pub fn turn_diameter_m(&self) -> f64 {
        2.0 * self.curve.radius_per_radian_m * self.circle_angle
    }

    /// Where the S begins, on the turning circle.
    pub fn entry(&self) -> DVec2 {
        self.curve.inward(self.circle_angle).position
    }

    /// Where the S ends, on the turning circle opposite the entry.
    pub fn exit(&self) -> DVec2 {
        -self.entry()
    }

    /// How the S changes, per metre of pitch.
    ///
    /// Held at R, the circle is met at θ = R/b, which falls by θ/p. The direction there falls with θ and α, and the
    /// length of the arcs is 2·α times the sum of the radii, R / sin α.
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

    /// θ at a place on the way out.
    fn angle_out(&self, place: f64) -> f64 {
        self.circle_angle + (place - self.joints[2])
    }
}

impl Route for Turnaround {
    fn start_travel_m(&self) -> f64 {
        self.start_travel_m
    }

    fn end_travel_m(&self) -> f64 {
        self.end_travel_m
    }

    fn pitch_m(&self) -> f64 {
        self.pitch_m
    }

    fn travel(&self, place: f64) -> f64 {
        let [entry, middle, exit] = self.joints;
        let [entry_arc, exit_arc] = &self.arcs;
        if place <= entry {
            self.circle_length_m - self.curve.length_m(-place)
        } else if place <= middle {
            entry_arc.radius_m() * (place - entry)
        } else if place <= exit {
            entry_arc.length_m() + exit_arc.radius_m() * (place - middle)
        } else {
            self.turn_length_m() + (self.curve.length_m(self.angle_out(place)) - self.circle_length_m)
        }
    }

    fn place(&self, travel_m: f64) -> f64 {
        let [entry, middle, exit] = self.joints;
        let [entry_arc, exit_arc] = &self.arcs;
        let travel_m = travel_m.min(self.end_travel_m);
        if travel_m <= 0.0 {
            -self.curve.angle(self.circle_length_m - travel_m)
        } else if travel_m <= entry_arc.length_m() {
            entry + travel_m / entry_arc.radius_m()
        } else if travel_m <= self.turn_length_m() {
            middle + (travel_m - entry_arc.length_m()) / exit_arc.radius_m()
        } else {
            let angle = self.curve.angle(self.circle_length_m + (travel_m - self.turn_length_m()));
            exit + (angle - self.circle_angle)
        }
    }

    fn place_near(&self, travel_m: f64, guess: f64) -> f64 {
        let travel_m = travel_m.min(self.end_travel_m);
        let past_turn_m = travel_m - self.turn_length_m();
        if travel_m <= 0.0 {
            -self.curve.angle_near(self.circle_length_m - travel_m, -guess)
        } else if past_turn_m > 0.0 {
            let angle = self.curve.angle_near(self.circle_length_m + past_turn_m, self.angle_out(guess));
            self.joints[2] + (angle - self.circle_angle)
        } else {
            self.place(travel_m)
        }
    }

    fn point(&self, place: f64) -> RoutePoint {
        let [entry, middle, exit] = self.joints;
        if place <= entry {
            self.curve.inward(-place)
        } else if place <= middle {
            self.arcs[0].point(place - entry)
        } else if place <= exit {
            self.arcs[1].point(place - middle)
        } else {
            // Reflected in the centre and walked backwards: the position changes its sign, the tangent twice.
            let RoutePoint { position, tangent, pace_m } = self.curve.inward(self.angle_out(place));
            RoutePoint { position: -position, tangent, pace_m }
        }
    }

    fn step_back(&self, place: f64, arc_m: f64) -> f64 {
        let [entry, middle, exit] = self.joints;
        let (mut place, mut left_m) = (place, arc_m);
        if place > exit {
            let angle = self.angle_out(place);
            let next = place - self.curve.step_in(angle, left_m);
            if next >= exit {
                return next;
            }
            left_m -= self.curve.length_m(angle) - self.circle_length_m;
            place = exit;
        }
        for (arc, joint) in [(&self.arcs[1], middle), (&self.arcs[0], entry)] {
            if place > joint {
                let next = place - left_m.max(0.0) / arc.radius_m();
                if next >= joint {
                    return next;
                }
                left_m -= arc.radius_m() * (place - joint);
                place = joint;
            }
        }
        place - self.curve.step_out(-place, left_m.max(0.0))
    }

    /// Exact: each spiral is most curved where it is nearest to the circle.
    fn curvature_bound(&self, rear: f64, front: f64) -> f64 {
        let [entry, middle, exit] = self.joints;
        let way_in = if rear <= entry { self.curve.curvature(-front.min(entry)) } else { 0.0 };
        let entry_arc = if rear <= middle && front >= entry { 1.0 / self.arcs[0].radius_m() } else { 0.0 };
        let exit_arc = if rear <= exit && front >= middle { 1.0 / self.arcs[1].radius_m() } else { 0.0 };
        let way_out = if front >= exit { self.curve.curvature(self.angle_out(rear.max(exit))) } else { 0.0 };
        way_in.max(entry_arc).max(exit_arc).max(way_out)
    }

    /// On the way out a place near 0 stands for a large angle, which is what is rounded.
    fn rounding_m(&self, place: f64, pace_m: f64) -> f64 {
        f64::EPSILON * place.abs().max(self.angle_out(place)) * pace_m
    }

    fn joints(&self) -> &[f64] {
        &self.joints
    }

    /// The way out is the way in reflected in the centre: its radius is negative.
    fn polar_stretches(&self) -> Vec<PolarStretch> {
        let [entry, middle, exit] = self.joints;
        let way_in = self.curve.way_in();
        let way_out = PolarStretch {
            begin: exit,
            angle: self.angle_out(0.0),
            turn: 1.0,
            radius_per_radian_m: -way_in.radius_per_radian_m,
            ..way_in
        };
        vec![way_in, self.arcs[0].stretch(entry), self.arcs[1].stretch(middle), way_out]
    }

    fn coil(&self) -> Option<Coil> {
        Some(Coil {
            end_place: self.joints[0],
            end_angle: self.circle_angle,
            radius_per_radian_m: self.curve.radius_per_radian_m,
            way_out: Some(self.joints[2]),
        })
    }
}

/// How the S changes, per metre of pitch.
#[derive(Clone, Copy, Debug)]
struct TurnVariation {
    /// Of the polar angle of the entry.
    entry_angle: f64,
    /// Of the direction at entry and exit, in radians.
    turn: f64,
    /// Of the radii, relative to them.
    scale: f64,
    /// Of the length of the arcs.
    length: f64,
}

/// Held are the turning circle, the ratio of the radii, and t = 0 at the entry into the circle.
impl PitchFamily for Turnaround {
    /// The spirals grow as the pitch does at a fixed angle. Each arc moves, turns and grows with the end that it has on
    /// the turning circle, at a fixed angle from there.
    fn variation(&self, place: f64) -> RouteVariation {
        let [entry, middle, exit] = self.joints;
        let (point, travel_m, length_m) = (self.point(place), self.travel(place), self.turn_length_m());
        let turn = self.turn_variation();
        let circle_pace_m = self.curve.pace_m(self.circle_angle);
        let on_arc = |end: DVec2, travel: f64| {
            let spoke = point.position - end;
            let position = turn.entry_angle * end.perp() + turn.scale * spoke + turn.turn * spoke.perp();
            PieceVariation { position, turn: turn.turn, travel }
        };
        let on_spiral = |travel: f64| PieceVariation { position: point.position / self.pitch_m, turn: 0.0, travel };
        let (piece, curvature) = if place <= entry {
            let travel = travel_m / self.pitch_m + circle_pace_m * turn.entry_angle;
            (on_spiral(travel), -self.curve.curvature(-place))
        } else if place <= middle {
            (on_arc(self.entry(), turn.scale * travel_m), -1.0 / self.arcs[0].radius_m())
        } else if place <= exit {
            let travel = turn.length - turn.scale * (length_m - travel_m);
            (on_arc(self.exit(), travel), 1.0 / self.arcs[1].radius_m())
        } else {
            let travel = turn.length + (travel_m - length_m) / self.pitch_m - circle_pace_m * turn.entry_angle;
            (on_spiral(travel), self.curve.curvature(self.angle_out(place)))
        };
        piece.at_travel(&point, curvature)
    }

    /// The arcs keep their shares of the length.
    fn joint_variations(&self) -> Vec<f64> {
        let per_metre = self.turn_variation().length / self.turn_length_m();
        self.joints.iter().map(|&joint| per_metre * self.travel(joint)).collect()
    }
}
