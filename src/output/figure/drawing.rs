//! A drawing: marks on a page, or on a sheet of paper.

use std::f64::consts::PI;
use std::str::FromStr;

use kurbo::{BezPath, Point, Rect, Size, Vec2};

use super::style::{BLACK, Colour, LineStyle};
use super::text::Text;
use super::{FigureFormat, pdf, png, svg};

/// A finished figure: marks on a white page. Later marks cover earlier ones. Lengths are millimetres, y is down.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    pub(super) title: String,
    size: Size,
    /// The sheet of paper, in millimetres of the drawing.
    pub(super) sheet: Rect,
    /// Magnification of the drawing on paper.
    pub(super) scale: f64,
    pub(super) marks: Vec<Mark>,
}

/// A path that is filled, stroked or both.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mark {
    pub(super) path: BezPath,
    pub(super) fill: Option<Colour>,
    pub(super) stroke: Option<Stroke>,
    /// Area outside which the mark is not drawn.
    pub(super) clip: Option<Rect>,
    /// Words or meaning of the mark, for people who cannot see it.
    pub(super) label: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stroke {
    pub(super) colour: Colour,
    pub(super) width: f64,
    pub(super) style: LineStyle,
}

/// A size of paper on which a figure fills the sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paper {
    /// Name on the command line.
    pub name: &'static str,
    /// Width and height of an upright sheet in millimetres.
    pub size_mm: [f64; 2],
}

/// Free room at each edge of a sheet, on which printers cannot print.
const EDGE: f64 = 10.0;

const INCH: f64 = 25.4;

impl Drawing {
    pub(super) fn new(title: String, size: Size) -> Self {
        Self { title, size, sheet: size.to_rect(), scale: 1.0, marks: Vec::new() }
    }

    /// Puts the drawing on a sheet of paper, upright or across, as large as it fits.
    #[must_use]
    pub fn on_paper(self, paper: Paper) -> Self {
        let fit = |sheet: Size| {
            ((sheet.width - 2.0 * EDGE) / self.size.width).min((sheet.height - 2.0 * EDGE) / self.size.height)
        };
        let [width, height] = paper.size_mm;
        let [upright, across] = [Size::new(width, height), Size::new(height, width)];
        let sheet = if fit(across) > fit(upright) { across } else { upright };
        let scale = fit(sheet);
        let free = sheet / scale - self.size;
        let sheet = self.size.to_rect().inflate(0.5 * free.width, 0.5 * free.height);
        Self { sheet, scale, ..self }
    }

    /// The bytes of a file. Equal drawings give equal bytes.
    pub fn encode(&self, format: FigureFormat) -> Vec<u8> {
        match format {
            FigureFormat::Svg => svg::document(self).into_bytes(),
            FigureFormat::Pdf => pdf::document(&[self]),
            FigureFormat::Png => png::file(self),
        }
    }

    /// Adds a mark over all others, unless it is invisible.
    pub(super) fn push(&mut self, mark: Mark) {
        if mark.clip.is_none_or(|clip| !mark.path.elements().is_empty() && clip.overlaps(mark.path.control_box())) {
            self.marks.push(mark);
        }
    }

    pub(super) fn write(&mut self, text: &Text, at: Point) {
        self.push(Mark::filled(text.outline(at), BLACK).labelled(text.words.as_str()));
    }
}

impl Mark {
    fn new(path: BezPath, fill: Option<Colour>, stroke: Option<Stroke>) -> Self {
        Self { path, fill, stroke, clip: None, label: None }
    }

    /// A filled area.
    pub(super) fn filled(path: BezPath, colour: Colour) -> Self {
        Self::new(path, Some(colour), None)
    }

    /// A line with a width in millimetres.
    pub(super) fn stroked(path: BezPath, colour: Colour, width: f64) -> Self {
        Self::new(path, None, Some(Stroke { colour, width, style: LineStyle::Solid }))
    }

