//! Pure mathematics of the bench dragon: routes, dragons, clearance, contact, and the planner's questions.
//!
//! A module uses only the modules above it in this table:
//!
//! | module | what it is |
//! |---|---|
//! | [`ground`] | ground that is not flat: planes and maps of heights |
//! | [`route`] | the curves that the handles follow |
//! | [`drawing`] | drawn curves, and the routes that follow them |
//! | [`dragon`] | the chain of benches on a route, its poses, and how far it can walk |
//! | [`formation`] | all dragons of a show, and the numbers of their benches and handles |
//! | [`stage`] | the borders of a stage, and how near boards are to them |
//! | [`clearance`] | distances of boards, first contact, and proofs about intervals of travel |
//! | [`planner`] | answers to a choreographer's questions |
//!
//! This crate reads no clock and no file, and does not depend on the bus. Lengths are in metres, times in seconds, angles in
//! radians.

pub mod clearance;
pub mod dragon;
pub mod drawing;
pub mod formation;
pub mod ground;
pub mod number;
mod numerics;
pub mod planner;
pub mod route;
pub mod stage;
