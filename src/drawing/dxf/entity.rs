//! Entities of a DXF file, and their curves.

use std::f64::consts::TAU;

use bench_dragon_geometry::drawing::{Piece, Spline};
use bench_dragon_geometry::number::Number;
use glam::{DAffine2, DMat2, DVec2, DVec3};

use super::super::{DrawingFileError, MAX_PIECES, quoted};
use super::model::Pair;

/// Entities with a curve.
const CURVES: [&str; 7] = ["ARC", "CIRCLE", "ELLIPSE", "LINE", "LWPOLYLINE", "POLYLINE", "SPLINE"];

/// An entity: its name, its groups, and the groups of its vertices.
pub(super) struct Entity<'a> {
    pub(super) kind: &'a str,
    pub(super) groups: Vec<Pair<'a>>,
    pub(super) vertices: Vec<Vec<Pair<'a>>>,
}

impl<'a> Entity<'a> {
    /// Whether it is a curve of the model, and not of a sheet of paper.
    pub(super) fn is_curve(&self) -> bool {
        CURVES.contains(&self.kind) && !self.is_on_paper()
    }

    /// Whether it belongs to a sheet of paper.
    pub(super) fn is_on_paper(&self) -> bool {
        self.text(67) == Some("1")
    }

    /// Its layer; empty without one.
    pub(super) fn layer(&self) -> &'a str {
        self.text(8).unwrap_or_default()
    }

    /// Its handle; empty without one.
    pub(super) fn handle(&self) -> &'a str {
        self.text(5).unwrap_or_default()
    }

    pub(super) fn text(&self, code: i32) -> Option<&'a str> {
        self.groups.iter().find(|group| group.0 == code).map(|group| group.1)
    }

    /// The number of a group; `None` without one.
    pub(super) fn number(&self, code: i32) -> Result<Option<f64>, DrawingFileError> {
        self.text(code).map(|value| self.parsed(code, value)).transpose()
    }

    fn required(&self, code: i32) -> Result<f64, DrawingFileError> {
        self.number(code)?.ok_or_else(|| self.fault(&format!("has no group {code}")))
    }

    fn numbers(&self, code: i32) -> Result<Vec<f64>, DrawingFileError> {
        self.groups.iter().filter(|group| group.0 == code).map(|&(code, value)| self.parsed(code, value)).collect()
    }

    fn flags(&self, code: i32) -> Result<u32, DrawingFileError> {
        Ok(self.number(code)?.unwrap_or(0.0) as u32)
    }

    /// The point whose coordinates have this code and the one 10 above.
    pub(super) fn point(&self, code: i32) -> Result<DVec2, DrawingFileError> {
        Ok(DVec2::new(self.required(code)?, self.required(code + 10)?))
    }

    fn points(&self, code: i32) -> Result<Vec<DVec2>, DrawingFileError> {
        let (x, y) = (self.numbers(code)?, self.numbers(code + 10)?);
        if x.len() != y.len() {
            let [x, y] = [x.len(), y.len()];
            return Err(self.fault(&format!("has {x} groups {code} and {y} groups {}, must have as many", code + 10)));
        }
        Ok(x.into_iter().zip(y).map(DVec2::from).collect())
    }

    fn parsed(&self, code: i32, value: &str) -> Result<f64, DrawingFileError> {
        let number = value.parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| self.fault(&format!("has {} in group {code}, must be a number", quoted(value))))
    }

    pub(super) fn fault(&self, reason: &str) -> DrawingFileError {
        let handle = self.text(5).map_or(String::new(), |handle| format!(" {}", quoted(handle)));
        DrawingFileError(format!("the {}{handle} {reason}", quoted(self.kind)))
    }

    /// Whether the plane of the entity is seen from below: its x is then −x.
    pub(super) fn is_mirrored(&self) -> Result<bool, DrawingFileError> {
        let normal = DVec3::new(
            self.number(210)?.unwrap_or(0.0),
            self.number(220)?.unwrap_or(0.0),
            self.number(230)?.unwrap_or(1.0),
        );
        let is_flat = normal.truncate().length() <= 1e-9 * normal.z.abs();
        if is_flat { Ok(normal.z < 0.0) } else { Err(self.fault("does not lie in a horizontal plane")) }
    }
}

/// The pieces of an entity with a curve, and whether they are closed.
pub(super) fn curve(entity: &Entity<'_>) -> Result<(Vec<Piece>, bool), DrawingFileError> {
    const IN_SPACE: u32 = 8;
    let (pieces, is_closed) = match entity.kind {
        "LINE" => (vec![Piece::Line { from: entity.point(10)?, to: entity.point(11)? }], false),
        "ARC" => {
            let [from, to] = [entity.required(50)?, entity.required(51)?].map(f64::to_radians);
            let turn = (to - from).rem_euclid(TAU);
            (vec![arc(entity, from, if turn == 0.0 { TAU } else { turn })?], false)
        }
        "CIRCLE" => (vec![arc(entity, 0.0, TAU)?], true),
        "ELLIPSE" => ellipse(entity)?,
        "LWPOLYLINE" => polyline(&weighted(entity)?, entity.flags(70)? & 1 == 1),
        "POLYLINE" => polyline(&vertices(entity)?, entity.flags(70)? & 1 == 1),
        _ => spline(entity)?,
    };
    if pieces.len() > MAX_PIECES {
        return Err(entity.fault(&format!("has {} parts, at most {MAX_PIECES} are allowed", pieces.len())));
    }
    // Entities other than lines, ellipses, splines and polylines in space are in their own plane.
    let is_in_space = entity.kind == "POLYLINE" && entity.flags(70)? & IN_SPACE != 0;
    let is_in_plane = ["ARC", "CIRCLE", "LWPOLYLINE", "POLYLINE"].contains(&entity.kind) && !is_in_space;
    let mirrored = DAffine2::from_scale(DVec2::new(-1.0, 1.0));
    if is_in_plane && entity.is_mirrored()? {
        return Ok((pieces.iter().flat_map(|piece| piece.mapped(&mirrored)).collect(), is_closed));
    }
    Ok((pieces, is_closed))
}

