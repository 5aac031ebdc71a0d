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
        // Adding 0 removes the sign of a negative zero.
        let value = self.0 + 0.0;
        let is_usual = value == 0.0 || (1e-6..1e12).contains(&value.abs());
        if is_usual || !value.is_finite() { write!(formatter, "{value}") } else { write!(formatter, "{value:e}") }
    }
}

/// Displays a number with a fixed number of decimals. A number that rounds to 0 has no sign.
///
/// ```
/// use bench_dragon_geometry::number::Fixed;
///
/// assert_eq!(Fixed::<3>(-0.25).to_string(), "-0.250");
/// assert_eq!(Fixed::<3>(-1e-9).to_string(), "0.000");
/// assert_eq!(format!("{:>7}", Fixed::<1>(0.75)), "    0.8");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fixed<const DECIMALS: usize>(pub f64);

impl<const DECIMALS: usize> fmt::Display for Fixed<DECIMALS> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = format!("{:.DECIMALS$}", self.0);
        let zero = text.strip_prefix('-').filter(|digits| digits.bytes().all(|digit| matches!(digit, b'0' | b'.')));
        formatter.pad(zero.unwrap_or(&text))
    }
}

/// Displays a point of the plan in metres, with a fixed number of decimals. A zero has no sign.
///
/// ```
/// use bench_dragon_geometry::number::Place;
///
/// assert_eq!(Place::<3>([1.5, -0.0]).to_string(), "(1.500, 0.000) m");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place<const DECIMALS: usize>(pub [f64; 2]);

impl<const DECIMALS: usize> fmt::Display for Place<DECIMALS> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.0.map(Fixed::<DECIMALS>);
        write!(formatter, "({x}, {y}) m")
    }
}
