//! Colours of several dragons: those of the configuration, and for the others a palette that colour-blind people can tell apart.
//!
//! Source: M. Okabe and K. Ito, Color Universal Design, 2002, without black. Later rounds of the palette differ in lightness.

use crate::config::FormationDocument;

/// Red, green and blue.
pub type Rgb = [u8; 3];

const PALETTE: [Rgb; 7] = [
    [0x00, 0x72, 0xB2],
    [0xD5, 0x5E, 0x00],
    [0x00, 0x9E, 0x73],
    [0xCC, 0x79, 0xA7],
    [0xE6, 0x9F, 0x00],
    [0x56, 0xB4, 0xE9],
    [0xF0, 0xE4, 0x42],
];
/// Share of white, or of black if negative, in each round of the palette. They suffice for all dragons of a show.
const SHADES: [f64; 5] = [0.0, 0.5, -0.45, 0.75, -0.7];
/// Distance in the cube of colours up to which a colour of the palette is left out, beside one of the configuration.
const ALIKE: f64 = 60.0;

/// The colour of each dragon.
pub fn dragon_colours(document: &FormationDocument) -> Vec<Rgb> {
    colours_of(&document.dragons().iter().map(|dragon| dragon.colour).collect::<Vec<_>>())
}

/// The colour of each dragon, of which some have one.
pub fn colours_of(configured: &[Option<Rgb>]) -> Vec<Rgb> {
    let taken: Vec<Rgb> = configured.iter().flatten().copied().collect();
    let all = SHADES.iter().flat_map(|shade| PALETTE.map(|colour| mixed(colour, *shade)));
    let mut free = all.filter(|colour| taken.iter().all(|other| distance(*colour, *other) > ALIKE)).cycle();
    configured.iter().map(|colour| colour.or_else(|| free.next()).unwrap_or(PALETTE[0])).collect()
}

fn mixed(colour: Rgb, shade: f64) -> Rgb {
    let end = if shade > 0.0 { 255.0 } else { 0.0 };
    colour.map(|part| (f64::from(part) + shade.abs() * (end - f64::from(part))).round() as u8)
}

fn distance(one: Rgb, other: Rgb) -> f64 {
    let square = |(one, other): (u8, u8)| (f64::from(one) - f64::from(other)).powi(2);
    one.into_iter().zip(other).map(square).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn a_configured_colour_stays_and_the_palette_leaves_it_out() {
        let vermilion = [0xD5, 0x5E, 0x10];
        assert_eq!(colours_of(&[None, Some(vermilion), None]), [PALETTE[0], vermilion, PALETTE[2]]);
    }

    #[test]
    fn all_dragons_of_a_show_have_different_colours() {
        let colours: BTreeSet<Rgb> = colours_of(&[None; 32]).into_iter().collect();
        assert_eq!(colours.len(), 32);
    }
}
