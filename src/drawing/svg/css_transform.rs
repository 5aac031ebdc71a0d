//! Values of `transform`: of the CSS property, with units, and of the attribute, without.
//!
//! Browsers ignore a value that breaks the grammar of its place, so it must not be applied here either.
//!
//! Source: W3C *CSS Transforms Module Level 1*, also its section "Syntax of the SVG transform attribute", and *CSS Values and Units
//! Module Level 3*.

use std::f64::consts::{PI, TAU};
use std::str::FromStr as _;

use glam::{DAffine2, DMat2, DVec2};

/// Most functions of a value.
const MAX_FUNCTIONS: usize = 1000;

/// Whether a browser would ignore a value in a style, since a length or an angle other than 0 has no unit. In an attribute it needs none.
pub(super) fn lacks_unit(value: &str) -> bool {
    let functions = value.split(')').filter_map(|function| function.split_once('('));
    let mut arguments = functions.filter(|(name, _)| needs_units(name)).flat_map(|(_, arguments)| split(arguments));
    arguments.any(is_without_unit)
}

/// The same for a value of `transform-origin`.
pub(super) fn origin_lacks_unit(value: &str) -> bool {
    split(value).any(is_without_unit)
}

fn is_without_unit(argument: &str) -> bool {
    with_unit(argument).is_some_and(|(number, unit)| unit.is_empty() && number != 0.0)
}

fn needs_units(function: &str) -> bool {
    let name = function.trim_matches([' ', '\t', '\n', '\r', ',']).to_ascii_lowercase();
    ["translate", "rotate", "skew"].iter().any(|kind| name.starts_with(kind))
}

/// The arguments of a function.
fn split(arguments: &str) -> impl Iterator<Item = &str> {
    arguments.split([',', ' ', '\t', '\n', '\r']).filter(|argument| !argument.is_empty())
}

/// The map of a value of the attribute; `None` for one that is not known.
pub(super) fn of_attribute(value: &str) -> Option<DAffine2> {
    // svgtypes also reads a comma with nothing behind it.
    let mut behind_commas = value.split(',').skip(1).map(str::trim_start);
    if behind_commas.any(|behind| behind.is_empty() || behind.starts_with(')')) {
        return None;
    }
    let svgtypes::Transform { a, b, c, d, e, f } = svgtypes::Transform::from_str(value).ok()?;
    Some(DAffine2::from_cols_array(&[a, b, c, d, e, f])).filter(DAffine2::is_finite)
}

/// The map of a value of the property; `None` for one that is not known.
pub(super) fn of_style(value: &str) -> Option<DAffine2> {
    let mut map = DAffine2::IDENTITY;
    let mut rest = Some(value.trim()).filter(|value| !value.is_empty())?;
    for _ in 0..MAX_FUNCTIONS {
        if rest.is_empty() {
            return Some(map).filter(DAffine2::is_finite);
        }
        let (name, behind) = rest.split_once('(')?;
        let (arguments, behind) = behind.split_once(')')?;
        let arguments: Vec<&str> = arguments.split(',').map(str::trim).collect();
        map *= function(&name.to_ascii_lowercase(), &arguments)?;
        rest = behind.trim_start();
    }
    None
}

