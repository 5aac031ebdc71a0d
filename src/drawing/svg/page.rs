//! The scale of a page.

use svgtypes::{Length, LengthUnit};

use super::super::{DrawingFileError, PathChoice, quoted};

/// Millimetres of a pixel of SVG.
const PIXEL_MM: f64 = 25.4 / 96.0;

/// Metres of a pixel: as wanted, by a scale of the page, or 1. `sizes` are the width and the height of the page.
pub(super) fn unit_m(sizes: &[Option<String>; 2], choice: &PathChoice<'_>) -> Result<f64, DrawingFileError> {
    let Some(scale) = choice.scale else { return Ok(choice.metres_per_unit.unwrap_or(1.0)) };
    // Programs disagree about the size of a pixel on paper, so the page must have a size on paper itself.
    for size in sizes.iter().flatten() {
        if !is_on_paper(size) {
            return Err(DrawingFileError(format!(
                "the page is {} wide or high, must be in mm, cm, in, pt or pc for a scale: set metres_per_unit instead",
                quoted(size)
            )));
        }
    }
    if sizes.iter().all(Option::is_none) {
        return Err(DrawingFileError("the page has no size for a scale: set metres_per_unit instead".to_owned()));
    }
    Ok(scale * PIXEL_MM / 1000.0)
}

fn is_on_paper(size: &str) -> bool {
    use LengthUnit::{Cm, In, Mm, Pc, Pt};
    size.parse::<Length>().is_ok_and(|length| matches!(length.unit, Cm | In | Mm | Pc | Pt) && length.number > 0.0)
}
