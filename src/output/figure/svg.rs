//! Drawings as Scalable Vector Graphics, in millimetres.

use std::fmt::Write as _;

use kurbo::{BezPath, PathEl, Point, Rect, Shape as _};

use super::drawing::{Drawing, Mark, Stroke};
use super::style::WHITE;

/// Returns the drawing as an SVG document without external references, also without fonts.
pub(super) fn document(drawing: &Drawing) -> String {
    let Drawing { title, sheet: area, scale, marks, .. } = drawing;
    let [width, height] = [area.width() * scale, area.height() * scale].map(Number);
    let [left, top, box_width, box_height] = [area.x0, area.y0, area.width(), area.height()].map(Number);
    let title = escaped(title);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" \
         viewBox=\"{left} {top} {box_width} {box_height}\" role=\"img\">\n<title>{title}</title>\n"
    );
    let page = Mark::filled(area.to_path(0.0), WHITE);
    let clips = clips(marks);
    // Writing into a String cannot fail.
    for (index, clip) in clips.iter().enumerate() {
        let _ =
            writeln!(text, "<clipPath id=\"clip{index}\"><path d=\"{}\"/></clipPath>", path_data(&clip.to_path(0.0)));
    }
    for mark in std::iter::once(&page).chain(marks) {
        let clip = mark.clip.and_then(|clip| clips.iter().position(|known| *known == clip));
        let _ = writeln!(text, "<path{} d=\"{}\"/>", attributes(mark, clip), path_data(&mark.path));
    }
    text.push_str("</svg>\n");
    text
}

/// The clip areas of the marks, each area once.
fn clips(marks: &[Mark]) -> Vec<Rect> {
    let mut clips = Vec::new();
    for clip in marks.iter().filter_map(|mark| mark.clip) {
        if !clips.contains(&clip) {
            clips.push(clip);
        }
    }
    clips
}

fn attributes(mark: &Mark, clip: Option<usize>) -> String {
    let mut text = match &mark.label {
        Some(label) => format!(" role=\"img\" aria-label=\"{}\"", escaped(label)),
        None => String::new(),
    };
    let fill = mark.fill.map_or("none".to_owned(), |colour| colour.to_string());
    // Writing into a String cannot fail.
    let _ = write!(text, " fill=\"{fill}\"");
    if let Some(Stroke { colour, width, style }) = mark.stroke {
        let width = Number(width);
        let _ = write!(text, " stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"");
        let lengths: Vec<String> = style.lengths().iter().map(f32::to_string).collect();
        if !lengths.is_empty() {
            let _ = write!(text, " stroke-dasharray=\"{}\"", lengths.join(" "));
        }
    }
    if let Some(clip) = clip {
        let _ = write!(text, " clip-path=\"url(#clip{clip})\"");
    }
    text
}

fn path_data(path: &BezPath) -> String {
    let at = |Point { x, y }: Point| format!("{} {}", Number(x), Number(y));
    let step = |element: &PathEl| match *element {
        PathEl::MoveTo(end) => format!("M{}", at(end)),
        PathEl::LineTo(end) => format!("L{}", at(end)),
        PathEl::QuadTo(control, end) => format!("Q{} {}", at(control), at(end)),
        PathEl::CurveTo(first, second, end) => format!("C{} {} {}", at(first), at(second), at(end)),
        PathEl::ClosePath => "Z".to_owned(),
    };
    path.elements().iter().map(step).collect()
}

fn escaped(words: &str) -> String {
    words.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A length in millimetres, printed to the micrometre. No printer resolves less.
struct Number(f64);

impl std::fmt::Display for Number {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}", (self.0 * 1000.0).round() / 1000.0 + 0.0)
    }
}
