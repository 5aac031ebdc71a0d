//! Drawings as Portable Network Graphics, at the resolution of print.

use png::{BitDepth, ColorType, Compression, Encoder, PixelDimensions, Unit};
use tiny_skia::{
    FillRule, LineJoin, Mask, Paint, PathBuilder, Pixmap, Rect as PixelRect, Stroke as PixelStroke, StrokeDash,
    Transform,
};

use super::drawing::Drawing;
use super::mark::{Mark, Stroke};
use super::palette::Colour;
use super::path::{Path, Rect, Step};

/// Dots per millimetre: 300 to the inch, what printers ask for.
const DOTS_PER_MM: f64 = 300.0 / 25.4;

/// The drawing as a PNG file that knows its size in print.
pub(super) fn file(drawing: &Drawing) -> Vec<u8> {
    let [width, height] = [drawing.size().x, drawing.size().y].map(|length| (length * DOTS_PER_MM).round() as u32);
    let mut pixels = Pixmap::new(width, height).expect("a page has a size");
    pixels.fill(tiny_skia::Color::WHITE);
    let mut masks: Vec<(Rect, Mask)> = Vec::new();
    for mark in drawing.marks() {
        let mask = mark.clip.map(|clip| mask_of(&mut masks, clip, width, height));
        draw(&mut pixels, mark, mask);
    }
    encode(&pixels)
}

/// The mask of an area, made once.
fn mask_of(masks: &mut Vec<(Rect, Mask)>, clip: Rect, width: u32, height: u32) -> &Mask {
    let index = masks.iter().position(|(known, _)| *known == clip).unwrap_or_else(|| {
        let mut mask = Mask::new(width, height).expect("a page has a size");
        let [min, max] = [clip.min, clip.max].map(|corner| (corner * DOTS_PER_MM).as_vec2());
        let area = PixelRect::from_ltrb(min.x, min.y, max.x, max.y).expect("a plot has a size");
        mask.fill_path(&PathBuilder::from_rect(area), FillRule::Winding, true, Transform::identity());
        masks.push((clip, mask));
        masks.len() - 1
    });
    &masks[index].1
}

fn draw(pixels: &mut Pixmap, mark: &Mark, mask: Option<&Mask>) {
    // A path of one point, or of none, shows nothing.
    let Some(path) = pixel_path(&mark.path) else { return };
    if let Some(colour) = mark.fill {
        pixels.fill_path(&path, &paint(colour), FillRule::Winding, Transform::identity(), mask);
    }
    if let Some(Stroke { colour, width, style }) = mark.stroke {
        let lengths = style.lengths().iter().map(|length| length * DOTS_PER_MM as f32).collect();
        let stroke = PixelStroke {
            width: (width * DOTS_PER_MM) as f32,
            line_join: LineJoin::Round,
            dash: StrokeDash::new(lengths, 0.0),
            ..PixelStroke::default()
        };
        pixels.stroke_path(&path, &paint(colour), &stroke, Transform::identity(), mask);
    }
}

fn pixel_path(path: &Path) -> Option<tiny_skia::Path> {
    let mut builder = PathBuilder::new();
    for step in &path.map(|point| point * DOTS_PER_MM).steps {
        match step {
            Step::Move(end) => builder.move_to(end.x as f32, end.y as f32),
            Step::Line(end) => builder.line_to(end.x as f32, end.y as f32),
            Step::Curve(control, end) => {
                builder.quad_to(control.x as f32, control.y as f32, end.x as f32, end.y as f32);
            }
            Step::Close => builder.close(),
        }
    }
    builder.finish()
}

fn paint(Colour { red, green, blue }: Colour) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(red, green, blue, u8::MAX);
    paint
}

fn encode(pixels: &Pixmap) -> Vec<u8> {
    let colours: Vec<u8> =
        pixels.pixels().iter().flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]).collect();
    let per_metre = (DOTS_PER_MM * 1000.0).round() as u32;
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, pixels.width(), pixels.height());
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::High);
    encoder.set_pixel_dims(Some(PixelDimensions { xppu: per_metre, yppu: per_metre, unit: Unit::Meter }));
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&colours));
    written.expect("the pixels fill the image, and memory takes all bytes");
    bytes
}
