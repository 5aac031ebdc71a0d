//! The show in a terminal: how a snapshot is drawn, and what the keys do.
//!
//! Nothing here knows a terminal. [`draw`] puts a [`Snapshot`](super::observe::Snapshot) into a buffer of cells of any size. A
//! [`Screen`] is all that its user has chosen: where the plan is looked at, what is being typed, the outcome of the last command.
//! A key gives a [`KeyAction`] for the command `watch` to carry out.

mod alerts;
mod camera;
mod charts;
mod drawing;
mod footer;
mod header;
mod keys;
mod look;
mod overlays;
mod panel;
mod plan;
mod prompt;
#[cfg(test)]
mod sample;
mod screen;
mod speed_steps;

pub use drawing::draw;
pub use footer::CommandOutcome;
pub use keys::KeyAction;
pub use look::{Glyphs, Look, Theme};
pub use screen::{Appearance, Screen};
