//! The displays of a show: one observer, and the browser page, the terminal and the Prometheus metrics that show its snapshots.

pub mod metrics;
pub mod observe;
pub mod view;
pub mod watch;
pub mod web;
