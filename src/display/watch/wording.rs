//! Quantities as the screen has them.

use super::glyphs::Glyphs;

/// A duration in two or three digits.
pub(super) fn span(time_ns: u64, glyphs: Glyphs) -> String {
    let time_us = time_ns as f64 * 1e-3;
    let micro = glyphs.micro();
    match time_ns {
        0..9_950 => format!("{time_us:.1} {micro}s"),
        9_950..999_500 => format!("{time_us:.0} {micro}s"),
        999_500..9_950_000 => format!("{:.1} ms", time_us * 1e-3),
        9_950_000..999_500_000 => format!("{:.0} ms", time_us * 1e-3),
        _ => format!("{:.1} s", time_us * 1e-6),
    }
}

/// A clearance to the micrometre.
pub(super) fn millimetres(length_m: f64) -> String {
    format!("{:.3} mm", length_m * 1e3)
}

/// Two benches.
pub(super) fn pair(benches: [impl std::fmt::Display; 2]) -> String {
    let [one, another] = benches;
    format!("benches {one} and {another}")
}

/// A number without decimals that say nothing.
pub(super) fn short(value: f64) -> String {
    let text = format!("{value:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duration_has_the_unit_that_keeps_it_short() {
        let told = [0, 3_240, 9_949, 9_950, 120_000, 999_499, 999_500, 12_000_000, 999_499_999, 2_500_000_000];
        let told = told.map(|time_ns| span(time_ns, Glyphs::Ascii));
        let expected =
            ["0.0 us", "3.2 us", "9.9 us", "10 us", "120 us", "999 us", "1.0 ms", "12 ms", "999 ms", "2.5 s"];
        assert_eq!(told, expected);
    }

    #[test]
    fn a_short_number_has_no_idle_decimals() {
        assert_eq!([1.0, 20.0, 0.5, 1.25, 100.0].map(short), ["1", "20", "0.5", "1.25", "100"]);
    }
}
