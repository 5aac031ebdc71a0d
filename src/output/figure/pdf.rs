//! Drawings as Portable Document Format (PDF 1.4, ISO 32000-1), a page for each.

use std::fmt::Write as _;

use kurbo::{BezPath, PathEl, Point, QuadBez, Rect, Shape as _};

use super::drawing::{Drawing, Mark, Stroke};
use super::style::Colour;

/// Points of PDF, 72 to the inch, in a millimetre.
const POINTS_PER_MM: f64 = 72.0 / 25.4;

/// Returns a document with a page for each drawing. Letters are outlines, so it has no fonts.
pub(super) fn document(drawings: &[&Drawing]) -> Vec<u8> {
    let pages: Vec<usize> = (0..drawings.len()).map(|page| FIRST_PAGE + 2 * page).collect();
    let kids: Vec<String> = pages.iter().map(|page| format!("{page} 0 R")).collect();
    let title = drawings.first().map_or("", |drawing| &drawing.title);
    let mut objects = vec![
        "<< /Type /Catalog /Pages 2 0 R >>".to_owned(),
        format!("<< /Type /Pages /Kids [{}] /Count {} >>", kids.join(" "), kids.len()),
        format!("<< /Title <{}> >>", utf_16(title)),
    ];
    for (drawing, page) in drawings.iter().zip(pages) {
        let [width, height] = [drawing.sheet.width(), drawing.sheet.height()].map(|mm| Number(mm * scale(drawing)));
        let contents = contents(drawing);
        objects.push(format!(
            "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width} {height}] /Resources << >> /Contents {} 0 R >>",
            page + 1
        ));
        objects.push(format!("<< /Length {} >>\nstream\n{contents}endstream", contents.len()));
    }
    let mut text = "%PDF-1.4\n".to_owned();
    let mut places = Vec::new();
    for (object, number) in objects.iter().zip(1..) {
        places.push(text.len());
        // Writing into a String cannot fail.
        let _ = write!(text, "{number} 0 obj\n{object}\nendobj\n");
    }
    let (table, count) = (text.len(), places.len() + 1);
    let _ = write!(text, "xref\n0 {count}\n0000000000 65535 f \n");
    for place in places {
        let _ = writeln!(text, "{place:010} 00000 n ");
    }
    let _ = write!(text, "trailer\n<< /Size {count} /Root 1 0 R /Info 3 0 R >>\nstartxref\n{table}\n%%EOF\n");
    text.into_bytes()
}

/// Number of the object of the first page.
const FIRST_PAGE: usize = 4;

/// Points of a page for a millimetre of the drawing.
fn scale(drawing: &Drawing) -> f64 {
    POINTS_PER_MM * drawing.scale
}

fn contents(drawing: &Drawing) -> String {
    let Drawing { sheet, marks, .. } = drawing;
    let points = scale(drawing);
    let [x, y, to, from] = [points, sheet.y1 * points, -points, -sheet.x0 * points].map(Number);
    // The origin of a page is its lower left corner.
    let mut text = format!("{x} 0 0 {to} {from} {y} cm 1 j\n");
    let mut clip: Option<Rect> = None;
    for mark in marks {
        if mark.clip != clip {
            if clip.is_some() {
                text.push_str("Q\n");
            }
            clip = mark.clip;
            if let Some(area) = clip {
                text.push_str("q ");
                draw_path(&mut text, &area.to_path(0.0));
                text.push_str("W n\n");
            }
        }
        draw(&mut text, mark);
    }
    if clip.is_some() {
        text.push_str("Q\n");
    }
    text
}

fn draw(text: &mut String, mark: &Mark) {
    if mark.path.elements().is_empty() {
        return;
    }
    // Writing into a String cannot fail.
    if let Some(fill) = mark.fill {
        let _ = write!(text, "{} rg ", colour(fill));
    }
    if let Some(Stroke { colour: line, width, style }) = mark.stroke {
        let lengths: Vec<String> = style.lengths().iter().map(f32::to_string).collect();
        let _ = write!(text, "{} RG {} w [{}] 0 d ", colour(line), Number(width), lengths.join(" "));
    }
    draw_path(text, &mark.path);
    text.push_str(match (mark.fill, mark.stroke) {
        (Some(_), Some(_)) => "B\n",
        (Some(_), None) => "f\n",
        (None, Some(_)) => "S\n",
        (None, None) => "n\n",
    });
}

fn colour(Colour(parts): Colour) -> String {
    parts.map(|part| Number(f64::from(part) / 255.0).to_string()).join(" ")
}

fn draw_path(text: &mut String, path: &BezPath) {
    let at = |Point { x, y }: Point| format!("{} {}", Number(x), Number(y));
    let mut last = Point::ZERO;
    for element in path.elements() {
        // Writing into a String cannot fail.
        let _ = match *element {
            PathEl::MoveTo(end) => write!(text, "{} m ", at(end)),
            PathEl::LineTo(end) => write!(text, "{} l ", at(end)),
            PathEl::QuadTo(control, end) => {
                let cubic = QuadBez::new(last, control, end).raise();
                write!(text, "{} {} {} c ", at(cubic.p1), at(cubic.p2), at(end))
            }
            PathEl::CurveTo(first, second, end) => write!(text, "{} {} {} c ", at(first), at(second), at(end)),
            PathEl::ClosePath => write!(text, "h "),
        };
        last = element.end_point().unwrap_or(last);
    }
}

/// Words in UTF-16 with its mark, in hexadecimal digits.
fn utf_16(words: &str) -> String {
    let units = std::iter::once(0xFEFF).chain(words.encode_utf16());
    units.fold(String::new(), |mut digits, unit| {
        // Writing into a String cannot fail.
        let _ = write!(digits, "{unit:04X}");
        digits
    })
}

/// A number with four decimals, without an exponent.
struct Number(f64);

impl std::fmt::Display for Number {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}", (self.0 * 1e4).round() / 1e4 + 0.0)
    }
}
