//! The TOML document of a configuration, not yet checked.

use std::path::Path;

use bench_dragon_geometry::formation::Timetable;
use bench_dragon_ipc::service::MAX_DESCRIPTION_LEN;
use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::cue::CueTable;
use super::dragon_entry::DragonEntry;
use super::ground_table::GroundTable;
use super::origin_table::OriginTable;
use super::priority::Priority;
use super::route_table::RouteTable;
use super::stage_table::StageTable;
use crate::system::input_file;

/// Greatest length of a document in bytes: the greatest length of a description.
pub const MAX_CONFIG_BYTES: u64 = MAX_DESCRIPTION_LEN as u64;

/// The document. Its written form contains every key that applies.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub struct Document {
    pub(super) dragon: DragonTable,
    pub(super) route: RouteTable,
    #[serde(skip_serializing_if = "OriginTable::is_empty")]
    pub(super) origin: OriginTable,
    #[serde(skip_serializing_if = "GroundTable::is_empty")]
    pub(super) ground: GroundTable,
    /// Walk of the head.
    pub head: HeadTable,
    /// Settings of the server.
    pub serve: ServeTable,
    /// Clearances that the monitor and the guard use.
    pub monitor: MonitorTable,
    #[serde(skip_serializing_if = "StageTable::is_empty")]
    pub(super) stage: StageTable,
    #[serde(skip_serializing_if = "ShowTable::is_empty")]
    pub(super) show: ShowTable,
    /// What is planned to happen, in the order of plan time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) cues: Vec<CueTable>,
    /// The dragons of a formation, each with a name, the keys of `[dragon]`, and its own `route` and `head`.
    #[serde(skip_serializing)]
    pub(super) dragons: Option<Vec<DragonEntry>>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct DragonTable {
    pub(super) benches: u64,
    pub(super) head_length_m: f64,
    pub(super) body_length_m: f64,
    pub(super) width_m: f64,
    pub(super) hole_offset_m: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) hole_diameter_m: Option<f64>,
    /// Without one, the hinges have no play.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) pole_diameter_m: Option<f64>,
}

/// `[head]` of the document.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub struct HeadTable {
    /// Planned speed of the head in metres per show second.
    pub speed_mps: f64,
    /// Greatest acceleration of the head in m/s²; without one it starts and stops at once.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accel_mps2: Option<f64>,
}

impl HeadTable {
    /// Timetable of a run that begins at a show time, at the travel of the planned speed, and ends at a travel.
    pub fn timetable(&self, start_s: f64, end_travel_m: f64) -> Timetable {
        Timetable::new(self.speed_mps, self.accel_mps2, start_s, end_travel_m)
    }
}

/// `[serve]` of the document.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub struct ServeTable {
    /// Ticks a second.
    pub rate_hz: u32,
    /// Show seconds per wall-clock second.
    pub time_scale: f64,
    /// Processor of the server's loop; `None`: any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cpu: Option<u32>,
    /// Scheduling policy and priority of the server's loop.
    pub priority: Priority,
    /// Time before each due instant in which the server's loop spins instead of sleeping, in microseconds.
    pub spin_us: u32,
    /// Longest standstill, in seconds of wall time, after which the show jumps to the time that is due. After a longer
    /// standstill it catches up slowly.
    pub catch_up_s: f64,
}

/// `[monitor]` of the document.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub struct MonitorTable {
    /// Clearance in metres at or below which the monitor warns.
    pub near_m: f64,
    /// Clearance in metres that the guard keeps.
    pub margin_m: f64,
    /// Whether the server requires a guard, which keeps the benches apart.
    pub guard: bool,
}

/// Settings of the subcommand `show` alone.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct ShowTable {
    /// Whether only the operator ends the show.
    pub(super) stay: bool,
    pub(super) also: Vec<AlsoTable>,
}

/// A command that `show` runs in addition to its own children.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct AlsoTable {
    pub(super) command: String,
}

impl ShowTable {
    fn is_empty(&self) -> bool {
        !self.stay && self.also.is_empty()
    }
}

impl Default for DragonTable {
    fn default() -> Self {
        Self {
            benches: 223,
            head_length_m: 3.41,
            body_length_m: 2.20,
            width_m: 0.30,
            hole_offset_m: 0.275,
            hole_diameter_m: None,
            pole_diameter_m: None,
        }
    }
}

impl Default for HeadTable {
    fn default() -> Self {
        Self { speed_mps: 1.0, accel_mps2: None }
    }
}

impl Default for ServeTable {
    fn default() -> Self {
        Self { rate_hz: 1000, time_scale: 1.0, cpu: None, priority: Priority::Other, spin_us: 0, catch_up_s: 0.25 }
    }
}

impl Default for MonitorTable {
    fn default() -> Self {
        Self { near_m: 0.02, margin_m: 0.0005, guard: false }
    }
}

/// Reads the text of a configuration file.
///
/// # Errors
/// The file cannot be read, is too long, or is not UTF-8.
pub fn read_document(path: &Path) -> Result<String, ConfigError> {
    let bytes = input_file::read_any(path, MAX_CONFIG_BYTES + 1)
        .map_err(|error| ConfigError(format!("cannot be read: {error}")))?;
    if bytes.len() as u64 > MAX_CONFIG_BYTES {
        return Err(ConfigError(format!("is longer than {MAX_CONFIG_BYTES} bytes, the most that is allowed")));
    }
    String::from_utf8(bytes).map_err(|_| ConfigError("cannot be read: stream did not contain valid UTF-8".to_owned()))
}

pub(super) fn parse(text: &str) -> Result<Document, ConfigError> {
    toml::from_str(text).map_err(|error| {
        let line = error.span().map_or(0, |span| text[..span.start].matches('\n').count());
        let message = in_plain_words(error.message());
        let text = excerpt(text.lines().nth(line).unwrap_or_default());
        ConfigError(format!("line {}, `{text}`: {message}", line + 1))
    })
}

/// Rewrites a message of the TOML reader in one line, with plain words for Rust types.
pub(super) fn in_plain_words(message: &str) -> String {
    let message = &with_short_numbers(message);
    let names = [
        ("\n", "; "),
        ("` as i128", "`, which has too many digits"),
        ("expected u32", "expected a whole number"),
        ("expected u64", "expected a whole number"),
    ];
    let names = names.into_iter().chain([("expected f64", "expected a number"), ("wanted ", "expected a ")]);
    names.fold(message.to_owned(), |message, (name, plain)| message.replace(name, plain))
}

/// The same text, where numbers of very many digits are shortened.
fn with_short_numbers(text: &str) -> String {
    const LONGEST: usize = 24;
    let mut digits = 0;
    let kept = text.chars().filter_map(|char| {
        digits = if char.is_ascii_digit() { digits + 1 } else { 0 };
        match digits {
            0..=LONGEST => Some(char),
            digits if digits == LONGEST + 1 => Some('…'),
            _ => None,
        }
    });
    kept.collect()
}

/// Returns the beginning of a line, for a message.
fn excerpt(line: &str) -> String {
    const LONGEST: usize = 60;
    let printable = line.trim().chars().map(|char| if char.is_control() { '?' } else { char });
    printable.take(LONGEST).collect()
}
