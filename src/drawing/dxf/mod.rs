//! Paths of DXF files in text form: lines, arcs, circles, ellipses, polylines with bulges, and splines.
//!
//! Source: Autodesk, *DXF Reference* (2012). A file is a list of pairs of lines: a group code and a value. This reader keeps
//! only the entities above: the crate `dxf` reads everything, but takes longer to build than usvg and all of its crates.

mod chain;

use std::f64::consts::TAU;

use bench_dragon_geometry::drawing::{Drawing, Piece, Spline};
use glam::{DAffine2, DMat2, DVec2, DVec3};

use super::{DrawingFileError, MAX_PIECES, PathChoice, listed, quoted};
use chain::{order, place};

/// Begins a DXF file in binary form.
const BINARY: &[u8] = b"AutoCAD Binary DXF";
/// Metres of the units 1 to 24 of `$INSUNITS`; 0: not a length that a stage has.
const UNITS_M: [f64; 24] = [
    0.0254,
    0.3048,
    1609.344,
    0.001,
    0.01,
    1.0,
    1000.0,
    2.54e-8,
    2.54e-5,
    0.9144,
    1e-10,
    1e-9,
    1e-6,
    0.1,
    10.0,
    100.0,
    1e9,
    0.0,
    0.0,
    0.0,
    1200.0 / 3937.0,
    100.0 / 3937.0,
    3600.0 / 3937.0,
    0.0,
];
/// Most entities that are joined to one path.
const MAX_JOINED: usize = 5_000;

/// A group code and its value.
type Pair<'a> = (i32, &'a str);

/// An entity: its name, its groups, and the groups of its vertices.
struct Entity<'a> {
    kind: &'a str,
    groups: Vec<Pair<'a>>,
    vertices: Vec<Vec<Pair<'a>>>,
}

/// A drawn entity.
struct Curve<'a> {
    handle: &'a str,
    layer: &'a str,
    pieces: Vec<Piece>,
    is_closed: bool,
}

impl Curve<'_> {
    /// Where it begins and ends.
    fn ends(&self) -> [DVec2; 2] {
        [self.pieces[0].begin(), self.pieces[self.pieces.len() - 1].end()]
    }
}

/// The path of a file: an entity, all entities of a layer, or all of the file, joined end to end. A unit is that of the header.
pub(super) fn path(bytes: &[u8], choice: &PathChoice<'_>) -> Result<Drawing, DrawingFileError> {
    if bytes.starts_with(BINARY) {
        return Err(DrawingFileError("is a binary DXF file, must be in text form".to_owned()));
    }
    let text = String::from_utf8_lossy(bytes);
    let pairs = pairs(&text)?;
    let entities = entities(&pairs);
    if entities.is_empty() {
        let reason = if pairs.is_empty() { "is empty" } else { "has no path: it has no entities" };
        return Err(DrawingFileError(reason.to_owned()));
    }
    let metres_per_unit = choice.metres_per_unit.or_else(|| header_unit_m(&pairs)).ok_or_else(|| {
        DrawingFileError("has no unit of length in its header ($INSUNITS): set metres_per_unit".to_owned())
    })?;
    let scale = DAffine2::from_scale(DVec2::splat(metres_per_unit));
    let mut curves = vec![];
    for entity in &entities {
        if let Some(mut curve) = curve(entity)?.filter(|curve| !curve.pieces.is_empty()) {
            curve.pieces = curve.pieces.iter().flat_map(|piece| piece.mapped(&scale)).collect();
            curves.push(curve);
        }
    }
    join(choose(curves, choice.id)?, choice.gap_m)
}

/// The pairs of a file.
fn pairs(text: &str) -> Result<Vec<Pair<'_>>, DrawingFileError> {
    let mut lines = text.trim_start_matches('\u{feff}').lines();
    let (mut pairs, mut number) = (vec![], 1);
    while let Some(line) = lines.next() {
        let Ok(code) = line.trim().parse() else {
            let shown = quoted(line.trim());
            return Err(DrawingFileError(format!("line {number} is {shown}, must be a group code of a DXF file")));
        };
        let Some(value) = lines.next() else { break };
        pairs.push((code, value.trim()));
        number += 2;
    }
    Ok(pairs)
}

