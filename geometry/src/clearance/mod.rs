//! Clearances of the boards of a dragon, contacts, and proofs about intervals of travel.

mod approach_search;
mod coil_motion;
mod coil_reach;
mod contact;
mod contact_search;
mod course_search;
mod coverage;
mod curve_motion;
mod formation_search;
mod grid;
mod link_motion;
mod near_pairs;
mod pair;
mod pair_motion;
mod pair_tracker;
mod plan_motion;
mod play;
mod pose;
mod proven_course;
mod proven_travel;
mod repeated_walk;
mod search;
mod stage_exit;

pub(crate) use approach_search::{ApproachSearch, Pairs, Piece, ROUNDING_M};
pub use contact::{Contact, PairEvent};
pub use contact_search::{ContactSearch, Sweep, first_contact, first_within};
pub use course_search::CourseSearch;
pub use formation_search::{Meeting, Unfinished, first_meeting};
pub use play::{PlayEnd, PlaySearch, PossibleTouch, TouchingPose, first_possible_touch, first_touching_pose};
pub use proven_course::ProvenCourse;
pub use proven_travel::ProvenTravel;
pub use search::{ClearanceSearch, PairClearance};
pub use stage_exit::{StageExit, first_exit, standing_outside};
