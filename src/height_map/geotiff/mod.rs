//! GeoTIFF: TIFF images of one band with a position, a scale and units.
//!
//! Source: OGC GeoTIFF Standard 1.1 (OGC 19-008r4), and GDAL's tags for missing data, scale and offset. The crate
//! `tiff` reads tags and samples; the few tags of GeoTIFF are interpreted here. The crate `geotiff` is on an old
//! `tiff`, and has neither missing data nor units. Only the first image is read; the others may be overviews, which
//! have the same heights.

mod structure;
mod tags;
mod units;

use std::io::Cursor;

use bench_dragon_geometry::number::Number;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;

use super::{FileGrid, HeightMapError, MAX_HEIGHTS, Placing, flip_columns, flip_rows, quoted, require_size};

use structure::{SAMPLES, require_moderate_parts, require_no_mask, require_one_grey_band, require_tags_within};
use tags::{TiffFile, doubles, invalid, text};
pub(super) use units::METRE_NAMES;
use units::{geo_key, geo_keys, require_metres, require_unscaled_metres};

/// Most bytes of samples, of the values of a tag, and of a strip or tile.
const MAX_BYTES: usize = MAX_HEIGHTS * size_of::<f64>();

/// Where the samples are: the first one in the file, and the steps to the next column and the next row.
struct Georeference {
    first_m: [f64; 2],
    step_m: [f64; 2],
}

/// The heights of a file.
pub(super) fn grid(bytes: &[u8], placing: &Placing) -> Result<FileGrid, HeightMapError> {
    if bytes.starts_with(b"II") || bytes.starts_with(b"MM") {
        require_tags_within(bytes)?;
    }
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MAX_BYTES;
    limits.intermediate_buffer_size = MAX_BYTES;
    let mut file = Decoder::new(Cursor::new(bytes)).map_err(invalid)?.with_limits(limits);
    let (columns, rows) = file.dimensions().map_err(invalid)?;
    require_size(columns.into(), rows.into())?;
    let [columns, rows] = [columns as usize, rows as usize];
    require_one_grey_band(&mut file)?;
    require_moderate_parts(&mut file)?;
    require_no_mask(&mut file)?;
    let geo_keys = geo_keys(&mut file)?;
    let georeference = georeference(&mut file, geo_keys(geo_key::RASTER_TYPE) == Some(geo_key::RASTER_PIXEL_IS_POINT))?;
    let citation = text(&mut file, Tag::GeoAsciiParamsTag).ok().flatten().unwrap_or_default();
    require_metres(&geo_keys, &citation, placing)?;
    require_unscaled_metres(&mut file, placing)?;
    let mut heights = samples(&mut file)?;
    if heights.len() != columns * rows {
        return Err(HeightMapError(format!("has {} heights, must have {columns} × {rows}", heights.len())));
    }
    let Georeference { mut first_m, step_m } = georeference;
    if step_m[0] < 0.0 {
        first_m[0] += step_m[0] * (columns - 1) as f64;
        flip_columns(&mut heights, columns);
    }
    if step_m[1] < 0.0 {
        first_m[1] += step_m[1] * (rows - 1) as f64;
        flip_rows(&mut heights, columns);
    }
    Ok(FileGrid { columns, rows, first_m, spacing_m: step_m.map(f64::abs), heights })
}

