//! Errors of a route.

use std::ops::RangeInclusive;

use thiserror::Error;

use super::GroundGap;
use crate::number::Number;

const MAX_PITCH_M: f64 = 1_000.0;
const MAX_START_TURNS: f64 = 10_000.0;
/// Allowed ratios of the entry arc's radius to the exit arc's radius.
pub const RADIUS_RATIO: RangeInclusive<f64> = 0.01..=100.0;

/// Reason why a route is invalid.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum RouteError {
    /// The pitch is out of range.
    #[error("pitch_m is {}, must be above 0 and at most {MAX_PITCH_M}", Number(*.0))]
    Pitch(f64),
    /// The number of turns from the centre to the start is out of range.
    #[error("start_turns is {}, must be above 0 and at most {MAX_START_TURNS}", Number(*.0))]
    StartTurns(f64),
    /// The diameter of the turning circle is out of range for the spiral.
    #[error(
        "turn_diameter_m is {}, must be above 0 and at most {}, {MAX_START_TURNS} turns of pitch_m {}",
        Number(*turn_diameter_m),
        Number(2.0 * MAX_START_TURNS * pitch_m),
        Number(*pitch_m)
    )]
    TurnDiameter {
        /// Diameter of the turning circle, in metres.
        turn_diameter_m: f64,
        /// Distance between neighbouring turns, in metres.
        pitch_m: f64,
    },
    /// The ratio of the two radii is out of range.
    #[error(
        "radius_ratio is {}, must be from {} to {}",
        Number(*.0),
        RADIUS_RATIO.start(),
        RADIUS_RATIO.end()
    )]
    RadiusRatio(f64),
    /// The line of the S is out of range for the turning circle.
    #[error("turn_line_m is {}, must be 0 or more, and under turn_diameter_m {}", Number(*line_m), Number(*turn_diameter_m))]
    TurnLine {
        /// Length of the line between the arcs, in metres.
        line_m: f64,
        /// Diameter of the turning circle, in metres.
        turn_diameter_m: f64,
    },
    /// The path is invalid.
    #[error(transparent)]
    Path(#[from] super::PathError),
    /// The first segment has a beginning, or another segment has none.
    #[error(
        "segment {segment}: the first segment of a route must have no beginning, every other segment must have one"
    )]
    Beginning {
        /// Index of the segment, from 0.
        segment: usize,
    },
    /// A segment does not begin at the end of the segment before it with the same tangent.
    #[error("segment {segment} does not join the segment before it: gap {gap_m:e} m, tangents differ by {turn:e}")]
    Seam {
        /// Index of the segment, from 0.
        segment: usize,
        /// Distance between the end of the segment before and the beginning of this one, in metres.
        gap_m: f64,
        /// Length of the difference of the two unit tangents.
        turn: f64,
    },
    /// The plan ends after the head has reached the end of the route.
    #[error("end_s is {}, must be at most {}, when the head reaches the end of the route", Number(*end_s), Number(*last_s))]
    EndTime {
        /// Show time at which the plan ends.
        end_s: f64,
        /// Show time at which the head reaches the end of the route.
        last_s: f64,
    },
    /// The plan does not begin before it ends.
    #[error("start_s is {}, must be below {}, when the head reaches the end", Number(*start_s), Number(*end_s))]
    Times {
        /// Show time at which the plan begins.
        start_s: f64,
        /// Show time at which it ends.
        end_s: f64,
    },
    /// The route ends beyond its last segment.
    #[error("the route is walked to {} m, must be at most {}, where its last segment ends", Number(*end_travel_m), Number(*curve_end_m))]
    End {
        /// Travel at the end of the route.
        end_travel_m: f64,
        /// Travel at the end of the last segment.
        curve_end_m: f64,
    },
    /// The route ends before it starts, or one of its ends is not finite.
    #[error(
        "the route is walked from {} to {} m, must be finite and end after its start",
        Number(*start_travel_m),
        Number(*end_travel_m)
    )]
    Span {
        /// Travel at the start.
        start_travel_m: f64,
        /// Travel at the end.
        end_travel_m: f64,
    },
    /// The ground ends where travel is measured from.
    #[error("{0}: travel is measured from there")]
    Ground(#[from] GroundGap),
    /// The profile of the route on its ground has too many pieces.
    #[error(
        "the route is too long for its ground: use fewer benches, a shorter route, or heights with a larger spacing"
    )]
    LongOnGround,
}

impl RouteError {
    pub(super) fn check_pitch(pitch_m: f64) -> Result<(), Self> {
        if pitch_m > 0.0 && pitch_m <= MAX_PITCH_M { Ok(()) } else { Err(Self::Pitch(pitch_m)) }
    }

    pub(super) fn check_start_turns(start_turns: f64) -> Result<(), Self> {
        if start_turns > 0.0 && start_turns <= MAX_START_TURNS { Ok(()) } else { Err(Self::StartTurns(start_turns)) }
    }

    pub(super) fn check_turn_diameter(turn_diameter_m: f64, pitch_m: f64) -> Result<(), Self> {
        let allowed = turn_diameter_m > 0.0 && turn_diameter_m <= 2.0 * MAX_START_TURNS * pitch_m;
        if allowed { Ok(()) } else { Err(Self::TurnDiameter { turn_diameter_m, pitch_m }) }
    }

    pub(super) fn check_radius_ratio(radius_ratio: f64) -> Result<(), Self> {
        if RADIUS_RATIO.contains(&radius_ratio) { Ok(()) } else { Err(Self::RadiusRatio(radius_ratio)) }
    }

    pub(super) fn check_turn_line(line_m: f64, turn_diameter_m: f64) -> Result<(), Self> {
        let allowed = line_m >= 0.0 && line_m < turn_diameter_m;
        if allowed { Ok(()) } else { Err(Self::TurnLine { line_m, turn_diameter_m }) }
    }

    pub(super) fn check_span(start_travel_m: f64, end_travel_m: f64) -> Result<(), Self> {
        let allowed = start_travel_m.is_finite() && end_travel_m.is_finite() && start_travel_m < end_travel_m;
        if allowed { Ok(()) } else { Err(Self::Span { start_travel_m, end_travel_m }) }
    }
}
