//! The planner answers a choreographer's questions before the show.

mod answers;
mod board_variation;
mod chain_variation;
mod cores;
mod derivative;
mod infeasible;
mod least_clearance;
mod local;
mod obstacle;
mod passage;
mod pitch;
mod profile;
mod route_survey;
mod sensitivity;
mod setting;
mod shortest_turn;
mod speed_limit;
mod strides;
mod turn_line;

pub use answers::{Quantity, Unanswered};
pub use board_variation::{BoardVariation, Undefined, Witness};
pub use chain_variation::{Change, HandleVariation, handle_variations};
pub use cores::on_one_core;
pub use infeasible::Infeasible;
pub use least_clearance::{ClosestApproach, least_clearance};
pub use obstacle::Obstacle;
pub use passage::{Staging, TurnPassage, passage_through, walk_through};
pub use pitch::{PitchError, PitchLimit, SmallestPitch, guaranteed_pitch, smallest_pitch};
pub use profile::{Found, clearance_profile, near_misses};
pub use route_survey::RouteSurvey;
pub use sensitivity::{Curve, NoDerivative, Response, Sample, Sensitivity};
pub use setting::{Parameter, Setting};
pub use shortest_turn::{ShortestTurn, shortest_turn};
pub use speed_limit::{LargestRatio, first_faster, largest_speed_ratio};
pub use turn_line::shortest_turn_with_line;
