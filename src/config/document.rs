//! The configuration as it is written: TOML tables, not yet checked.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use bench_dragon_ipc::service::MAX_DESCRIPTION_LEN;
use serde::{Deserialize, Serialize};

use super::error::ConfigError;
use super::priority::Priority;
use super::route_table::RouteTable;

/// Longest document in bytes: what a description carries.
pub(super) const MAX_LEN: u64 = MAX_DESCRIPTION_LEN as u64;

/// The document. Written out, it has every key that means something.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct Document {
    pub(super) dragon: DragonTable,
    pub(super) route: RouteTable,
    pub(super) head: HeadTable,
    pub(super) serve: ServeTable,
    pub(super) monitor: MonitorTable,
    #[serde(skip_serializing_if = "ShowTable::is_empty")]
    pub(super) show: ShowTable,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct DragonTable {
    pub(super) benches: u64,
    pub(super) head_length_m: f64,
    pub(super) body_length_m: f64,
    pub(super) width_m: f64,
    pub(super) hole_offset_m: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct HeadTable {
    pub(super) speed_mps: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) accel_mps2: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct ServeTable {
    pub(super) rate_hz: u32,
    pub(super) time_scale: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) cpu: Option<u32>,
    pub(super) priority: Priority,
    pub(super) spin_us: u32,
    pub(super) catch_up_s: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct MonitorTable {
    pub(super) near_m: f64,
    pub(super) margin_m: f64,
    pub(super) guard: bool,
}

/// What `show` alone goes by.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct ShowTable {
    pub(super) also: Vec<AlsoTable>,
}

/// A command that runs beside the show.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct AlsoTable {
    pub(super) command: String,
}

impl ShowTable {
    fn is_empty(&self) -> bool {
        self.also.is_empty()
    }
}

impl Default for DragonTable {
    fn default() -> Self {
        Self { benches: 223, head_length_m: 3.41, body_length_m: 2.20, width_m: 0.30, hole_offset_m: 0.275 }
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

pub(super) fn read(path: &Path) -> Result<String, ConfigError> {
    let mut text = String::new();
    let file = File::open(path).map_err(ConfigError::Read)?;
    file.take(MAX_LEN + 1).read_to_string(&mut text).map_err(ConfigError::Read)?;
    if text.len() as u64 > MAX_LEN { Err(ConfigError::TooLong) } else { Ok(text) }
}

pub(super) fn parse(text: &str) -> Result<Document, ConfigError> {
    toml::from_str(text).map_err(|error| {
        let line = error.span().map_or(0, |span| text[..span.start].matches('\n').count());
        let message = in_plain_words(error.message());
        ConfigError::Syntax { line: line + 1, text: excerpt(text.lines().nth(line).unwrap_or_default()), message }
    })
}

/// A message of the TOML reader in one line, with its names of Rust types as people would say them.
fn in_plain_words(message: &str) -> String {
    let names =
        [("\n", "; "), ("expected u32", "expected a whole number"), ("expected u64", "expected a whole number")];
    let names = names.into_iter().chain([("expected f64", "expected a number"), ("wanted ", "expected a ")]);
    names.fold(message.to_owned(), |message, (name, plain)| message.replace(name, plain))
}

/// The beginning of a line, for a message.
fn excerpt(line: &str) -> String {
    const LONGEST: usize = 60;
    let printable = line.trim().chars().map(|char| if char.is_control() { '?' } else { char });
    printable.take(LONGEST).collect()
}
