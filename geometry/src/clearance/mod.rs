//! Clearances of the boards of a dragon, contacts, and proofs about intervals of travel.

mod approach_search;
mod bench_search;
mod board_tree;
mod border_search;
mod breach_ground;
mod coil_reach;
mod contact;
mod contact_search;
mod course_search;
mod coverage;
mod curve_motion;
mod delay_search;
mod formation_search;
mod grid;
mod link_motion;
mod meeting_zone;
mod near_ground;
mod near_pairs;
mod near_spans;
mod own_time;
mod pair;
mod pair_motion;
mod pair_tracker;
mod plan_motion;
mod play;
mod pose;
mod proven_borders;
mod proven_course;
mod proven_travel;
mod repeated_walk;
mod search;
mod spiral_motion;
mod stride_extent;
mod swept_area;

pub(crate) use approach_search::{ApproachSearch, Pairs, Piece, ROUNDING_M};
pub use border_search::{
    Breach, LeastDistance, Standing, first_breach, least_distance, nearest_to_borders, standing_at,
};
pub use breach_ground::{BreachGround, HandlePlaces, Passage};
pub use contact::{Contact, PairEvent};
pub(crate) use contact_search::clear_to_m;
pub use contact_search::{ContactSearch, Sweep, first_contact, first_within};
pub use course_search::CourseSearch;
pub use formation_search::{Meeting, Unfinished, first_between, first_meeting, standing_in_each_other};
pub use meeting_zone::{DragonPair, MeetingZone, Tip};
pub(crate) use near_ground::NearGround;
pub use own_time::Nearest;
pub(crate) use play::first_leading_touch;
pub use play::{
    PlayEnd, PlaySearch, PossibleTouch, TouchingPose, first_possible_touch, first_touching_pose, most_play_reach_m,
    play_reach_m,
};
pub use proven_course::{ProvenCourse, Violation};
pub use proven_travel::ProvenTravel;
pub use search::{ClearanceSearch, PairClearance};
pub use swept_area::SweptArea;
