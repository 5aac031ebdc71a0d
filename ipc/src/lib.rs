//! The bench dragon's bus.
pub mod alert;
pub mod frame;
