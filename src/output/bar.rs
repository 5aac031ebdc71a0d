//! A bar that shows how far something is.

/// Characters of a bar.
const LENGTH: usize = 24;

/// A bar of which this fraction is full.
pub(crate) fn bar(fraction: f64) -> String {
    // A fraction of nothing is not a number, and counts as none.
    let full = (fraction.clamp(0.0, 1.0) * LENGTH as f64) as usize;
    "\u{2588}".repeat(full) + &"\u{2591}".repeat(LENGTH - full)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_is_as_full_as_its_fraction_and_always_of_one_length() {
        let full = |fraction: f64| {
            let bar = bar(fraction);
            assert_eq!(bar.chars().count(), LENGTH, "{fraction}");
            bar.chars().filter(|character| *character == '\u{2588}').count()
        };
        assert_eq!([-1.0, 0.0, 0.5, 1.0, 7.0, f64::NAN].map(full), [0, 0, 12, 24, 24, 0]);
    }
}
