//! The show in a terminal: drawing of a snapshot, and handling of keys.
//!
//! No code here accesses a terminal. [`draw`] draws a [`Snapshot`](super::observe::Snapshot) into a buffer of cells of any
//! size. A [`Screen`] holds the user's choices: the part of the plan in view, a number being typed, the outcome of the last
//! command. A key results in a [`KeyAction`], which the command `watch` executes.

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
