//! The tags of a TIFF file, and the errors of reading it.

use std::io::{Cursor, ErrorKind};

use tiff::TiffError;
use tiff::decoder::Decoder;
use tiff::decoder::ifd::Value;
use tiff::tags::Tag;

use super::super::HeightMapError;

/// Begin of a message for a damaged or unknown file.
pub(super) const NOT_TIFF: &str = "is not a TIFF file that can be read";

pub(super) type TiffFile<'a> = Decoder<Cursor<&'a [u8]>>;

pub(super) fn unsigned(file: &mut TiffFile<'_>, tag: Tag) -> Result<Option<u32>, HeightMapError> {
    file.find_tag_unsigned(tag).map_err(invalid)
}

/// The numbers of a tag; none without the tag.
pub(super) fn doubles(file: &mut TiffFile<'_>, tag: Tag) -> Result<Vec<f64>, HeightMapError> {
    file.find_tag(tag).and_then(|value| value.map_or(Ok(vec![]), Value::into_f64_vec)).map_err(invalid)
}

pub(super) fn text(file: &mut TiffFile<'_>, tag: Tag) -> Result<Option<String>, HeightMapError> {
    file.find_tag(tag).and_then(|value| value.map(Value::into_string).transpose()).map_err(invalid)
}

pub(super) fn invalid(error: TiffError) -> HeightMapError {
    let reason = match error {
        TiffError::FormatError(error) => error.to_string(),
        TiffError::UnsupportedError(error) => error.to_string(),
        TiffError::IoError(error) if error.kind() == ErrorKind::UnexpectedEof => return ends_early(),
        error => error.to_string(),
    };
    HeightMapError(format!("{NOT_TIFF}: {}", reason.replace('\n', " ")))
}

pub(super) fn ends_early() -> HeightMapError {
    HeightMapError(format!("{NOT_TIFF}: it ends too early"))
}