fn function(name: &str, arguments: &[&str]) -> Option<DAffine2> {
    let (length, angle) = (|at: usize| length(arguments.get(at)?), |at: usize| angle(arguments.get(at)?));
    let number = |at: usize| scale(arguments.get(at)?);
    let or = |at: usize, other: f64, value: Option<f64>| if at < arguments.len() { value } else { Some(other) };
    let most = |count: usize| (arguments.len() <= count).then_some(());
    Some(match name {
        "translate" => {
            most(2)?;
            DAffine2::from_translation(DVec2::new(length(0)?, or(1, 0.0, length(1))?))
        }
        "translatex" => {
            most(1)?;
            DAffine2::from_translation(DVec2::new(length(0)?, 0.0))
        }
        "translatey" => {
            most(1)?;
            DAffine2::from_translation(DVec2::new(0.0, length(0)?))
        }
        "scale" => {
            most(2)?;
            let x = number(0)?;
            DAffine2::from_scale(DVec2::new(x, or(1, x, number(1))?))
        }
        "scalex" => {
            most(1)?;
            DAffine2::from_scale(DVec2::new(number(0)?, 1.0))
        }
        "scaley" => {
            most(1)?;
            DAffine2::from_scale(DVec2::new(1.0, number(0)?))
        }
        "rotate" | "rotatez" => {
            most(1)?;
            DAffine2::from_angle(angle(0)?)
        }
        "skew" => {
            most(2)?;
            skewed(angle(0)?, or(1, 0.0, angle(1))?)
        }
        "skewx" => {
            most(1)?;
            skewed(angle(0)?, 0.0)
        }
        "skewy" => {
            most(1)?;
            skewed(0.0, angle(0)?)
        }
        "matrix" if arguments.len() == 6 => {
            let plain = |text: &&str| with_unit(text).filter(|(_, unit)| unit.is_empty()).map(|(number, _)| number);
            let numbers: Option<Vec<f64>> = arguments.iter().map(plain).collect();
            DAffine2::from_cols_slice(&numbers?)
        }
        _ => return None,
    })
}

fn skewed(x: f64, y: f64) -> DAffine2 {
    DAffine2::from_mat2(DMat2::from_cols_array(&[1.0, y.tan(), x.tan(), 1.0]))
}

/// A number and its unit, in lower case.
fn with_unit(text: &str) -> Option<(f64, String)> {
    let text = text.trim().to_ascii_lowercase();
    // An `e` is a part of the number where digits follow.
    let unit_at = text.char_indices().find(|&(at, char)| {
        let follows = text[at..].chars().nth(1);
        let is_exponent = char == 'e' && follows.is_some_and(|next| next.is_ascii_digit() || "+-".contains(next));
        !(char.is_ascii_digit() || "+-.".contains(char) || is_exponent)
    });
    let (number, unit) = text.split_at(unit_at.map_or(text.len(), |(at, _)| at));
    // Rust reads numbers such as `2.` too.
    if number.split('.').skip(1).any(|decimals| !decimals.starts_with(|char: char| char.is_ascii_digit())) {
        return None;
    }
    let number: f64 = number.parse().ok().filter(|number: &f64| number.is_finite())?;
    Some((number, unit.to_owned()))
}

/// A length in pixels.
fn length(text: &&str) -> Option<f64> {
    let (number, unit) = with_unit(text)?;
    let pixels = match &*unit {
        "" if number != 0.0 => return None,
        "" | "px" => 1.0,
        "in" => 96.0,
        "cm" => 96.0 / 2.54,
        "mm" => 96.0 / 25.4,
        "q" => 96.0 / 101.6,
        "pt" => 96.0 / 72.0,
        "pc" => 16.0,
        _ => return None,
    };
    Some(number * pixels)
}

/// An angle in radians.
fn angle(text: &&str) -> Option<f64> {
    let (number, unit) = with_unit(text)?;
    let radians = match &*unit {
        "" if number != 0.0 => return None,
        "" | "deg" => PI / 180.0,
        "grad" => PI / 200.0,
        "rad" => 1.0,
        "turn" => TAU,
        _ => return None,
    };
    Some(number * radians)
}

