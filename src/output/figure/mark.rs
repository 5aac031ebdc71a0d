//! Marks: what a drawing is made of.

use super::palette::Colour;
use super::path::{Path, Rect};

/// A path that is filled, stroked or both.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mark {
    pub(super) path: Path,
    pub(super) fill: Option<Colour>,
    pub(super) stroke: Option<Stroke>,
    /// What lies outside is not drawn.
    pub(super) clip: Option<Rect>,
    /// The words that it shows, or what it stands for, to whoever cannot see it.
    pub(super) label: Option<String>,
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stroke {
    pub(super) colour: Colour,
    /// Millimetres.
    pub(super) width: f64,
    pub(super) style: LineStyle,
}

/// Dashes tell lines apart where colours cannot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum LineStyle {
    /// No gaps.
    #[default]
    Solid,
    /// Long dashes.
    Dashed,
    /// Dots.
    Dotted,
    /// A dash, a dot.
    DashDotted,
}

impl Mark {
    fn new(path: Path, fill: Option<Colour>, stroke: Option<Stroke>) -> Self {
        Self { path, fill, stroke, clip: None, label: None }
    }

    /// An area of one colour.
    pub(super) fn filled(path: Path, colour: Colour) -> Self {
        Self::new(path, Some(colour), None)
    }

    /// A line, its width in millimetres.
    pub(super) fn stroked(path: Path, colour: Colour, width: f64) -> Self {
        Self::new(path, None, Some(Stroke { colour, width, style: LineStyle::Solid }))
    }

    /// The mark with a line round it.
    pub(super) fn outlined(self, colour: Colour, width: f64) -> Self {
        Self { stroke: Some(Stroke { colour, width, style: LineStyle::Solid }), ..self }
    }

    /// The mark with its line in another style.
    pub(super) fn styled(mut self, style: LineStyle) -> Self {
        if let Some(stroke) = &mut self.stroke {
            stroke.style = style;
        }
        self
    }

    /// The mark, as far as it lies in the area.
    pub(super) fn clipped(self, area: Rect) -> Self {
        Self { clip: Some(area), ..self }
    }

    /// The mark with words for whoever cannot see it.
    pub(super) fn labelled(self, label: impl Into<String>) -> Self {
        Self { label: Some(label.into()), ..self }
    }
}

impl LineStyle {
    /// Lengths of dashes and gaps in millimetres, in turn; none for a line without gaps.
    pub(super) fn lengths(self) -> &'static [f32] {
        match self {
            Self::Solid => &[],
            Self::Dashed => &[2.0, 1.0],
            Self::Dotted => &[0.5, 0.7],
            Self::DashDotted => &[2.0, 0.8, 0.5, 0.8],
        }
    }
}
