//! The course of a formation: the one number on which the place of every dragon depends, in metres.

/// The meaning of the number of a course.
///
/// Of one dragon it is the travel of its head. Of several it is plan time × the planned speed of the leading dragon: the travel of a
/// head that walks at that speed throughout. So a course has a unit and a size that limits, grants and speeds can be stated in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Course {
    /// The travel of the head of the only dragon.
    Travel,
    /// Plan time × this speed. At `end_s` all dragons have reached their ends.
    Plan { speed_mps: f64, begin_s: f64, end_s: f64 },
}

/// A dragon of a formation at one place of the course.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadAt {
    /// Travel of its head in metres.
    pub travel_m: f64,
    /// Speed of its head in metres per show second.
    pub speed_mps: f64,
    /// Whether it has reached its end.
    pub has_ended: bool,
}
