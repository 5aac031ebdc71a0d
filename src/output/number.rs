//! Counts as people read them in messages.

use std::fmt;

/// Shows how many there are of something: `1 frame`, `2 frames`.
///
/// ```
/// use bench_dragon::output::number::Counted;
///
/// assert_eq!(Counted(1, "frame").to_string(), "1 frame");
/// assert_eq!(Counted(0, "near miss").to_string(), "0 near misses");
/// assert_eq!(Counted(2, "bench").to_string(), "2 benches");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counted(pub u64, pub &'static str);

impl fmt::Display for Counted {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(count, noun) = *self;
        let ending = match noun.as_bytes() {
            _ if count == 1 => "",
            [.., b's' | b'x'] | [.., b'c' | b's', b'h'] => "es",
            _ => "s",
        };
        write!(formatter, "{count} {noun}{ending}")
    }
}
