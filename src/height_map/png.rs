//! Grey images with 16 bits a pixel, as terrain programs write them. Unit, position and scale are in the configuration.

use std::io::Cursor;

use png::{BitDepth, ColorType, Decoder, DecodingError, Limits};

use super::{FileGrid, HeightMapError, Placing, flip_rows, require_size};

/// Most bytes that the decoder keeps, beside the image.
const MAX_BYTES: usize = 64 << 20;

/// The heights of a file: its samples, at the centres of pixels.
pub(super) fn grid(bytes: &[u8], placing: &Placing) -> Result<FileGrid, HeightMapError> {
    if placing.metres_per_unit.is_none() {
        return Err(HeightMapError("metres_per_unit is missing: a .png has heights without a unit".to_owned()));
    }
    let Some(spacing_m) = placing.metres_per_pixel else {
        return Err(HeightMapError("metres_per_pixel is missing: a .png has no distance of its pixels".to_owned()));
    };
    let decoder = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: MAX_BYTES });
    let mut reader = decoder.read_info().map_err(|error| invalid(&error))?;
    let info = reader.info();
    if info.color_type != ColorType::Grayscale || info.bit_depth != BitDepth::Sixteen {
        let found = format!("{:?} with {} bits", info.color_type, info.bit_depth as u8);
        return Err(HeightMapError(format!("has pixels of {found}, must be Grayscale with 16 bits")));
    }
    if info.trns.is_some() {
        return Err(HeightMapError("has transparent pixels, must have none".to_owned()));
    }
    require_size(info.width.into(), info.height.into())?;
    let [columns, rows] = [info.width as usize, info.height as usize];
    let mut pixels = vec![0; 2 * columns * rows];
    reader.next_frame(&mut pixels).map_err(|error| invalid(&error))?;
    reader.finish().map_err(|error| invalid(&error))?;
    let (samples, _) = pixels.as_chunks();
    let mut heights: Vec<f64> = samples.iter().map(|&sample| u16::from_be_bytes(sample).into()).collect();
    flip_rows(&mut heights, columns);
    let first_m = [0.5 * spacing_m; 2];
    Ok(FileGrid { columns, rows, first_m, spacing_m: [spacing_m; 2], heights })
}

fn invalid(error: &DecodingError) -> HeightMapError {
    HeightMapError(format!("is not a valid PNG file: {}", error.to_string().replace('\n', " ")))
}

#[cfg(test)]
mod tests {
    use png::Encoder;

    use super::*;

    const PLACING: Placing = Placing { metres_per_unit: Some(0.25), x_m: None, y_m: None, metres_per_pixel: Some(2.0) };

    fn file(color: ColorType, depth: BitDepth, width: u32, height: u32, pixels: &[u8]) -> Vec<u8> {
        let mut bytes = vec![];
        let mut encoder = Encoder::new(&mut bytes, width, height);
        encoder.set_color(color);
        encoder.set_depth(depth);
        encoder.write_header().expect("a header").write_image_data(pixels).expect("pixels");
        bytes
    }

    #[test]
    fn samples_are_at_the_centres_of_pixels_from_the_lower_left_corner() {
        let pixels = [3, 4, 5, 0, 1, 40_000].map(u16::to_be_bytes).concat();
        let bytes = file(ColorType::Grayscale, BitDepth::Sixteen, 3, 2, &pixels);
        let grid = grid(&bytes, &PLACING).expect("a grid").placed(&PLACING).expect("a grid");
        assert_eq!([grid.columns, grid.rows], [3, 2]);
        assert_eq!([grid.x_m, grid.y_m, grid.spacing_x_m, grid.spacing_y_m], [1.0, 1.0, 2.0, 2.0]);
        assert_eq!(grid.heights_m, [0.0, 0.25, 10_000.0, 0.75, 1.0, 1.25]);
    }

    #[test]
    fn other_images_and_missing_keys_are_refused_in_one_line() {
        let grey = file(ColorType::Grayscale, BitDepth::Sixteen, 2, 2, &[0; 8]);
        let eight_bits = file(ColorType::Grayscale, BitDepth::Eight, 2, 2, &[0; 4]);
        let colours = file(ColorType::Rgb, BitDepth::Sixteen, 1, 1, &[0; 6]);
        let narrow = file(ColorType::Grayscale, BitDepth::Sixteen, 1, 2, &[0; 4]);
        let no_unit = Placing { metres_per_unit: None, ..PLACING };
        let no_spacing = Placing { metres_per_pixel: None, ..PLACING };
        for (bytes, placing, reason) in [
            (&grey[..], no_unit, "metres_per_unit is missing: a .png has heights without a unit"),
            (&grey, no_spacing, "metres_per_pixel is missing: a .png has no distance of its pixels"),
            (&eight_bits, PLACING, "has pixels of Grayscale with 8 bits, must be Grayscale with 16 bits"),
            (&colours, PLACING, "has pixels of Rgb with 16 bits, must be Grayscale with 16 bits"),
            (&narrow, PLACING, "has 1 × 2 heights, must have at least 2 × 2"),
            (b"GIF", PLACING, "is not a valid PNG file: "),
        ] {
            let error = grid(bytes, &placing).err().map(|error| error.to_string()).expect(reason);
            assert!(error.starts_with(reason), "{error}");
        }
    }
}
