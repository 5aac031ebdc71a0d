//! A drawing of any bytes. The first byte selects the format and whether corners are rounded.

use bench_dragon::drawing::{DrawingFormat, PathChoice, parse};
use bench_dragon_geometry::drawing::FitSettings;

/// Formats by the first byte.
const FORMATS: [DrawingFormat; 6] = [
    DrawingFormat::Svg,
    DrawingFormat::Dxf,
    DrawingFormat::Csv,
    DrawingFormat::Gpx,
    DrawingFormat::Kml,
    DrawingFormat::GeoJson,
];
const TOLERANCE_M: f64 = 0.005;
/// Most pieces of a drawing that is followed here: more take long.
const MAX_PIECES: usize = 200;

/// Reads a drawing, and follows it.
pub(crate) fn check(input: &[u8]) {
    let Some((&first, bytes)) = input.split_first() else { return };
    let format = FORMATS[usize::from(first % 64) % FORMATS.len()];
    let is_plane = matches!(format, DrawingFormat::Svg | DrawingFormat::Dxf | DrawingFormat::Csv);
    let metres_per_unit = is_plane.then_some(0.1);
    let choice = PathChoice { metres_per_unit, gap_m: 0.1 * TOLERANCE_M, ..PathChoice::default() };
    let drawing = match parse(bytes, format, &choice) {
        Ok(drawing) if drawing.pieces.len() <= MAX_PIECES => drawing,
        Ok(_) => return,
        Err(error) => return assert_one_line(&error.to_string()),
    };
    let corner_radius_m = (first >= 128).then_some(0.5);
    let joins_samples = (!is_plane || format == DrawingFormat::Csv) && corner_radius_m.is_none();
    match drawing.fit(&FitSettings { tolerance_m: TOLERANCE_M, corner_radius_m, joins_samples }) {
        Ok(fit) => assert!(fit.error_m <= TOLERANCE_M && !fit.segments.is_empty(), "{fit:?}"),
        Err(error) => assert_one_line(&error.to_string()),
    }
}

fn assert_one_line(error: &str) {
    assert!(!error.is_empty() && error.lines().count() == 1, "{error:?}");
}
