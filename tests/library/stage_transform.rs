//! The transform to a desk's coordinate system, compared with matrices and quaternions.

use std::f64::consts::{FRAC_PI_2, PI};

use bench_dragon::bridge::stage_transform::{
    StageOffset, StageOffsetError, StageRotation, StageRotationError, StageTransform,
};
use bench_dragon::bridge::{AxisOrder, AxisOrderError};
use glam::{DMat3, DQuat, DVec3};

fn axes(text: &str) -> AxisOrder {
    text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn transform(offset: &str, rotation: &str, order: &str) -> StageTransform {
    let (offset, rotation) = (offset.parse().expect("an offset"), rotation.parse().expect("a rotation"));
    StageTransform::new(offset, rotation, axes(order))
}

/// Returns all 48 orders and signs of axes, with the matrix of each.
fn all_axes() -> Vec<(String, DMat3)> {
    let letters = ["x", "y", "z"];
    let mut all = Vec::new();
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        for signs in 0..8 {
            let sign = |number: usize| if signs >> number & 1 == 1 { -1.0 } else { 1.0 };
            let name =
                |number: usize| format!("{}{}", if sign(number) < 0.0 { "-" } else { "" }, letters[order[number]]);
            let rows = [0, 1, 2].map(|number| DVec3::AXES[order[number]] * sign(number));
            all.push(([0, 1, 2].map(name).join(","), DMat3::from_cols(rows[0], rows[1], rows[2]).transpose()));
        }
    }
    all
}

#[track_caller]
fn assert_near(actual: impl Into<DVec3>, expected: DVec3, what: &str) {
    let actual = actual.into();
    assert!(actual.distance(expected) < 1e-12, "{what}: {actual}, not {expected}");
}

#[test]
fn a_position_is_rotated_then_moved_then_reordered() {
    let (position, offset) = (DVec3::new(3.0, -4.0, 0.5), DVec3::new(10.0, -20.0, 30.0));
    for (order, matrix) in all_axes() {
        for degrees in [0.0, 30.0, 90.0, -135.0, 180.0, 360.0] {
            let transform = transform("10,-20,30", &degrees.to_string(), &order);
            let rotation = DMat3::from_rotation_z(f64::to_radians(degrees));
            let what = format!("{order}, {degrees} degrees");
            assert_near(transform.position_m(position.into()), matrix * (rotation * position + offset), &what);
            assert_near(transform.velocity_mps(position.into()), matrix * (rotation * position), &what);
        }
    }
}

#[test]
fn the_horizontal_direction_of_a_board_is_the_cosine_and_the_sine_of_its_heading() {
    for (order, matrix) in all_axes() {
        let vertical = (matrix * DVec3::Z).abs().to_array().into_iter().position(|value| value == 1.0);
        for (rotation, heading) in [(0.0, 0.3), (90.0, 2.5), (-360.0, -3.0), (200.0, PI), (47.0, -PI)] {
            let desk_heading = transform("1,2,3", &rotation.to_string(), &order).heading_rad(heading);
            assert!(desk_heading.abs() <= PI, "{desk_heading}");
            let angle = heading + f64::to_radians(rotation);
            let mut direction = (matrix * DVec3::new(angle.cos(), angle.sin(), 0.0)).to_array().to_vec();
            direction.remove(vertical.expect("one axis is vertical"));
            let expected = DVec3::new(direction[0], direction[1], 0.0);
            assert_near([desk_heading.cos(), desk_heading.sin(), 0.0], expected, &order);
        }
    }
}

#[test]
fn the_orientation_turns_the_first_horizontal_axis_into_the_direction_of_the_board() {
    for (order, matrix) in all_axes() {
        let up = (matrix * DVec3::Z).abs();
        let first = if up == DVec3::X { DVec3::Y } else { DVec3::X };
        for step in -8..=8 {
            let heading = f64::from(step) * PI / 8.0;
            let orientation = DVec3::from(transform("0,0,0", "25", &order).orientation_rad(heading, 0.0));
            let angle = heading + f64::to_radians(25.0);
            let direction = matrix * DVec3::new(angle.cos(), angle.sin(), 0.0);
            assert_near(DQuat::from_scaled_axis(orientation) * first, direction, &order);
        }
    }
}

