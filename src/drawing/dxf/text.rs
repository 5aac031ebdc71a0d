//! The text of a DXF file.

use std::borrow::Cow;

/// Mark of a letter outside the file's code page. The code of the letter follows as four hexadecimal digits.
///
/// Source: Autodesk *DXF Reference*, "Unicode character strings".
const MARK: &str = "\\U+";
const DIGITS: usize = 4;

/// The text of a file, with all letters that are escaped. An escape without a letter stays as it is.
pub(super) fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    let text = String::from_utf8_lossy(bytes);
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

#[cfg(test)]
mod tests {
    use super::*;

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
