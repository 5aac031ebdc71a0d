//! Files whose content is of another format than their extension promises.

use super::{DrawingFileError, quoted};

/// Beginnings of files, and what they are.
const FOREIGN: [(&[u8], &str); 12] = [
    (&[0x1f, 0x8b], "is compressed by gzip (as .svgz is), must be plain text: save it without compression"),
    (&[0xff, 0xfe], "is text in UTF-16, must be in UTF-8: save it in UTF-8"),
    (&[0xfe, 0xff], "is text in UTF-16, must be in UTF-8: save it in UTF-8"),
    (&[b'<', 0], "is text in UTF-16, must be in UTF-8: save it in UTF-8"),
    (&[0, b'<'], "is text in UTF-16, must be in UTF-8: save it in UTF-8"),
    (b"AutoCAD Binary DXF", "is a binary DXF file, must be in text form"),
    (b"%PDF", "is a PDF file: save the drawing as SVG or DXF"),
    (b"%!PS", "is a PostScript file: save the drawing as SVG or DXF"),
    (b"PK\x03\x04", "is a ZIP archive (as .kmz is): unpack it"),
    (b"\x89PNG", "is a PNG image: trace it to a path, and save that as SVG"),
    (&[0xff, 0xd8, 0xff], "is a JPEG image: trace it to a path, and save that as SVG"),
    (b"GIF8", "is a GIF image: trace it to a path, and save that as SVG"),
];
/// Most bytes of a file that may declare its encoding.
const HEAD: usize = 200;

/// Fails for a file of another format, with a line that names it.
pub(super) fn require(bytes: &[u8]) -> Result<(), DrawingFileError> {
    if let Some((_, what)) = FOREIGN.iter().find(|(begin, _)| bytes.starts_with(begin)) {
        return Err(DrawingFileError((*what).to_owned()));
    }
    // The first six bytes of a DWG are its version: AC1012 to AC1032, or older.
    let is_dwg = bytes.starts_with(b"AC") && bytes.get(2..6).is_some_and(|rest| rest.iter().all(u8::is_ascii_digit));
    if is_dwg {
        return Err(DrawingFileError("is a DWG file: save it as DXF in text form".to_owned()));
    }
    Ok(())
}

/// The error of an XML file that declares an encoding other than UTF-8.
pub(super) fn declared_encoding(bytes: &[u8]) -> Option<DrawingFileError> {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(HEAD)]).into_owned();
    let declaration = head.strip_prefix("<?xml")?.split("?>").next()?;
    let value = declaration.split("encoding").nth(1)?.trim_start().strip_prefix('=')?.trim_start();
    let quote = value.chars().next().filter(|char| "\"'".contains(*char))?;
    let encoding = value[1..].split(quote).next()?;
    if encoding.eq_ignore_ascii_case("utf-8") {
        return None;
    }
    Some(DrawingFileError(format!("is text in {}, must be in UTF-8: save it in UTF-8", quoted(encoding))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_another_format_are_named() {
        for (bytes, expected) in [
            (&b"\x1f\x8b\x08"[..], "gzip"),
            (b"\xff\xfe<\0", "UTF-16"),
            (b"AC1032\0\0", "DWG"),
            (b"AutoCAD Binary DXF\r\n\x1a\0", "binary DXF"),
            (b"%PDF-1.7", "PDF"),
        ] {
            let error = require(bytes).expect_err(expected).to_string();
            assert!(error.contains(expected) && error.lines().count() == 1, "{error}");
        }
        assert!(
            require(b"0\nSECTION\n").is_ok() && require(b"<svg/>").is_ok() && require(b"AC,DC\n1,2\n3,4\n").is_ok()
        );
        let declared = b"<?xml version=\"1.0\" encoding='ISO-8859-1'?>\xe9";
        let error = declared_encoding(declared).expect("an encoding").to_string();
        assert_eq!(error, "is text in \"ISO-8859-1\", must be in UTF-8: save it in UTF-8");
        assert!(declared_encoding(b"<?xml version=\"1.0\" encoding=\"utf-8\"?>\xe9").is_none());
        assert!(declared_encoding(b"<svg/>").is_none());
    }
}
