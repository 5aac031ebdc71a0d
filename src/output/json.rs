//! JSON as the program prints it: numbers have full precision, and a zero has no sign.

use std::io::{self, Write};

use serde::Serialize;
use serde_json::Serializer;
use serde_json::ser::{CompactFormatter, Formatter, PrettyFormatter};

/// A value as one line, with its line feed.
///
/// # Errors
/// The errors of the value's own serialization.
pub(crate) fn line(value: &impl Serialize) -> serde_json::Result<Vec<u8>> {
    lines(value, CompactFormatter)
}

/// A value on indented lines.
///
/// # Errors
/// The errors of the value's own serialization.
pub(crate) fn indented(value: &impl Serialize) -> serde_json::Result<Vec<u8>> {
    lines(value, PrettyFormatter::new())
}

fn lines(value: &impl Serialize, layout: impl Formatter) -> serde_json::Result<Vec<u8>> {
    let mut lines = Vec::new();
    value.serialize(&mut Serializer::with_formatter(&mut lines, UnsignedZero(layout)))?;
    lines.push(b'\n');
    Ok(lines)
}

/// A layout whose zeros have no sign.
struct UnsignedZero<Layout>(Layout);

impl<Layout: Formatter> Formatter for UnsignedZero<Layout> {
    fn write_f64<W: ?Sized + Write>(&mut self, writer: &mut W, value: f64) -> io::Result<()> {
        self.0.write_f64(writer, value + 0.0)
    }

    fn write_f32<W: ?Sized + Write>(&mut self, writer: &mut W, value: f32) -> io::Result<()> {
        self.0.write_f32(writer, value + 0.0)
    }

    fn begin_array<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.0.begin_array(writer)
    }

    fn end_array<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.0.end_array(writer)
    }

    fn begin_array_value<W: ?Sized + Write>(&mut self, writer: &mut W, is_first: bool) -> io::Result<()> {
        self.0.begin_array_value(writer, is_first)
    }

    fn end_array_value<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.0.end_array_value(writer)
    }

    fn begin_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.0.begin_object(writer)
    }

    fn end_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.0.end_object(writer)
    }

    fn begin_object_key<W: ?Sized + Write>(&mut self, writer: &mut W, is_first: bool) -> io::Result<()> {
        self.0.begin_object_key(writer, is_first)
    }

    fn begin_object_value<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.0.begin_object_value(writer)
    }

    fn end_object_value<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.0.end_object_value(writer)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_zero_has_no_sign_and_the_layout_is_that_of_the_library() {
        let value = json!({ "points": [[-0.0, -0.5], []], "time_s": -0.0, "none": {}, "single": -0.0_f32 });
        let unsigned = json!({ "points": [[0.0, -0.5], []], "time_s": 0.0, "none": {}, "single": 0.0_f32 });
        let text = |lines: serde_json::Result<Vec<u8>>| String::from_utf8(lines.expect("JSON")).expect("UTF-8");
        assert_eq!(text(line(&value)), format!("{unsigned}\n"));
        let indented = text(indented(&value));
        assert_eq!(indented, serde_json::to_string_pretty(&unsigned).expect("JSON") + "\n");
    }
}
