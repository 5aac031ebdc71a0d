//! The observer of a show. It reads all services of the bus and derives a [`Snapshot`] from them.
//!
//! An [`Observer`] is an ordinary reader. Every frame wakes it, so it counts and times each of them. It shows only the newest
//! frame, some sixty times a second. It computes the frame's nearest pair and the forecast itself, so both exist without a
//! monitor. `view`, `watch` and `metrics` get the same snapshots.

mod clearance_memory;
mod contact;
mod controls;
mod cue_list;
mod current_run;
mod described_run;
mod event_logs;
mod frame_statistics;
mod guard_situation;
mod head_motion;
mod lamps;
mod lost_server;
mod members;
mod observer;
mod observer_state;
mod planned_clearance;
mod reader_lamps;
mod reader_log;
mod recent_overruns;
mod several;
mod show_forecast;
mod snapshot;
mod standing;

pub use contact::{Contact, PastContact};
pub use controls::Controls;
pub use cue_list::{CueList, CueState, ListedCue};
pub use described_run::{ClearanceChart, DescribedRun};
pub use event_logs::{AlertLog, CommandHistory, EventLog, Numbered};
pub use frame_statistics::FrameStatistics;
pub use guard_situation::GuardSituation;
pub use head_motion::{Arrival, TravelClock};
pub use lamps::{Lamp, LampLevel, lamps};
pub use members::Members;
pub use observer::Observer;
pub use observer_state::{ObserverState, SourceFacts};
pub use planned_clearance::PlannedClearance;
pub use reader_log::{ReaderCount, ReaderLog};
pub use recent_overruns::RecentOverruns;
pub use several::of_formation;
pub use show_forecast::ShowForecast;
pub use snapshot::{FrameCopy, LeastClearance, Snapshot, SourcePresence};
pub use standing::{Level, Standing};
