//! Drawings as Portable Network Graphics, at the resolution of print.

use kurbo::{Affine, BezPath, PathEl, Rect};
use png::{BitDepth, ColorType, Compression, Encoder, PixelDimensions, Unit};
use tiny_skia::{
    FillRule, LineJoin, Mask, Paint, PathBuilder, Pixmap, Rect as PixelRect, Stroke as PixelStroke, StrokeDash,
    Transform,
};

use super::drawing::{Drawing, Mark, Stroke};
use super::style::Colour;

/// Dots per millimetre of paper: 300 per inch, the usual demand of printers.
const DOTS_PER_MM: f64 = 300.0 / 25.4;
/// Greatest number of dots of an image. A dot takes 4 bytes, and one more for each plot of the figure. A sheet larger than A2
/// has fewer dots per inch: people view it from further away.
const MOST_DOTS: f64 = 36e6;

pub(super) fn file(drawing: &Drawing) -> Vec<u8> {
    let Drawing { sheet: area, scale, ref marks, .. } = *drawing;
    let paper = area.size() * scale;
    let dots_per_mm = DOTS_PER_MM.min((MOST_DOTS / paper.area()).sqrt());
    let [width, height] = [paper.width, paper.height].map(|length| (length * dots_per_mm).round() as u32);
    let mut canvas = Canvas {
        pixels: Pixmap::new(width, height).expect("a page has a size"),
        masks: Vec::new(),
        dots_per_mm: scale * dots_per_mm,
        to_dots: Affine::translate(-area.origin().to_vec2()).then_scale(scale * dots_per_mm),
    };
    canvas.pixels.fill(tiny_skia::Color::WHITE);
    for mark in marks {
        canvas.draw(mark);
    }
    encode(&canvas.pixels, dots_per_mm)
}

/// Pixels, and the transform from a drawing to them.
struct Canvas {
    pixels: Pixmap,
    /// Clip areas and their masks, each mask made once.
    masks: Vec<(Rect, Mask)>,
    /// Dots per millimetre of the drawing.
    dots_per_mm: f64,
    /// Transform from the drawing to the pixels.
    to_dots: Affine,
}

impl Canvas {
    /// Index of the mask of an area.
    fn mask_of(&mut self, clip: Rect) -> usize {
        self.masks.iter().position(|(known, _)| *known == clip).unwrap_or_else(|| {
            let mut mask = Mask::new(self.pixels.width(), self.pixels.height()).expect("a page has a size");
            let Rect { x0, y0, x1, y1 } = self.to_dots.transform_rect_bbox(clip);
            let area = PixelRect::from_ltrb(x0 as f32, y0 as f32, x1 as f32, y1 as f32).expect("a plot has a size");
            mask.fill_path(&PathBuilder::from_rect(area), FillRule::Winding, true, Transform::identity());
            self.masks.push((clip, mask));
            self.masks.len() - 1
        })
    }

    fn draw(&mut self, mark: &Mark) {
        // A path with fewer than two points is invisible.
        let Some(path) = pixel_path(&(self.to_dots * &mark.path)) else { return };
        let mask = mark.clip.map(|clip| self.mask_of(clip));
        let mask = mask.map(|mask| &self.masks[mask].1);
        if let Some(colour) = mark.fill {
            self.pixels.fill_path(&path, &paint(colour), FillRule::Winding, Transform::identity(), mask);
        }
        if let Some(Stroke { colour, width, style }) = mark.stroke {
            let lengths = style.lengths().iter().map(|length| length * self.dots_per_mm as f32).collect();
            let stroke = PixelStroke {
                width: (width * self.dots_per_mm) as f32,
                line_join: LineJoin::Round,
                dash: StrokeDash::new(lengths, 0.0),
                ..PixelStroke::default()
            };
            self.pixels.stroke_path(&path, &paint(colour), &stroke, Transform::identity(), mask);
        }
    }
}

fn pixel_path(path: &BezPath) -> Option<tiny_skia::Path> {
    let mut builder = PathBuilder::new();
    for element in path.elements() {
        match *element {
            PathEl::MoveTo(end) => builder.move_to(end.x as f32, end.y as f32),
            PathEl::LineTo(end) => builder.line_to(end.x as f32, end.y as f32),
            PathEl::QuadTo(a, b) => builder.quad_to(a.x as f32, a.y as f32, b.x as f32, b.y as f32),
            PathEl::CurveTo(a, b, c) => {
                builder.cubic_to(a.x as f32, a.y as f32, b.x as f32, b.y as f32, c.x as f32, c.y as f32);
            }
            PathEl::ClosePath => builder.close(),
        }
    }
    builder.finish()
}

fn paint(Colour([red, green, blue]): Colour) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(red, green, blue, u8::MAX);
    paint
}

fn encode(pixels: &Pixmap, dots_per_mm: f64) -> Vec<u8> {
    let colours: Vec<u8> =
        pixels.pixels().iter().flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]).collect();
    let per_metre = (dots_per_mm * 1000.0).round() as u32;
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, pixels.width(), pixels.height());
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::High);
    encoder.set_pixel_dims(Some(PixelDimensions { xppu: per_metre, yppu: per_metre, unit: Unit::Meter }));
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&colours));
    written.expect("the pixels fill the image, and a Vec takes all bytes");
    bytes
}
