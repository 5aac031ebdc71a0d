//! What is required of a TIFF file before its samples are read: one grey band, known compression, and bounded work.

use std::fmt::Display;

use tiff::decoder::ChunkType;
use tiff::tags::{CompressionMethod, IfdPointer, Tag};

use super::super::{HeightMapError, MAX_HEIGHTS};
use super::tags::{NOT_TIFF, TiffFile, ends_early, invalid, unsigned};

/// Most strips or tiles of a file.
const MAX_PARTS: usize = 100_000;
/// Most samples of all tiles: those at the edges are partly outside the map.
const MAX_TILED: u64 = 4 * MAX_HEIGHTS as u64;
/// Most images of a file that are searched for a mask.
const MAX_IMAGES: usize = 64;
/// Bit of the tag `NewSubfileType`: the image is the mask of another one.
const IS_MASK: u32 = 4;

/// Fails if a tag of the first image has more values than the file has bytes. The decoder would print a message of its
/// own for such a text. It also misreads what follows a tag of unknown type in a file with long offsets (`BigTIFF`).
pub(super) fn require_tags_within(bytes: &[u8]) -> Result<(), HeightMapError> {
    let is_big_endian = bytes.starts_with(b"MM");
    let number = |at: u64, len: usize| -> Result<u64, HeightMapError> {
        let from = usize::try_from(at).unwrap_or(usize::MAX);
        let digits = bytes.get(from..from.saturating_add(len)).ok_or_else(ends_early)?;
        let append = |number: u64, digit: &u8| number << 8 | u64::from(*digit);
        Ok(if is_big_endian { digits.iter().fold(0, append) } else { digits.iter().rev().fold(0, append) })
    };
    let is_long = number(2, 2)? == 43;
    let (len, count_len, entry_len) = if is_long { (8, 8, 20) } else { (4, 2, 12) };
    let directory = number(len as u64, len)?;
    let mut entry = directory.saturating_add(count_len as u64);
    for _ in 0..number(directory, count_len)? {
        let [tag, kind, count] = [number(entry, 2)?, number(entry + 2, 2)?, number(entry + 4, len)?];
        if count > bytes.len() as u64 {
            let values = format!("tag {tag} has {count} values");
            return Err(HeightMapError(format!("{NOT_TIFF}: {values}, more than the file has bytes")));
        }
        if is_long && !matches!(kind, 1..=13 | 16..=18) {
            return Err(HeightMapError(format!("{NOT_TIFF}: tag {tag} has the unknown type {kind}")));
        }
        entry += entry_len;
    }
    Ok(())
}

/// Samples that are allowed, in words.
pub(super) const SAMPLES: &str = "integers of 8 to 32 bits or floats of 32 or 64 bits";

/// Fails for colours, several bands, samples of less than a byte, and unknown compression.
pub(super) fn require_one_grey_band(file: &mut TiffFile<'_>) -> Result<(), HeightMapError> {
    let bands = unsigned(file, Tag::SamplesPerPixel)?.unwrap_or(1);
    if bands != 1 {
        return Err(HeightMapError(format!("has {bands} bands, must have 1")));
    }
    let bits = unsigned(file, Tag::BitsPerSample)?.unwrap_or(1);
    if ![8, 16, 32, 64].contains(&bits) {
        return Err(HeightMapError(format!("has samples of {bits} bits, must have {SAMPLES}")));
    }
    let interpretation = unsigned(file, Tag::PhotometricInterpretation)?.unwrap_or(1);
    if interpretation != 1 {
        let found = format!("PhotometricInterpretation {interpretation}");
        return Err(HeightMapError(format!("has colours ({found}), must have one grey band, where black is zero")));
    }
    let compression = unsigned(file, Tag::Compression)?.unwrap_or(CompressionMethod::None.to_u16().into());
    let method = CompressionMethod::from_u16_exhaustive(compression as u16);
    match method {
        CompressionMethod::None
        | CompressionMethod::LZW
        | CompressionMethod::Deflate
        | CompressionMethod::OldDeflate
        | CompressionMethod::ZSTD
        | CompressionMethod::PackBits => Ok(()),
        CompressionMethod::Unknown(number) => Err(refused_compression(&number)),
        method => Err(refused_compression(&format_args!("{method:?}"))),
    }
}

fn refused_compression(found: &dyn Display) -> HeightMapError {
    HeightMapError(format!("has compression {found}, must be none, Deflate, LZW, PackBits or ZSTD"))
}

/// Fails if strips or tiles would take long or are left out.
pub(super) fn require_moderate_parts(file: &mut TiffFile<'_>) -> Result<(), HeightMapError> {
    let is_tiled = file.get_chunk_type() == ChunkType::Tile;
    let tag = if is_tiled { Tag::TileByteCounts } else { Tag::StripByteCounts };
    let lens = file.find_tag_unsigned_vec::<u64>(tag).map_err(invalid)?.unwrap_or_default();
    if lens.len() > MAX_PARTS {
        return Err(HeightMapError(format!("has {} strips or tiles, at most {MAX_PARTS} are allowed", lens.len())));
    }
    if lens.contains(&0) {
        return Err(HeightMapError("is a sparse file, must have all of its strips or tiles".to_owned()));
    }
    let (columns, rows) = file.dimensions().map_err(invalid)?;
    let (width, height) = file.chunk_dimensions();
    let padded = |side: u32, part: u32| u64::from(side).next_multiple_of(u64::from(part));
    if is_tiled && padded(columns, width).saturating_mul(padded(rows, height)) > MAX_TILED {
        let tiles = format!("tiles of {width} × {height}");
        return Err(HeightMapError(format!(
            "has {tiles} with more than {MAX_TILED} samples, the most that is allowed"
        )));
    }
    Ok(())
}

/// Fails if another image of the file is a mask of missing data.
pub(super) fn require_no_mask(file: &mut TiffFile<'_>) -> Result<(), HeightMapError> {
    let mut next: Option<IfdPointer> = file.image_ifd().directory().next();
    for _ in 0..MAX_IMAGES {
        let Some(pointer) = next else { return Ok(()) };
        let directory = file.read_directory(pointer).map_err(invalid)?;
        if directory.get(Tag::NewSubfileType).is_some_and(|entry| entry.count() != 1) {
            return Err(HeightMapError(format!("{NOT_TIFF}: NewSubfileType must have one value")));
        }
        let kind =
            file.read_directory_tags(&directory).find_tag_unsigned::<u32>(Tag::NewSubfileType).map_err(invalid)?;
        if kind.is_some_and(|kind| kind & IS_MASK != 0) {
            return Err(HeightMapError("has a mask, must have a NODATA value where heights are missing".to_owned()));
        }
        next = directory.next();
    }
    Err(HeightMapError(format!("has more than {MAX_IMAGES} images, the most that is allowed")))
}
