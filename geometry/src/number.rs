//! Formats numbers for messages.

use std::fmt;

/// Displays a number in full if its size is usual (0, or 10⁻⁶ to 10¹²), otherwise with a power of ten.
///
/// ```
/// use bench_dragon_geometry::number::Number;
///
/// assert_eq!(Number(0.55).to_string(), "0.55");
/// assert_eq!(Number(1e300).to_string(), "1e300");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Number(pub f64);

impl fmt::Display for Number {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(value) = *self;
        let is_usual = value == 0.0 || (1e-6..1e12).contains(&value.abs());
        if is_usual || !value.is_finite() { write!(formatter, "{value}") } else { write!(formatter, "{value:e}") }
    }
}
