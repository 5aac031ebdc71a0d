//! The text of a DXF file.

use std::borrow::Cow;

/// Mark of a letter outside the file's code page. The code of the letter follows as four hexadecimal digits.
///
/// Source: Autodesk *DXF Reference*, "Unicode character strings".
const MARK: &str = "\\U+";
const DIGITS: usize = 4;

/// The first version whose files are in UTF-8: that of 2007. Versions are in the order of their names.
const FIRST_IN_UTF_8: &str = "AC1021";

/// The text of a file, with all letters that are escaped. An escape without a letter stays as it is.
///
/// Older files are in the code page of their header. Text that is valid UTF-8 is taken as such in any file, because many
/// programs write it.
pub(super) fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    let text = match str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => in_code_page(bytes),
    };
    if !text.contains(MARK) {
        return text;
    }
    let mut parts = text.split(MARK);
    let mut decoded = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let code = part.get(..DIGITS).and_then(|digits| u32::from_str_radix(digits, 16).ok());
        // An escaped line end would make two lines of one.
        if let Some(letter) = code.and_then(char::from_u32).filter(|letter| !letter.is_control()) {
            decoded.push(letter);
            decoded.push_str(&part[DIGITS..]);
        } else {
            decoded.push_str(MARK);
            decoded.push_str(part);
        }
    }
    decoded.into()
}

/// The text of a file that is not UTF-8. Bytes that are no letter of its code page become U+FFFD.
fn in_code_page(bytes: &[u8]) -> Cow<'_, str> {
    let lossy = String::from_utf8_lossy(bytes);
    let variable = |name: &str| {
        let mut lines = lossy.lines().map(str::trim).skip_while(|line| *line != name);
        lines.nth(2)
    };
    let is_older = variable("$ACADVER").is_none_or(|version| version < FIRST_IN_UTF_8);
    let number =
        variable("$DWGCODEPAGE").and_then(|page| page.to_ascii_uppercase().strip_prefix("ANSI_")?.parse().ok());
    match number.filter(|_| is_older).and_then(codepage::to_encoding) {
        Some(encoding) => encoding.decode_without_bom_handling(bytes).0,
        None => lossy,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_before_2007_is_in_the_code_page_of_its_header() {
        let file = |version: &str, page: &str, name: &[u8]| {
            let header = format!("9\n$ACADVER\n1\n{version}\n  9\n$DWGCODEPAGE\n  3\n{page}\n8\n");
            let bytes = [header.as_bytes(), name, b"\n"].concat();
            decoded(&bytes).lines().last().expect("a line").to_owned()
        };
        assert_eq!(file("AC1015", "ANSI_1252", b"Stra\xdfe"), "Straße");
        assert_eq!(file("AC1015", "ansi_1251", b"\xcf\xf3\xf2\xfc"), "Путь");
        assert_eq!(file("AC1015", "ANSI_932", b"\x93\xb9"), "道");
        // As some programs write any version.
        assert_eq!(file("AC1015", "ANSI_1252", "Straße".as_bytes()), "Straße");
        for (version, page) in [("AC1021", "ANSI_1252"), ("AC1015", "DOS850"), ("AC1015", "")] {
            assert_eq!(file(version, page, b"Stra\xdfe"), "Stra\u{fffd}e", "{version} {page}");
        }
    }

    #[test]
    fn letters_are_decoded_and_what_is_no_letter_stays() {
        for (text, expected) in [
            ("8\nStra\\U+00DFe\\U+00e9\n", "8\nStraßeé\n"),
            ("\\U+000A\\U+D800\\U+12", "\\U+000A\\U+D800\\U+12"),
            ("\\U+00ß0\\u+00DF", "\\U+00ß0\\u+00DF"),
        ] {
            assert_eq!(decoded(text.as_bytes()), expected, "{text}");
        }
    }
}