/// The unit of length in the header, in metres.
fn header_unit_m(pairs: &[Pair<'_>]) -> Option<f64> {
    let at = pairs.iter().position(|&pair| pair == (9, "$INSUNITS"))?;
    let unit: usize = pairs.get(at + 1)?.1.parse().ok()?;
    UNITS_M.get(unit.checked_sub(1)?).copied().filter(|&unit_m| unit_m > 0.0)
}

/// The entities of the model, without those in blocks.
fn entities<'a>(pairs: &[Pair<'a>]) -> Vec<Entity<'a>> {
    let begin = pairs.windows(2).position(|pair| pair == [(0, "SECTION"), (2, "ENTITIES")]);
    let mut entities: Vec<Entity<'a>> = vec![];
    for &(code, value) in begin.map_or(&[][..], |begin| &pairs[begin + 2..]) {
        match (code, value) {
            (0, "ENDSEC") => break,
            (0, "VERTEX") if !entities.is_empty() => entities.last_mut().expect("an entity").vertices.push(vec![]),
            (0, kind) => entities.push(Entity { kind, groups: vec![], vertices: vec![] }),
            _ => {
                if let Some(entity) = entities.last_mut() {
                    entity.vertices.last_mut().unwrap_or(&mut entity.groups).push((code, value));
                }
            }
        }
    }
    entities
}

impl<'a> Entity<'a> {
    fn text(&self, code: i32) -> Option<&'a str> {
        self.groups.iter().find(|group| group.0 == code).map(|group| group.1)
    }

    /// The number of a group; `None` without one.
    fn number(&self, code: i32) -> Result<Option<f64>, DrawingFileError> {
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
    fn point(&self, code: i32) -> Result<DVec2, DrawingFileError> {
        Ok(DVec2::new(self.required(code)?, self.required(code + 10)?))
    }

    fn points(&self, code: i32) -> Result<Vec<DVec2>, DrawingFileError> {
        let (x, y) = (self.numbers(code)?, self.numbers(code + 10)?);
        Ok(x.into_iter().zip(y).map(DVec2::from).collect())
    }

    fn parsed(&self, code: i32, value: &str) -> Result<f64, DrawingFileError> {
        let number = value.parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| self.fault(&format!("has {} in group {code}, must be a number", quoted(value))))
    }

    fn fault(&self, reason: &str) -> DrawingFileError {
        let handle = self.text(5).map_or(String::new(), |handle| format!(" {}", quoted(handle)));
        DrawingFileError(format!("the {}{handle} {reason}", quoted(self.kind)))
    }

    /// Whether the plane of the entity is seen from below: its x is then −x.
    fn is_mirrored(&self) -> Result<bool, DrawingFileError> {
        let normal = DVec3::new(
            self.number(210)?.unwrap_or(0.0),
            self.number(220)?.unwrap_or(0.0),
            self.number(230)?.unwrap_or(1.0),
        );
        let is_flat = normal.truncate().length() <= 1e-9 * normal.z.abs();
        if is_flat { Ok(normal.z < 0.0) } else { Err(self.fault("does not lie in a horizontal plane")) }
    }
}

/// The curve of an entity; `None` for one that is no curve, such as a text.
fn curve<'a>(entity: &Entity<'a>) -> Result<Option<Curve<'a>>, DrawingFileError> {
    let is_on_paper = entity.text(67) == Some("1");
    let (pieces, is_closed) = match entity.kind {
        _ if is_on_paper => return Ok(None),
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
        "SPLINE" => spline(entity)?,
        _ => return Ok(None),
    };
    if pieces.len() > MAX_PIECES {
        return Err(entity.fault(&format!("has {} parts, at most {MAX_PIECES} are allowed", pieces.len())));
    }
    // Entities other than lines, ellipses and splines are in their own plane.
    let in_plane = ["ARC", "CIRCLE", "LWPOLYLINE", "POLYLINE"].contains(&entity.kind);
    let mirrored = DAffine2::from_scale(DVec2::new(-1.0, 1.0));
    let pieces = if in_plane && entity.is_mirrored()? {
        pieces.iter().flat_map(|piece| piece.mapped(&mirrored)).collect()
    } else {
        pieces
    };
    let (handle, layer) = (entity.text(5).unwrap_or_default(), entity.text(8).unwrap_or_default());
    Ok(Some(Curve { handle, layer, pieces, is_closed }))
}