fn arc(entity: &Entity<'_>, from_angle: f64, turn: f64) -> Result<Piece, DrawingFileError> {
    let (centre, radius_m) = (entity.point(10)?, entity.required(40)?);
    if radius_m > 0.0 {
        Ok(Piece::Arc { centre, radius_m, from_angle, turn })
    } else {
        Err(entity.fault(&format!("has the radius {}, must be above 0", Number(radius_m))))
    }
}

fn ellipse(entity: &Entity<'_>) -> Result<(Vec<Piece>, bool), DrawingFileError> {
    let (centre, major, ratio) = (entity.point(10)?, entity.point(11)?, entity.required(40)?);
    let (from, to) = (entity.number(41)?.unwrap_or(0.0), entity.number(42)?.unwrap_or(TAU));
    if !(major.length() > 0.0 && ratio > 0.0) {
        return Err(entity.fault("has an axis without a length"));
    }
    let minor = ratio * if entity.is_mirrored()? { -major.perp() } else { major.perp() };
    let turn = (to - from).rem_euclid(TAU);
    let is_closed = turn < 1e-9 || TAU - turn < 1e-9;
    let turn = if is_closed { TAU } else { turn };
    let map = DAffine2::from_mat2_translation(DMat2::from_cols(major, minor), centre);
    let circle = Piece::Arc { centre: DVec2::ZERO, radius_m: 1.0, from_angle: from, turn };
    Ok((circle.mapped(&map), is_closed))
}

/// The points of an LWPOLYLINE, each with the bulge of the edge behind it.
fn weighted(entity: &Entity<'_>) -> Result<Vec<(DVec2, f64)>, DrawingFileError> {
    let mut points: Vec<(DVec2, f64)> = vec![];
    // A point has no y before its group 20.
    for &(code, value) in &entity.groups {
        match (code, points.last_mut()) {
            (10, _) => points.push((DVec2::new(entity.parsed(code, value)?, f64::NAN), 0.0)),
            (20, Some(last)) => last.0.y = entity.parsed(code, value)?,
            (42, Some(last)) => last.1 = entity.parsed(code, value)?,
            _ => {}
        }
    }
    if points.iter().any(|(point, _)| point.y.is_nan()) {
        return Err(entity.fault("has a point without a group 20, must have one for each group 10"));
    }
    Ok(points)
}

/// The same for a POLYLINE and its vertices. Control points of a fitted spline are left out.
fn vertices(entity: &Entity<'_>) -> Result<Vec<(DVec2, f64)>, DrawingFileError> {
    const SPLINE_CONTROL_POINT: u32 = 16;
    if entity.flags(70)? & (16 | 64) != 0 {
        return Err(entity.fault("is a mesh, must be a polyline"));
    }
    let mut points = vec![];
    for groups in &entity.vertices {
        let vertex = Entity { kind: "VERTEX", groups: groups.clone(), vertices: vec![] };
        if vertex.flags(70)? & SPLINE_CONTROL_POINT == 0 {
            points.push((vertex.point(10)?, vertex.number(42)?.unwrap_or(0.0)));
        }
    }
    Ok(points)
}

/// Lines and arcs between points. A bulge is the tangent of a quarter of the angle of an arc.
fn polyline(points: &[(DVec2, f64)], is_closed: bool) -> (Vec<Piece>, bool) {
    let next = points.iter().skip(1).chain(points.first().filter(|_| is_closed));
    let edge = |(&(from, bulge), &(to, _)): (&(DVec2, f64), &(DVec2, f64))| {
        if bulge == 0.0 || from == to {
            return Piece::Line { from, to };
        }
        let chord = to - from;
        let centre = from.midpoint(to) + chord.perp() * (1.0 - bulge * bulge) / (4.0 * bulge);
        let spoke = from - centre;
        Piece::Arc { centre, radius_m: spoke.length(), from_angle: spoke.to_angle(), turn: 4.0 * bulge.atan() }
    };
    (points.iter().zip(next).map(edge).collect(), is_closed)
}

fn spline(entity: &Entity<'_>) -> Result<(Vec<Piece>, bool), DrawingFileError> {
    let points = entity.points(10)?;
    if points.is_empty() {
        return Err(
            entity.fault("has only fit points, must have control points: save it as a spline with control points")
        );
    }
    let degree = entity.required(71)?.clamp(0.0, 1e3) as usize;
    let spline = Spline { degree, knots: entity.numbers(40)?, points, weights: entity.numbers(41)? };
    let beziers = spline.beziers().ok_or_else(|| entity.fault("has a degree, knots or weights of no spline"))?;
    let is_closed = entity.flags(70)? & 1 == 1;
    Ok((beziers.into_iter().map(Piece::Bezier).collect(), is_closed))
}
