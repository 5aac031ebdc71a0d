//! Pure mathematics of the bench dragon: routes, dragons, clearance, contact, and the planner's questions.
//!
//! Each module knows only those above it in this table:
//!
//! | module | what it is |
//! |---|---|
//! | [`route`] | the curves that the handles follow |
//! | [`dragon`] | the chain of benches on a route, its poses, and how far it can walk |
//! | [`clearance`] | distances of boards, first contact, and proofs over a stretch of travel |
//! | [`planner`] | what a choreographer asks |
//!
//! Nothing here reads a clock or a file, or knows of a bus. Lengths are metres, times seconds, angles radians.

pub mod clearance;
pub mod dragon;
pub mod number;
mod numerics;
pub mod planner;
pub mod route;
