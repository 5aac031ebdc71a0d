//! The planner: what a choreographer asks before the show.

mod answers;
mod board_variation;
mod chain_variation;
mod cores;
mod derivative;
mod least_clearance;
mod local;
mod parameter;
mod passage;
mod pitch;
mod profile;
mod sensitivity;
mod setting;
mod shortest_turn;
mod speed_limit;
mod staging;
mod strides;
mod timetable;
mod turn;

pub use answers::{Quantity, Unanswered};
pub use board_variation::{BoardVariation, Kink, Witness};
pub use chain_variation::{Change, HandleVariation, handle_variations};
pub use cores::on_one_core;
pub use derivative::Undefined;
pub use least_clearance::{ClosestApproach, least_clearance};
pub use parameter::Parameter;
pub use passage::{Infeasible, passage_through};
pub use pitch::{PitchError, PitchLimit, SmallestPitch, smallest_pitch};
pub use profile::{Found, clearance_profile, near_misses};
pub use sensitivity::{Curve, NoDerivative, Response, Sample, Sensitivity};
pub use setting::Setting;
pub use shortest_turn::{Obstacle, ShortestTurn, shortest_turn};
pub use speed_limit::{LargestRatio, largest_speed_ratio};
pub use staging::Staging;
pub use timetable::HeadTimetable;
pub use turn::{TurnPassage, walk_through};
