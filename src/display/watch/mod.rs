//! The show in a terminal: what is drawn of a scene, and what the keys do.
//!
//! Nothing here knows a terminal. [`draw`] puts a [`Scene`](crate::display::observe::Scene) into a buffer of cells of any size, and a
//! [`Screen`] is all that the one who looks has chosen: where the plan is looked at, what is being typed, which command was
//! answered how. A key gives an [`Action`] for the command `watch` to carry out.

mod alert_filter;
mod alerts;
mod areas;
mod banner;
mod camera;
mod charts;
mod condition;
mod drawing;
mod entry;
mod facts;
mod footer;
mod glyphs;
mod help;
mod keys;
mod lamps;
mod lateness_history;
mod pace;
mod plan;
mod question;
mod reply;
#[cfg(test)]
mod sample;
mod screen;
mod shown;
mod status_line;
mod theme;
mod traffic;
mod wording;

pub use drawing::draw;
pub use glyphs::Glyphs;
pub use keys::Action;
pub use reply::Reply;
pub use screen::{Look, Screen};
pub use shown::Shown;
pub use theme::Theme;
