//! The curves of a shape.

use std::f64::consts::TAU;

use bench_dragon_geometry::drawing::{Drawing, Piece};
use glam::{DAffine2, DVec2};
use roxmltree::Node;
use svgtypes::PointsParser;

use super::path_data::data;

/// The pieces of a shape in its own coordinates, and whether it is closed; otherwise a reason, in words.
pub(super) fn local(
    shape: Node<'_, '_>,
    path_data: &str,
    resolved: &usvg::tiny_skia_path::Path,
) -> Result<(Vec<Piece>, bool), String> {
    let polyline = |is_closed: bool| {
        let points: Vec<DVec2> =
            PointsParser::from(shape.attribute("points").unwrap_or_default()).map(DVec2::from).collect();
        (Drawing::polyline(&points, is_closed).pieces, is_closed)
    };
    let bounds = resolved.bounds();
    let [left, right, top, bottom] = [bounds.left(), bounds.right(), bounds.top(), bounds.bottom()].map(f64::from);
    let points: Vec<DVec2> = resolved.points().iter().map(|point| DVec2::new(point.x.into(), point.y.into())).collect();
    Ok(match shape.tag_name().name() {
        "path" => return data(path_data),
        "polyline" => polyline(false),
        "polygon" => polyline(true),
        "line" => (Drawing::polyline(&points, false).pieces, false),
        "rect" => {
            let corner = points[0] - DVec2::new(left, top);
            // The last line of a rounded rectangle ends ry under the top, before the curves of the last corner.
            let is_rounded = corner.x > 0.0;
            let ry = if is_rounded { rounded_ry(resolved, top) } else { 0.0 };
            (rectangle(DVec2::new(left, top), DVec2::new(right, bottom), DVec2::new(corner.x, ry)), true)
        }
        _ => {
            let (centre, radii) =
                (DVec2::new(left + right, top + bottom) / 2.0, DVec2::new(right - left, bottom - top) / 2.0);
            (ellipse(centre, radii, 0.0, 0.0, TAU), true)
        }
    })
}

/// The vertical radius of the corners of a rounded rectangle: where its last line ends.
fn rounded_ry(resolved: &usvg::tiny_skia_path::Path, top: f64) -> f64 {
    let lines = resolved.segments().filter_map(|segment| match segment {
        usvg::tiny_skia_path::PathSegment::LineTo(to) => Some(f64::from(to.y)),
        _ => None,
    });
    lines.last().map_or(0.0, |y| y - top)
}

/// A rectangle, clockwise on the screen from the end of its first corner.
fn rectangle(low: DVec2, high: DVec2, radii: DVec2) -> Vec<Piece> {
    let corners = [DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y), low];
    let inward = [DVec2::new(-1.0, 1.0), -DVec2::ONE, DVec2::new(1.0, -1.0), DVec2::ONE];
    let mut pieces: Vec<Piece> = vec![];
    let mut at = low + DVec2::new(radii.x, 0.0);
    for (i, (corner, inward)) in corners.into_iter().zip(inward).enumerate() {
        let along = if i % 2 == 0 { DVec2::X } else { DVec2::Y };
        pieces.push(Piece::Line { from: at, to: corner + inward * radii * along });
        if radii.x > 0.0 {
            let quarter = TAU / 4.0;
            pieces.extend(ellipse(corner + inward * radii, radii, 0.0, quarter * (i as f64 - 1.0), quarter));
        }
        at = corner + inward * radii * along.perp().abs();
    }
    pieces
}

/// An arc of an ellipse whose first axis has an angle from x, between two angles of its circle.
pub(super) fn ellipse(centre: DVec2, radii: DVec2, rotation: f64, from_angle: f64, turn: f64) -> Vec<Piece> {
    let map = DAffine2::from_scale_angle_translation(radii, rotation, centre);
    Piece::Arc { centre: DVec2::ZERO, radius_m: 1.0, from_angle, turn }.mapped(&map)
}
