//! The live line of a terminal, which is redrawn in place, and its progress bar.

#[derive(Debug, Default)]
pub(super) struct LiveLine {
    pub(super) text: Option<String>,
    drawn: Option<String>,
}

/// Moves to the beginning of the line and erases it (ECMA-48: CR, EL 0).
const ERASE: &str = "\r\u{1b}[K";

impl LiveLine {
    /// Whether the terminal does not show the newest text.
    pub(super) fn is_due(&self) -> bool {
        self.text != self.drawn
    }

    pub(super) fn erase(&mut self) -> Option<Vec<u8>> {
        self.drawn.take().map(|_| ERASE.as_bytes().to_vec())
    }

    /// Returns the bytes that show the newest text. `None` if the terminal shows it.
    pub(super) fn draw(&mut self) -> Option<Vec<u8>> {
        if !self.is_due() {
            return None;
        }
        let text = self.text.clone();
        self.drawn.clone_from(&text);
        Some(format!("{ERASE}{}", text.unwrap_or_default()).into_bytes())
    }
}

const LENGTH: usize = 24;

/// A progress bar, filled to a fraction from 0 to 1.
pub(crate) fn bar(fraction: f64) -> String {
    // NaN, such as a fraction of nothing, becomes 0.
    let full = (fraction.clamp(0.0, 1.0) * LENGTH as f64) as usize;
    "\u{2588}".repeat(full) + &"\u{2591}".repeat(LENGTH - full)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bar_shows_its_fraction_and_has_a_fixed_length() {
        let full = |fraction: f64| {
            let bar = bar(fraction);
            assert_eq!(bar.chars().count(), LENGTH, "{fraction}");
            bar.chars().filter(|character| *character == '\u{2588}').count()
        };
        assert_eq!([-1.0, 0.0, 0.5, 1.0, 7.0, f64::NAN].map(full), [0, 0, 12, 24, 24, 0]);
    }
}