/// Where the samples of the file are. A sample is at the centre of its pixel, unless pixels are points.
fn georeference(file: &mut TiffFile<'_>, is_point: bool) -> Result<Georeference, HeightMapError> {
    let centre = if is_point { 0.0 } else { 0.5 };
    let scale = doubles(file, Tag::ModelPixelScaleTag)?;
    let tie = doubles(file, Tag::ModelTiepointTag)?;
    if let (&[scale_x, scale_y, ..], &[column, row, _, x, y, ..]) = (scale.as_slice(), tie.as_slice()) {
        if !(scale_x > 0.0 && scale_y > 0.0) {
            let found = format!("ModelPixelScale is {}, {}", Number(scale_x), Number(scale_y));
            return Err(HeightMapError(format!("{found}, must be above 0")));
        }
        let first_m = [x + (centre - column) * scale_x, y - (centre - row) * scale_y];
        return Ok(Georeference { first_m, step_m: [scale_x, -scale_y] });
    }
    let matrix = doubles(file, Tag::ModelTransformationTag)?;
    let &[x_by_column, x_by_row, _, x, y_by_column, y_by_row, _, y, ..] = matrix.as_slice() else {
        let needed = "ModelPixelScale and ModelTiepoint, or ModelTransformation";
        return Err(HeightMapError(format!("has no position, must have {needed}")));
    };
    if (x_by_row, y_by_column) != (0.0, 0.0) {
        return Err(HeightMapError("is rotated or sheared, must have rows from west to east".to_owned()));
    }
    let first_m = [x + centre * x_by_column, y + centre * y_by_row];
    Ok(Georeference { first_m, step_m: [x_by_column, y_by_row] })
}

/// The samples in the order of the file; NaN where there is no data.
fn samples(file: &mut TiffFile<'_>) -> Result<Vec<f64>, HeightMapError> {
    let mut nodata = None;
    if let Some(text) = text(file, Tag::GdalNodata)? {
        let refused = |_| HeightMapError(format!("has the NODATA value {}, must be a number", quoted(&text)));
        nodata = Some(text.trim().parse::<f64>().map_err(refused)?);
    }
    let mut samples = match file.read_image().map_err(invalid)? {
        DecodingResult::U8(samples) => wide(samples),
        DecodingResult::I8(samples) => wide(samples),
        DecodingResult::U16(samples) => wide(samples),
        DecodingResult::I16(samples) => wide(samples),
        DecodingResult::U32(samples) => wide(samples),
        DecodingResult::I32(samples) => wide(samples),
        DecodingResult::F32(samples) => {
            nodata = nodata.map(|nodata| f64::from(nodata as f32));
            wide(samples)
        }
        DecodingResult::F64(samples) => samples,
        DecodingResult::F16(_) | DecodingResult::U64(_) | DecodingResult::I64(_) => {
            return Err(HeightMapError(format!("has samples of another type, must have {SAMPLES}")));
        }
    };
    for sample in &mut samples {
        if Some(*sample) == nodata {
            *sample = f64::NAN;
        }
    }
    Ok(samples)
}

fn wide<Sample: Into<f64>>(samples: Vec<Sample>) -> Vec<f64> {
    samples.into_iter().map(Into::into).collect()
}

#[cfg(test)]
mod tests {
    use tiff::encoder::colortype::{ColorType, Gray8, Gray16, Gray32, Gray32Float, Gray64, Gray64Float};
    use tiff::encoder::colortype::{GrayI8, GrayI16, GrayI32, RGB8};
    use tiff::encoder::compression::DeflateLevel;
    use tiff::encoder::{Compression, Predictor, TiffEncoder, TiffValue};
    use tiff::tags::CompressionMethod;

    use super::units::GDAL_METADATA;
    use super::*;

    const METRES: Placing = Placing { metres_per_unit: None, x_m: None, y_m: None, metres_per_pixel: None };
    /// Three columns and two rows, from the north-west.
    const HEIGHTS: [u8; 6] = [1, 2, 3, 4, 5, 6];

