//! The order and the signs of a desk's axes.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt;
use std::str::FromStr;

/// Number of the bus's vertical axis.
const VERTICAL: usize = 2;
const LETTERS: [char; 3] = ['x', 'y', 'z'];

/// A desk's three axes in the desk's order. Each is another axis of the bus, or its opposite.
///
/// As text, `x,-z,y` is a desk whose x is our x (right), whose y is the opposite of our z (down), and whose z is our y (away).
///
/// ```
/// use bench_dragon::bridge::AxisOrder;
///
/// let order: AxisOrder = "x,-z,y".parse()?;
/// assert_eq!(order.reorder([1.0, 2.0, 3.0]), [1.0, -3.0, 2.0]);
/// assert_eq!(order.in_words(), "x right, y down, z away");
/// # Ok::<(), bench_dragon::bridge::AxisOrderError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisOrder([Axis; 3]);

/// One axis of a desk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Axis {
    /// Number of the bus's axis: 0 right, 1 away, 2 up.
    bus_axis: usize,
    is_reversed: bool,
}

/// Error for a text that is not an order of axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be x, y and z in some order, each once and optionally after a -, such as x,z,y or -x,y,z")]
pub struct AxisOrderError;

impl AxisOrder {
    /// The bus's own axes: x right, y away, z up.
    pub const RIGHT_AWAY_UP: Self = Self([Axis::along(0), Axis::along(1), Axis::along(2)]);
    /// x right, y up, z away.
    pub const RIGHT_UP_AWAY: Self = Self([Axis::along(0), Axis::along(2), Axis::along(1)]);

    /// Returns a vector's components along the desk's axes.
    pub fn reorder(self, vector: [f64; 3]) -> [f64; 3] {
        self.0.map(|axis| axis.sign() * vector[axis.bus_axis])
    }

    /// The desk's axes with their directions, such as "x right, y up, z away".
    pub fn in_words(self) -> String {
        let named = |(letter, axis): (char, Axis)| format!("{letter} {}", axis.direction());
        LETTERS.into_iter().zip(self.0).map(named).collect::<Vec<_>>().join(", ")
    }

    /// The letters of the desk's two horizontal axes, in the desk's order.
    pub fn horizontal_letters(self) -> [char; 2] {
        self.horizontal().map(|number| LETTERS[number])
    }

    /// Angle of our +x in the desk's horizontal plane: a multiple of π/2, in radians.
    pub(super) fn angle_of_plus_x_rad(self) -> f64 {
        let [first, second] = self.horizontal().map(|number| self.0[number]);
        match (first.bus_axis, first.is_reversed, second.is_reversed) {
            (0, false, _) => 0.0,
            (0, true, _) => PI,
            (_, _, false) => FRAC_PI_2,
            (_, _, true) => -FRAC_PI_2,
        }
    }

    /// 1 if a turn from the desk's first horizontal axis to its second one is counter-clockwise seen from above, else −1.
    pub(super) fn turn_sign(self) -> f64 {
        let [first, second] = self.horizontal().map(|number| self.0[number]);
        let swapped = if first.bus_axis == 0 { 1.0 } else { -1.0 };
        swapped * first.sign() * second.sign()
    }

    /// Returns the rotation vector that turns the desk's first horizontal axis by an angle towards the second one.
    ///
    /// The vector is the angle times the cross product of the two axes. That product is ± the vertical axis: x × y = z,
    /// y × z = x, but x × z = −y.
    pub(super) fn rotation_vector(self, angle_rad: f64) -> [f64; 3] {
        let vertical = self.vertical();
        let sign = if vertical == 1 { -1.0 } else { 1.0 };
        let mut vector = [0.0; 3];
        vector[vertical] = sign * angle_rad;
        vector
    }

    /// Returns the rotation vector that turns the desk's first horizontal axis upwards by an angle: the angle times the cross
    /// product of that axis and the upward direction.
    pub(super) fn pitch_vector(self, angle_rad: f64) -> [f64; 3] {
        let ([first, second], vertical) = (self.horizontal(), self.vertical());
        let is_cyclic = (first + 1) % 3 == vertical;
        let mut vector = [0.0; 3];
        vector[second] = if is_cyclic { angle_rad } else { -angle_rad } * self.0[vertical].sign();
        vector
    }

    /// Number of the desk's vertical axis.
    fn vertical(self) -> usize {
        self.0.iter().position(|axis| axis.bus_axis == VERTICAL).expect("each axis occurs once")
    }

    /// Numbers of the desk's horizontal axes, ascending.
    fn horizontal(self) -> [usize; 2] {
        [[1, 2], [0, 2], [0, 1]][self.vertical()]
    }
}

impl Axis {
    const fn along(bus_axis: usize) -> Self {
        Self { bus_axis, is_reversed: false }
    }

    fn parse(text: &str) -> Option<Self> {
        let (letter, is_reversed) = text.strip_prefix('-').map_or((text, false), |letter| (letter, true));
        let bus_axis = ["x", "y", "z"].iter().position(|name| *name == letter)?;
        Some(Self { bus_axis, is_reversed })
    }

    fn sign(self) -> f64 {
        if self.is_reversed { -1.0 } else { 1.0 }
    }

    fn direction(self) -> &'static str {
        let [along, against] = [["right", "left"], ["away", "towards the audience"], ["up", "down"]][self.bus_axis];
        if self.is_reversed { against } else { along }
    }
}

impl FromStr for AxisOrder {
    type Err = AxisOrderError;

    fn from_str(text: &str) -> Result<Self, AxisOrderError> {
        let axes: Option<Vec<Axis>> = text.split(',').map(Axis::parse).collect();
        let axes: [Axis; 3] = axes.and_then(|axes| axes.try_into().ok()).ok_or(AxisOrderError)?;
        let is_complete = (0..3).all(|number| axes.iter().any(|axis| axis.bus_axis == number));
        if is_complete { Ok(Self(axes)) } else { Err(AxisOrderError) }
    }
}

impl fmt::Display for AxisOrder {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |axis: Axis| format!("{}{}", if axis.is_reversed { "-" } else { "" }, LETTERS[axis.bus_axis]);
        formatter.pad(&self.0.map(name).join(","))
    }
}
