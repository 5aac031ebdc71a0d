//! Why a path is invalid, and the limits that its errors name.

/// Shortest arc or spiral, in metres.
pub(super) const MIN_LENGTH_M: f64 = 1e-6;
/// Longest path, in metres.
pub(super) const MAX_LENGTH_M: f64 = 1_000_000.0;
/// Most segments of a path, all laps included.
pub(super) const MAX_SEGMENTS: usize = 100_000;
/// Largest gap between the end and the beginning of a closed path as planned, in metres.
pub(super) const CLOSING_GAP_M: f64 = 1e-3;
/// Largest difference of direction between the end and the beginning of a closed path as planned, in radians.
pub(super) const CLOSING_TURN: f64 = 1e-4;

/// Reason why a path is invalid. Segments are numbered from 1.
#[derive(Clone, Copy, Debug, thiserror::Error, PartialEq)]
pub enum PathError {
    /// There is no segment.
    #[error("a path needs at least one segment")]
    Empty,
    /// A number of a segment is out of range.
    #[error("segment {segment}: {key} is {}, must be {allowed}", crate::number::Number(*value))]
    Value {
        /// Number of the segment.
        segment: usize,
        /// Key of the configuration.
        key: &'static str,
        /// The value, in the unit of the key.
        value: f64,
        /// Allowed values, in words.
        allowed: &'static str,
    },
    /// A segment is too short.
    #[error("segment {segment} is {} m long, must be at least {MIN_LENGTH_M} m", crate::number::Number(*length_m))]
    TooShort {
        /// Number of the segment.
        segment: usize,
        /// Its length in metres.
        length_m: f64,
    },
    /// The path is too long.
    #[error("the path is longer than {MAX_LENGTH_M} m from segment {segment} on, all laps included")]
    TooLong {
        /// Number of the segment.
        segment: usize,
    },
    /// The path has too many segments.
    #[error(
        "the path has {segments} segments with all laps, and those on which the dragon stands, must have at most {MAX_SEGMENTS}"
    )]
    TooMany {
        /// Number of segments.
        segments: usize,
    },
    /// A closed path does not close.
    #[error(
        "closed: the end is {gap_m:.6} m from the beginning and turned by {turn_deg:.6}°, \
         must be at most {CLOSING_GAP_M} m and {:.6}°",
        CLOSING_TURN.to_degrees()
    )]
    Open {
        /// Distance between the end and the beginning, in metres.
        gap_m: f64,
        /// Angle between the two directions, in degrees.
        turn_deg: f64,
    },
    /// No small change of the measures of a closed path closes it.
    #[error("closed: no small change of lengths, radii and angles joins the end to the beginning, {gap_m:.6} m away")]
    Unclosable {
        /// Distance between the end and the beginning as planned, in metres.
        gap_m: f64,
    },
}
