//! The planner: what a choreographer asks before the show.

mod passage;
mod peak;
mod speed_limit;

pub use passage::{Infeasible, passage_through};
pub use speed_limit::{LargestRatio, largest_speed_ratio};