    /// Adds an outline to the mark.
    pub(super) fn outlined(self, colour: Colour, width: f64) -> Self {
        Self { stroke: Some(Stroke { colour, width, style: LineStyle::Solid }), ..self }
    }

    /// Changes the style of the mark's line.
    pub(super) fn styled(mut self, style: LineStyle) -> Self {
        if let Some(stroke) = &mut self.stroke {
            stroke.style = style;
        }
        self
    }

    /// Clips the mark to an area.
    pub(super) fn clipped(self, area: Rect) -> Self {
        Self { clip: Some(area), ..self }
    }

    /// Adds words for people who cannot see the mark.
    pub(super) fn labelled(self, label: impl Into<String>) -> Self {
        Self { label: Some(label.into()), ..self }
    }
}

impl Paper {
    /// A poster that most copy shops print.
    pub const A3: Self = Self { name: "a3", size_mm: [297.0, 420.0] };
    /// All sizes.
    pub const ALL: [Self; 7] = [
        Self { name: "a0", size_mm: [841.0, 1189.0] },
        Self { name: "a1", size_mm: [594.0, 841.0] },
        Self { name: "a2", size_mm: [420.0, 594.0] },
        Self::A3,
        Self { name: "a4", size_mm: [210.0, 297.0] },
        Self { name: "letter", size_mm: [8.5 * INCH, 11.0 * INCH] },
        Self { name: "tabloid", size_mm: [11.0 * INCH, 17.0 * INCH] },
    ];
}

/// Parses a name, in upper or lower case.
impl FromStr for Paper {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|paper| paper.name.eq_ignore_ascii_case(text));
        found.ok_or_else(|| format!("must be one of {}", Self::ALL.map(|paper| paper.name).join(", ")))
    }
}

/// A PDF file with a page for each drawing. Equal drawings give equal bytes.
pub fn pages_of(drawings: &[Drawing]) -> Vec<u8> {
    pdf::document(&drawings.iter().collect::<Vec<_>>())
}

/// Straight lines from point to point.
pub(super) fn polyline(points: impl IntoIterator<Item = Point>) -> BezPath {
    let mut path = BezPath::new();
    for point in points {
        if path.elements().is_empty() { path.move_to(point) } else { path.line_to(point) }
    }
    path
}

/// Straight lines around an area.
pub(super) fn polygon(points: impl IntoIterator<Item = Point>) -> BezPath {
    let mut path = polyline(points);
    if !path.elements().is_empty() {
        path.close_path();
    }
    path
}

/// A circle made of parabolas, with a largest error of 0.2 ‰ of the radius.
pub(super) fn circle(centre: Point, radius: f64) -> BezPath {
    const PIECES: u32 = 16;
    let half_piece = PI / f64::from(PIECES);
    let on = |halves: u32, radius: f64| centre + radius * Vec2::from_angle(f64::from(halves) * half_piece);
    let mut path = BezPath::new();
    path.move_to(on(0, radius));
    for piece in 0..PIECES {
        // The control point lies outside the circle, where the tangents at both ends meet.
        path.quad_to(on(2 * piece + 1, radius / half_piece.cos()), on(2 * piece + 2, radius));
    }
    path.close_path();
    path
}

/// Whether a point lies in a rectangle or on its edge.
pub(super) fn contains(area: Rect, point: Point) -> bool {
    area.contains_rect(Rect::from_points(point, point))
}

#[cfg(test)]
mod tests {
    use kurbo::{ParamCurve as _, PathSeg};

    use super::*;

    #[test]
    fn circle_is_round_to_a_fifth_of_a_thousandth() {
        for piece in circle(Point::ZERO, 1.0).segments().filter(|piece| matches!(piece, PathSeg::Quad(_))) {
            for tenth in 0..=10 {
                let point = piece.eval(f64::from(tenth) / 10.0).to_vec2();
                assert!((point.length() - 1.0).abs() < 2e-4, "{point} lies {} from the centre", point.length());
            }
        }
    }
}