#[test]
fn the_orientation_of_a_pitched_board_keeps_it_level_across() {
    for (order, matrix) in all_axes() {
        let up = (matrix * DVec3::Z).abs();
        let [first, second] = if up == DVec3::X {
            [DVec3::Y, DVec3::Z]
        } else if up == DVec3::Y {
            [DVec3::X, DVec3::Z]
        } else {
            [DVec3::X, DVec3::Y]
        };
        for (heading, pitch) in [(0.0, 0.3), (1.0, -0.2), (-2.5, 0.7), (PI, 0.1)] {
            let orientation = DVec3::from(transform("0,0,0", "25", &order).orientation_rad(heading, pitch));
            let (angle, turn) = (heading + f64::to_radians(25.0), DQuat::from_scaled_axis(orientation));
            let level = DVec3::new(angle.cos(), angle.sin(), 0.0);
            assert_near(turn * first, matrix * (pitch.cos() * level + pitch.sin() * DVec3::Z), &order);
            assert!((turn * second).dot(matrix * DVec3::Z).abs() < 1e-12, "{order}");
        }
    }
}

#[test]
fn a_mirroring_order_reverses_rotations() {
    let heading = |order| transform("0,0,0", "0", order).heading_rad(0.5);
    assert_eq!((heading("x,y,z"), heading("x,-y,z"), heading("x,z,y")), (0.5, -0.5, 0.5));
    let orientation = |order| transform("0,0,0", "0", order).orientation_rad(0.5, 0.0);
    assert_eq!(orientation("x,y,z"), [0.0, 0.0, 0.5]);
    assert_eq!(orientation("x,z,y"), [0.0, -0.5, 0.0]);
    // Right-handed with y up, as in many renderers.
    assert_eq!(orientation("x,z,-y"), [0.0, 0.5, 0.0]);
    assert_eq!(orientation("y,x,z"), [0.0, 0.0, FRAC_PI_2 - 0.5]);
}

#[test]
fn quarter_turns_are_exact() {
    let turned = |degrees: &str| transform("0,0,0", degrees, "x,y,z").position_m([3.0, 1.0, 2.0]);
    for (degrees, expected) in [
        ("90", [-1.0, 3.0, 2.0]),
        ("180", [-3.0, -1.0, 2.0]),
        ("270", [1.0, -3.0, 2.0]),
        ("-90", [1.0, -3.0, 2.0]),
        ("360", [3.0, 1.0, 2.0]),
    ] {
        assert_eq!(turned(degrees), expected, "{degrees}");
    }
}

#[test]
fn only_complete_orders_of_axes_are_accepted() {
    for text in ["", "x", "x,y", "x,y,z,x", "x,x,z", "x,-x,z", "X,Y,Z", "x, y,z", "x,y,+z", "x,y,--z", "xyz", "x,y,"] {
        assert_eq!(text.parse::<AxisOrder>(), Err(AxisOrderError), "{text}");
    }
    for (text, _) in all_axes() {
        assert_eq!(axes(&text).to_string(), text);
    }
    assert_eq!(axes("x,z,y"), AxisOrder::RIGHT_UP_AWAY);
    assert_eq!(axes("x,y,z"), AxisOrder::RIGHT_AWAY_UP);
}

#[test]
fn only_finite_offsets_and_rotations_of_a_stage_are_accepted() {
    for text in ["", "1", "1,2", "1,2,3,4", "1,2,x", "nan,0,0", "inf,0,0", "0,0,10000.5", "1, 2,3"] {
        assert_eq!(text.parse::<StageOffset>(), Err(StageOffsetError), "{text}");
    }
    for text in ["", "x", "nan", "inf", "360.1", "-361", "90deg"] {
        assert_eq!(text.parse::<StageRotation>(), Err(StageRotationError), "{text}");
    }
    assert_eq!("-1.5,2,1e3".parse().map(|offset: StageOffset| offset.to_string()), Ok("-1.5,2,1000".to_owned()));
    assert_eq!("-22.5".parse().map(|rotation: StageRotation| rotation.to_string()), Ok("-22.5".to_owned()));
}
