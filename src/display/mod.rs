//! The displays of a show: one observer, and the browser page, the terminal, Foxglove and the Prometheus metrics that show its snapshots.
//! The planner's page needs no show.

pub mod foxglove;
pub mod metrics;
pub mod observe;
pub mod planner;
pub mod view;
pub mod watch;
pub mod web;
