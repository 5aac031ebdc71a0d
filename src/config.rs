//! The configuration: one TOML document, validated once into values that need no further check.
//!
//! A key that is left out has the value of the paper's dragon. Unknown keys, values out of range and impossible
//! geometry are errors that name the key, the value and what is allowed.

use std::fs;
use std::io;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::dragon::{Dimensions, DimensionsError, Dragon, DragonError};
use crate::route::{RouteError, Spiral};

/// Ticks a second that a server may run at.
pub const RATE_HZ: RangeInclusive<u32> = 1..=100_000;
/// Show seconds a wall-clock second that a server may run at.
pub const TIME_SCALE: RangeInclusive<f64> = 0.001..=1000.0;
/// Speeds of the head that a show may be planned with, in metres per show second.
pub const HEAD_SPEED_MPS: RangeInclusive<f64> = 0.001..=10.0;
/// Clearances below which the monitor may be told to warn, in metres.
pub const NEAR_M: RangeInclusive<f64> = 0.0..=10.0;

/// The document as it is written, all keys present.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Document {
    dragon: DragonTable,
    route: RouteTable,
    head: HeadTable,
    serve: ServeTable,
    monitor: MonitorTable,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct DragonTable {
    benches: u64,
    head_length_m: f64,
    body_length_m: f64,
    width_m: f64,
    hole_offset_m: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct RouteTable {
    kind: RouteKind,
    pitch_m: f64,
    start_turns: f64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum RouteKind {
    #[default]
    Spiral,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct HeadTable {
    speed_mps: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct ServeTable {
    rate_hz: u32,
    time_scale: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct MonitorTable {
    near_m: f64,
}

impl Default for DragonTable {
    fn default() -> Self {
        Self { benches: 223, head_length_m: 3.41, body_length_m: 2.20, width_m: 0.30, hole_offset_m: 0.275 }
    }
}

impl Default for RouteTable {
    fn default() -> Self {
        Self { kind: RouteKind::Spiral, pitch_m: 0.55, start_turns: 16.0 }
    }
}

impl Default for HeadTable {
    fn default() -> Self {
        Self { speed_mps: 1.0 }
    }
}

impl Default for ServeTable {
    fn default() -> Self {
        Self { rate_hz: 1000, time_scale: 1.0 }
    }
}

impl Default for MonitorTable {
    fn default() -> Self {
        Self { near_m: 0.02 }
    }
}

/// What flags set over the document.
#[derive(Clone, Copy, Debug, Default)]
pub struct Overrides {
    /// Ticks a second.
    pub rate_hz: Option<u32>,
    /// Show seconds per wall-clock second.
    pub time_scale: Option<f64>,
}

/// A valid configuration.
#[derive(Clone, Debug)]
pub struct Config {
    document: Document,
    dragon: Arc<Dragon>,
}

/// Why a configuration is not valid.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read the configuration {path}: {error}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        error: io::Error,
    },
    /// The text is not TOML, or has a key or a type that is not known.
    #[error("{source_name}, line {line}: {message}")]
    Syntax {
        /// The file's name, or what the text is.
        source_name: String,
        /// The line, from 1.
        line: usize,
        /// What is wrong, in one line.
        message: String,
    },
    /// A value out of range.
    #[error("[{table}] {key} is {value}, must be from {lowest} to {highest}")]
    OutOfRange {
        /// The table.
        table: &'static str,
        /// The key.
        key: &'static str,
        /// The value.
        value: f64,
        /// Least allowed value.
        lowest: f64,
        /// Greatest allowed value.
        highest: f64,
    },
    /// Impossible measures of a bench.
    #[error("[dragon] {0}")]
    Dimensions(#[from] DimensionsError),
    /// An impossible route.
    #[error("[route] {0}")]
    Route(#[from] RouteError),
    /// Benches and route that do not go together.
    #[error("{0}")]
    Dragon(#[from] DragonError),
}

impl Config {
    /// Reads a file, or takes the paper's dragon where there is none, and sets the flags over it.
    ///
    /// # Errors
    /// What is wrong with the file or a value.
    pub fn load(path: Option<&Path>, overrides: Overrides) -> Result<Self, ConfigError> {
        let Some(path) = path else { return Self::from_document(Document::default(), overrides) };
        let text = fs::read_to_string(path).map_err(|error| ConfigError::Read { path: path.to_owned(), error })?;
        Self::from_document(parse(&text, &path.display().to_string())?, overrides)
    }

    /// Reads the text of a description.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn from_toml(text: &str) -> Result<Self, ConfigError> {
        Self::from_document(parse(text, "the description")?, Overrides::default())
    }

    /// The whole configuration as TOML, every key written out.
    pub fn to_toml(&self) -> String {
        toml::to_string(&self.document).expect("the document has only tables of numbers and strings")
    }

    /// The dragon on its route.
    pub fn dragon(&self) -> &Arc<Dragon> {
        &self.dragon
    }

    /// Planned speed of the head in metres per show second.
    pub fn head_speed_mps(&self) -> f64 {
        self.document.head.speed_mps
    }

    /// Ticks a second.
    pub fn rate_hz(&self) -> u32 {
        self.document.serve.rate_hz
    }

    /// Show seconds per wall-clock second.
    pub fn time_scale(&self) -> f64 {
        self.document.serve.time_scale
    }

    /// Show seconds that one running tick advances.
    pub fn tick_s(&self) -> f64 {
        self.time_scale() / f64::from(self.rate_hz())
    }

    /// Clearance in metres from which on the monitor warns.
    pub fn near_m(&self) -> f64 {
        self.document.monitor.near_m
    }

    /// Show time in seconds at which the planned run ends.
    pub fn end_s(&self) -> f64 {
        self.dragon.end_travel_m() / self.head_speed_mps()
    }

    fn from_document(mut document: Document, overrides: Overrides) -> Result<Self, ConfigError> {
        let serve = &mut document.serve;
        serve.rate_hz = overrides.rate_hz.unwrap_or(serve.rate_hz);
        serve.time_scale = overrides.time_scale.unwrap_or(serve.time_scale);
        let rates = f64::from(*RATE_HZ.start())..=f64::from(*RATE_HZ.end());
        require("serve", "rate_hz", f64::from(document.serve.rate_hz), &rates)?;
        require("serve", "time_scale", document.serve.time_scale, &TIME_SCALE)?;
        require("head", "speed_mps", document.head.speed_mps, &HEAD_SPEED_MPS)?;
        require("monitor", "near_m", document.monitor.near_m, &NEAR_M)?;
        let dragon = build_dragon(&document)?;
        Ok(Self { document, dragon: Arc::new(dragon) })
    }
}

fn build_dragon(document: &Document) -> Result<Dragon, ConfigError> {
    let DragonTable { benches, head_length_m, body_length_m, width_m, hole_offset_m } = document.dragon;
    let benches = usize::try_from(benches).unwrap_or(usize::MAX);
    let dimensions = Dimensions::new(benches, head_length_m, body_length_m, width_m, hole_offset_m)?;
    let route = match document.route.kind {
        RouteKind::Spiral => Spiral::new(document.route.pitch_m, document.route.start_turns)?,
    };
    Ok(Dragon::new(dimensions, Arc::new(route))?)
}

fn parse(text: &str, source_name: &str) -> Result<Document, ConfigError> {
    toml::from_str(text).map_err(|error| {
        let line = error.span().map_or(1, |span| text[..span.start].matches('\n').count() + 1);
        let message = error.message().replace('\n', "; ");
        ConfigError::Syntax { source_name: source_name.to_owned(), line, message }
    })
}

fn require(
    table: &'static str,
    key: &'static str,
    value: f64,
    allowed: &RangeInclusive<f64>,
) -> Result<(), ConfigError> {
    if allowed.contains(&value) {
        return Ok(());
    }
    Err(ConfigError::OutOfRange { table, key, value, lowest: *allowed.start(), highest: *allowed.end() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_of(text: &str) -> String {
        Config::from_toml(text).expect_err(text).to_string()
    }

    #[test]
    fn the_document_without_keys_is_the_papers_dragon() {
        let config = Config::from_toml("").expect("every key has a default");
        assert_eq!(config.dragon().dimensions().benches(), 223);
        assert_eq!((config.rate_hz(), config.time_scale(), config.head_speed_mps()), (1000, 1.0, 1.0));
    }

    #[test]
    fn the_written_document_reads_back_the_same() {
        let text = "[route]\npitch_m = 0.6000000000000001\n[serve]\nrate_hz = 250\n";
        let config = Config::from_toml(text).expect("the text is valid");
        let again = Config::from_toml(&config.to_toml()).expect("its own text is valid");
        assert_eq!(again.document, config.document);
    }

    #[test]
    fn flags_override_the_document() {
        let overrides = Overrides { rate_hz: Some(50), time_scale: Some(20.0) };
        let config = Config::load(None, overrides).expect("both are in range");
        assert_eq!((config.rate_hz(), config.time_scale()), (50, 20.0));
    }

    #[test]
    fn an_unknown_key_is_named_with_its_line() {
        let error = error_of("[route]\npitch_m = 0.55\npitsch = 1\n");
        assert!(error.starts_with("the description, line 3: unknown field `pitsch`, expected one of"), "{error}");
    }

    #[test]
    fn every_error_is_one_line_that_names_key_value_and_range() {
        for (text, start) in [
            ("[serve]\nrate_hz = 0", "[serve] rate_hz is 0, must be from 1 to 100000"),
            ("[serve]\nrate_hz = 10000000", "[serve] rate_hz is 10000000, must be from 1 to 100000"),
            ("[serve]\ntime_scale = nan", "[serve] time_scale is NaN, must be from 0.001 to 1000"),
            ("[head]\nspeed_mps = -1.0", "[head] speed_mps is -1, must be from 0.001 to 10"),
            ("[dragon]\nbenches = 0", "[dragon] benches is 0, must be"),
            ("[dragon]\nhole_offset_m = 1.2", "[dragon] hole_offset_m is 1.2, must be"),
            ("[dragon]\nwidth_m = inf", "[dragon] width_m is inf, must be"),
            ("[route]\npitch_m = 0.2", "pitch_m is 0.2, must be above width_m"),
            ("[route]\npitch_m = nan", "[route] pitch_m is NaN, must be"),
            ("[route]\nkind = \"ring\"", "the description, line 2: unknown variant `ring`, expected `spiral`"),
            ("[dragon]\nbenches = -3", "the description, line 2: "),
            ("[dragon", "the description, line 1: "),
        ] {
            let error = error_of(text);
            assert!(error.starts_with(start) && !error.contains('\n'), "{text:?} gives {error:?}");
        }
    }
}
