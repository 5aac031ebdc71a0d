//! What people look at: one observer of a show, and what the browser page, the terminal and Prometheus make of it.

pub mod metrics;
pub mod observe;
pub mod view;
pub mod watch;
pub mod web;