/// A number or a share in per cent.
fn scale(text: &&str) -> Option<f64> {
    match with_unit(text)? {
        (number, unit) if unit.is_empty() => Some(number),
        (number, unit) if unit == "%" => Some(number / 100.0),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_function_and_unit_has_its_map() {
        for (value, point, expected) in [
            ("translate(20px, 0px) scale(2)", [40.0, 40.0], [100.0, 80.0]),
            ("translate(1in)", [0.0, 1.0], [96.0, 1.0]),
            ("translateX(2.54cm) translateY(25.4mm)", [0.0, 0.0], [96.0, 96.0]),
            ("translate(72pt,6pc)", [0.0, 0.0], [96.0, 96.0]),
            ("rotate(90deg)", [1.0, 0.0], [0.0, 1.0]),
            ("rotate(.25turn)", [1.0, 0.0], [0.0, 1.0]),
            ("rotate(100grad)", [1.0, 0.0], [0.0, 1.0]),
            ("rotate(1.5707963267948966rad)", [1.0, 0.0], [0.0, 1.0]),
            ("scale(50%, 3)", [2.0, 1.0], [1.0, 3.0]),
            ("scaleX(2) scaleY(3)", [1.0, 1.0], [2.0, 3.0]),
            ("skewX(45deg)", [0.0, 1.0], [1.0, 1.0]),
            ("skewY(45deg)", [1.0, 0.0], [1.0, 1.0]),
            ("skew(45deg, 0)", [0.0, 1.0], [1.0, 1.0]),
            ("matrix(1, 0, 0, 1, 2e1, 3)scale(1)", [0.0, 0.0], [20.0, 3.0]),
        ] {
            let map = of_style(value).expect(value);
            assert!(map.transform_point2(point.into()).distance(expected.into()) < 1e-9, "{value}");
        }
    }

    #[test]
    fn an_attribute_has_numbers_without_units_in_the_grammar_of_svg() {
        for (value, expected) in [
            ("scale(2 3)", [2.0, 3.0]),
            ("scale (2),scale(1.5)", [3.0, 3.0]),
            ("translate(10-5)", [11.0, -4.0]),
            ("rotate(90 1 1)", [1.0, 1.0]),
            ("matrix(2 0 0 2 0 0) scale(.5.5)", [1.0, 1.0]),
        ] {
            let point = of_attribute(value).expect(value).transform_point2(DVec2::ONE);
            assert!(point.distance(expected.into()) < 1e-9, "{value}: {point}");
        }
        for value in [
            "translate(10px,5px)",
            "rotate(10deg)",
            "rotate(1rad)",
            "rotate(10,5)",
            "scaleX(2)",
            "SCALE(2)",
            "scale(2),",
            "scale(2,)",
            "scale(2),,scale(2)",
            "scale(50%)",
        ] {
            assert_eq!(of_attribute(value), None, "{value}");
        }
    }

    #[test]
    fn lengths_and_angles_of_a_style_need_a_unit() {
        for value in
            ["rotate(90)", "translate(3px, 4)", "scale(2) skewX(10)", "Rotate( 1e1 )", "translateX(5) rotate(0)"]
        {
            assert!(lacks_unit(value), "{value}");
        }
        for value in [
            "rotate(90deg)",
            "translate(0, 4px)",
            "scale(2)",
            "matrix(1, 0, 0, 1, 5, 6)",
            "rotate(0)",
            "none",
            "rotate",
        ] {
            assert!(!lacks_unit(value), "{value}");
        }
        assert!(origin_lacks_unit("100") && origin_lacks_unit("left 5"));
        assert!(!origin_lacks_unit("0 0") && !origin_lacks_unit("50% 3px") && !origin_lacks_unit("center"));
    }

    #[test]
    fn values_that_need_more_than_numbers_are_unknown() {
        for value in [
            "translate(50%)",
            "translate(calc(1px + 2px))",
            "translate(2em)",
            "rotate(1px)",
            "scale(1px)",
            "translate3d(1px, 2px, 3px)",
            "var(--move)",
            "translate(1px",
            "scale()",
            "scale(1, 2, 3)",
            "rotate",
            "",
            "scale(2 3)",
            "scale(2,)",
            "scale(2), scale(2)",
            "scale (2)",
            "scale(2) !ie",
            "scale(2.)",
            "matrix(2 0 0 2 0 0)",
            "matrix(1,0,0,1,10px,0)",
            "translate(10px 5px)",
            "translate(10px, 5)",
            "rotate(10)",
            "rotate(10deg, 50px, 50px)",
        ] {
            assert_eq!(of_style(value), None, "{value}");
        }
    }
}
