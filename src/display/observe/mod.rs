//! What a person who looks at the show has to see: everything that is on the bus, and what follows from it, at one instant.
//!
//! An [`Observer`] reads a bus for as long as it is let, and shows a [`Scene`] some sixty times a second. It is a reader as any
//! other, woken by every frame, so that it counts the frames and times them all; what is drawn of them is the newest. The
//! nearest pair it works out itself, of the frame that the scene shows, and so it does the forecast: both are there without a
//! monitor. Who draws (`view`, `watch`) and who counts (`metrics`) gets the same scenes.

mod alert_log;
mod clearance_chart;
mod clearance_planner;
mod command_history;
mod controls;
mod course;
mod guard_situation;
mod lamp;
mod link;
mod observer;
mod outlook;
mod planned_clearance;
mod ports;
mod reader_log;
mod run;
mod scene;
mod sight;
mod traffic;
mod travel_clock;
mod walking_speed;
mod watched_run;

pub use alert_log::{AlertLog, NumberedAlert};
pub use clearance_chart::ClearanceChart;
pub use command_history::{CommandHistory, NumberedCommand};
pub use controls::Controls;
pub use course::Arrival;
pub use guard_situation::GuardSituation;
pub use lamp::{Lamp, LampLevel, lamps};
pub use link::Link;
pub use observer::Observer;
pub use outlook::Outlook;
pub use planned_clearance::PlannedClearance;
pub use reader_log::{ReaderCount, ReaderLog};
pub use run::Run;
pub use scene::{Scene, Still};
pub use traffic::Traffic;
pub use travel_clock::TravelClock;