    /// The directory of keys, or a tag with doubles or text.
    enum Written {
        Keys(&'static [[u16; 4]]),
        Doubles(Tag, &'static [f64]),
        Text(Tag, &'static str),
    }
    use Written::{Doubles, Keys, Text};

    const SCALE: Written = Doubles(Tag::ModelPixelScaleTag, &[2.0, 4.0, 0.0]);
    const TIE: Written = Doubles(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, 100.0, 208.0, 0.0]);

    fn encoded<Pixel: ColorType>(compression: Compression, samples: &[Pixel::Inner], tags: &[Written]) -> Vec<u8>
    where
        [Pixel::Inner]: TiffValue,
    {
        let mut bytes = Cursor::new(vec![]);
        let mut encoder = TiffEncoder::new(&mut bytes).expect("a header").with_compression(compression);
        if matches!(compression, Compression::Deflate(_)) {
            encoder = encoder.with_predictor(Predictor::Horizontal);
        }
        let mut image = encoder.new_image::<Pixel>(3, 2).expect("an image");
        for tag in tags {
            let written = match *tag {
                Keys(keys) => {
                    let values = [&[[1, 1, 0, keys.len() as u16]], keys].concat();
                    image.encoder().write_tag(Tag::GeoKeyDirectoryTag, values.as_flattened())
                }
                Doubles(tag, values) => image.encoder().write_tag(tag, values),
                Text(tag, text) => image.encoder().write_tag(tag, text),
            };
            written.expect("a tag");
        }
        image.write_data(samples).expect("samples");
        bytes.into_inner()
    }

    fn with(tags: &[Written]) -> Result<FileGrid, HeightMapError> {
        grid(&encoded::<Gray8>(Compression::Uncompressed, &HEIGHTS, tags), &METRES)
    }

    #[test]
    fn every_type_of_samples_and_compression_gives_the_same_heights() {
        fn assert_read<Pixel: ColorType>()
        where
            [Pixel::Inner]: TiffValue,
            Pixel::Inner: From<u8>,
        {
            for compression in [
                Compression::Uncompressed,
                Compression::Lzw,
                Compression::Packbits,
                Compression::Deflate(DeflateLevel::Balanced),
            ] {
                let is_deflated_float = matches!(compression, Compression::Deflate(_))
                    && Pixel::SAMPLE_FORMAT[0] == tiff::tags::SampleFormat::IEEEFP;
                if is_deflated_float {
                    // The encoder has no predictor for floats.
                    continue;
                }
                let samples = HEIGHTS.map(Pixel::Inner::from);
                let grid = grid(&encoded::<Pixel>(compression, &samples, &[SCALE, TIE]), &METRES).expect("a grid");
                assert_eq!(grid.heights, [4.0, 5.0, 6.0, 1.0, 2.0, 3.0]);
            }
        }
        assert_read::<Gray8>();
        assert_read::<Gray16>();
        assert_read::<Gray32>();
        assert_read::<GrayI16>();
        assert_read::<GrayI32>();
        assert_read::<Gray32Float>();
        assert_read::<Gray64Float>();
        let bytes = encoded::<GrayI8>(Compression::Lzw, &[-1, 2, 3, 4, 5, -128], &[SCALE, TIE]);
        assert_eq!(grid(&bytes, &METRES).expect("a grid").heights, [4.0, 5.0, -128.0, -1.0, 2.0, 3.0]);
    }

    #[test]
    fn the_position_is_that_of_the_south_west_sample() {
        let matrix = |values| Doubles(Tag::ModelTransformationTag, values);
        let point = || Keys(&[[1025, 0, 1, 2]]);
        for (tags, first_m) in [
            (vec![SCALE, TIE], [101.0, 202.0]),
            (vec![SCALE, TIE, point()], [100.0, 204.0]),
            (vec![SCALE, Doubles(Tag::ModelTiepointTag, &[1.0, 2.0, 0.0, 102.0, 200.0, 0.0])], [101.0, 202.0]),
            (vec![matrix(&[2.0, 0.0, 0.0, 100.0, 0.0, -4.0, 0.0, 208.0])], [101.0, 202.0]),
            (vec![matrix(&[2.0, 0.0, 0.0, 100.0, 0.0, -4.0, 0.0, 208.0]), point()], [100.0, 204.0]),
        ] {
            let grid = with(&tags).expect("a grid");
            assert_eq!((grid.first_m, grid.spacing_m), (first_m, [2.0, 4.0]));
            assert_eq!(grid.heights, [4.0, 5.0, 6.0, 1.0, 2.0, 3.0]);
        }
        let mirrored = with(&[matrix(&[-2.0, 0.0, 0.0, 106.0, 0.0, 4.0, 0.0, 200.0])]).expect("a grid");
        assert_eq!((mirrored.first_m, mirrored.spacing_m), ([101.0, 202.0], [2.0, 4.0]));
        assert_eq!(mirrored.heights, [3.0, 2.0, 1.0, 6.0, 5.0, 4.0]);
    }

    #[test]
    fn samples_of_the_nodata_value_are_missing() {
        let metadata =
            "<a><Item role='unittype'>Metre</Item><Item role='scale'>1.0</Item><Item role='offset'>0</Item></a>";
        let grid = with(&[SCALE, TIE, Text(Tag::GdalNodata, "4"), Text(GDAL_METADATA, metadata)]).expect("a grid");
        assert!(grid.heights[0].is_nan());
        assert_eq!(grid.heights[1..], [5.0, 6.0, 1.0, 2.0, 3.0]);
        let lowest = [f32::MIN, 1.0, 2.0, 3.0, 4.0, f32::NAN];
        let nodata = Text(Tag::GdalNodata, "-3.40282346638529e+38");
        let bytes = encoded::<Gray32Float>(Compression::Lzw, &lowest, &[SCALE, TIE, nodata]);
        let heights = super::grid(&bytes, &METRES).expect("a grid").heights;
        let missing: Vec<bool> = heights.iter().map(|height| height.is_nan()).collect();
        assert_eq!(missing, [false, false, true, true, false, false]);
    }

    /// A tile may be larger than the map, and many tiles may have the same bytes.
    #[test]
    fn compressed_bombs_are_refused_before_they_are_read() {
        for ([columns, rows], [width, height], tiles, reason) in [
            (
                [2, 2],
                [u32::MAX, 16],
                1,
                "has tiles of 4294967295 × 16 with more than 64000000 samples, the most that is allowed",
            ),
            (
                [2, 90_000],
                [16_384, 1],
                90_000,
                "has tiles of 16384 × 1 with more than 64000000 samples, the most that is allowed",
            ),
            ([2, 200_000], [2, 1], 200_000, "has 200000 strips or tiles, at most 100000 are allowed"),
            ([100_000, 100_000], [100_000, 100_000], 1, "has 100000 × 100000 heights, at most 16000000 are allowed"),
        ] {
            let mut bytes = Cursor::new(vec![]);
            let mut encoder = TiffEncoder::new(&mut bytes).expect("a header");
            let mut directory = encoder.image_directory().expect("a directory");
            for (tag, value) in [
                (Tag::ImageWidth, columns),
                (Tag::ImageLength, rows),
                (Tag::TileWidth, width),
                (Tag::TileLength, height),
                (Tag::BitsPerSample, 8),
                (Tag::PhotometricInterpretation, 1),
                (Tag::Compression, CompressionMethod::Deflate.to_u16().into()),
            ] {
                directory.write_tag(tag, value).expect("a tag");
            }
            for tag in [Tag::TileOffsets, Tag::TileByteCounts] {
                directory.write_tag(tag, vec![8_u32; tiles].as_slice()).expect("a tag");
            }
            directory.finish().expect("a directory");
            let error = grid(bytes.get_ref(), &METRES).err().map(|error| error.to_string());
            assert_eq!(error.as_deref(), Some(reason));
        }
    }

    #[test]
    fn files_without_heights_in_metres_are_refused_in_one_line() {
        let placed = |tag| vec![SCALE, TIE, tag];
        for (tags, reason) in [
            (vec![], "has no position, must have ModelPixelScale and ModelTiepoint, or ModelTransformation"),
            (vec![SCALE], "has no position, must have ModelPixelScale and ModelTiepoint, or ModelTransformation"),
            (vec![Doubles(Tag::ModelPixelScaleTag, &[0.0, 1.0, 0.0]), TIE], "ModelPixelScale is 0, 1, must be above 0"),
            (
                vec![Doubles(Tag::ModelTransformationTag, &[1.0, 0.1, 0.0, 0.0, -0.1, 1.0, 0.0, 0.0])],
                "is rotated or sheared, must have rows from west to east",
            ),
            (
                placed(Keys(&[[1024, 0, 1, 2]])),
                "has positions in degrees (GTModelType 2): reproject it to a grid in metres",
            ),
            (placed(Keys(&[[1024, 0, 1, 3]])), "GTModelType is 3, must be 1: a projected grid in metres"),
            (
                placed(Keys(&[[1024, 0, 1, 1], [3076, 0, 1, 9003]])),
                "has positions in unit 9003 of EPSG, must be 9001: metres",
            ),
            (placed(Keys(&[[4099, 0, 1, 9002]])), "has heights in unit 9002 of EPSG: set metres_per_unit"),
            (
                placed(Keys(&[[4096, 0, 1, 6360]])),
                "has heights in units of 0.30480060960121924 m (EPSG:6360): set metres_per_unit = 0.30480060960121924",
            ),
            (
                placed(Keys(&[[4096, 0, 1, 8228]])),
                "has heights in units of 0.3048 m (EPSG:8228): set metres_per_unit = 0.3048",
            ),
            (placed(Keys(&[[4096, 0, 1, 5715]])), "has depths (EPSG:5715), must have heights: negate them"),
            (
                placed(Keys(&[[3072, 0, 1, 2263]])),
                "has positions in EPSG:2263, whose unit is not the metre: reproject it",
            ),
            (
                vec![SCALE, TIE, Keys(&[[4096, 0, 1, 32767]]), Text(Tag::GeoAsciiParamsTag, "My height (ftUS)|")],
                "has a vertical system that may be in feet: set metres_per_unit",
            ),
            (
                placed(Text(GDAL_METADATA, "<a><Item role='unittype'>ft</Item></a>")),
                "has heights in \"ft\": set metres_per_unit",
            ),
            (
                placed(Text(GDAL_METADATA, "<a><Item role='scale'>0.5</Item></a>")),
                "GDAL_METADATA has the scale \"0.5\", must be 1: write the heights themselves",
            ),
            (
                placed(Text(GDAL_METADATA, "<a><Item role='offset'>-10</Item></a>")),
                "GDAL_METADATA has the offset \"-10\", must be 0: write the heights themselves",
            ),
            (placed(Text(Tag::GdalNodata, "none")), "has the NODATA value \"none\", must be a number"),
        ] {
            assert_eq!(with(&tags).err().map(|error| error.to_string()).as_deref(), Some(reason));
        }
        let unit = Placing { metres_per_unit: Some(0.3048), ..METRES };
        let system = [SCALE, TIE, Keys(&[[3072, 0, 1, 25832], [4096, 0, 1, 7837]])];
        assert!(grid(&encoded::<Gray8>(Compression::Lzw, &HEIGHTS, &system), &METRES).is_ok());
        let feet = [SCALE, TIE, Keys(&[[4096, 0, 1, 6360]])];
        assert!(grid(&encoded::<Gray8>(Compression::Lzw, &HEIGHTS, &feet), &unit).is_ok());
        let feet = Text(GDAL_METADATA, "<a><Item role='unittype'>ft</Item></a>");
        let tags = [SCALE, TIE, Keys(&[[4099, 0, 1, 9002]]), feet];
        assert!(grid(&encoded::<Gray8>(Compression::Lzw, &HEIGHTS, &tags), &unit).is_ok());
        for (bytes, reason) in [
            (encoded::<RGB8>(Compression::Lzw, &[0; 18], &[SCALE, TIE]), "has 3 bands, must have 1"),
            (
                encoded::<Gray64>(Compression::Lzw, &[0; 6], &[SCALE, TIE]),
                "has samples of another type, must have integers of 8 to 32 bits or floats of 32 or 64 bits",
            ),
            (vec![], "is not a TIFF file that can be read: TIFF signature not found"),
        ] {
            assert_eq!(grid(&bytes, &METRES).err().map(|error| error.to_string()).as_deref(), Some(reason));
        }
    }
}