fn arc(entity: &Entity<'_>, from_angle: f64, turn: f64) -> Result<Piece, DrawingFileError> {
    let (centre, radius_m) = (entity.point(10)?, entity.required(40)?);
    if radius_m > 0.0 {
        Ok(Piece::Arc { centre, radius_m, from_angle, turn })
    } else {
        Err(entity.fault(&format!("has the radius {radius_m}, must be above 0")))
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
    for &(code, value) in &entity.groups {
        match (code, points.last_mut()) {
            (10, _) => points.push((DVec2::new(entity.parsed(code, value)?, 0.0), 0.0)),
            (20, Some(last)) => last.0.y = entity.parsed(code, value)?,
            (42, Some(last)) => last.1 = entity.parsed(code, value)?,
            _ => {}
        }
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

/// The entities with a handle or on a layer; without a name, all.
fn choose<'a>(curves: Vec<Curve<'a>>, id: Option<&str>) -> Result<Vec<Curve<'a>>, DrawingFileError> {
    let Some(id) = id else {
        return if curves.is_empty() { Err(DrawingFileError("has no path".to_owned())) } else { Ok(curves) };
    };
    let names = layers(&curves);
    if let Some(only) = curves.iter().position(|curve| curve.handle.eq_ignore_ascii_case(id)) {
        return Ok(curves.into_iter().skip(only).take(1).collect());
    }
    let chosen: Vec<Curve<'a>> = curves.into_iter().filter(|curve| curve.layer.eq_ignore_ascii_case(id)).collect();
    if chosen.is_empty() {
        let quoted = quoted(id);
        return Err(DrawingFileError(format!("has no path with the handle or on the layer {quoted}; layers: {names}")));
    }
    Ok(chosen)
}

/// The layers of curves, for a message.
fn layers(curves: &[Curve<'_>]) -> String {
    let mut layers: Vec<&str> = curves.iter().map(|curve| curve.layer).collect();
    layers.sort_unstable();
    layers.dedup();
    listed(layers.into_iter())
}

/// Joins curves end to end. The path begins where the first curve has a free end, or with the first curve.
fn join(mut curves: Vec<Curve<'_>>, gap_m: f64) -> Result<Drawing, DrawingFileError> {
    if let [only] = &mut curves[..] {
        return Ok(Drawing { pieces: std::mem::take(&mut only.pieces), is_closed: only.is_closed });
    }
    let count = curves.len();
    if count > MAX_JOINED {
        return Err(DrawingFileError(format!("has {count} entities, at most {MAX_JOINED} can be one path: set id")));
    }
    let order = order_of(&curves, gap_m).map_err(|reason| {
        let layers = layers(&curves);
        DrawingFileError(format!(
            "has {count} entities that do not join to one path: {reason}; join them, or set id to a handle or a layer; \
             layers: {layers}"
        ))
    })?;
    let mut pieces: Vec<Piece> = vec![];
    for &(number, is_reversed) in &order {
        let own = std::mem::take(&mut curves[number].pieces);
        if is_reversed {
            pieces.extend(own.iter().rev().map(Piece::reversed));
        } else {
            pieces.extend(own);
        }
    }
    let is_closed = pieces[0].begin().distance(pieces[pieces.len() - 1].end()) <= gap_m;
    Ok(Drawing { pieces, is_closed })
}

/// The order of curves in a path, and which are reversed; otherwise the reason why they are no path, in words.
fn order_of(curves: &[Curve<'_>], gap_m: f64) -> Result<Vec<(usize, bool)>, String> {
    if let Some(closed) = curves.iter().find(|curve| curve.is_closed) {
        return Err(format!("the one at {} is closed", place(closed.ends()[0])));
    }
    order(&curves.iter().map(Curve::ends).collect::<Vec<_>>(), gap_m)
}
