//! The configuration: one TOML document, validated once into values that need no further check.
//!
//! A key that is left out has the value of the paper's dragon. Unknown keys, values out of range and impossible
//! geometry are errors that name the key, the value and what is allowed.

use std::fs::File;
use std::io::{self, Read as _};
use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use bench_dragon_ipc::service::MAX_DESCRIPTION_LEN;
use serde::{Deserialize, Serialize};

use crate::dragon::{Dimensions, DimensionsError, Dragon, DragonError};
use crate::number::Number;
use crate::route::{RouteError, Spiral};

/// Longest document in bytes: what a description carries.
const MAX_LEN: u64 = MAX_DESCRIPTION_LEN as u64;

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
#[serde(default, deny_unknown_fields, expecting = "a table")]
struct Document {
    dragon: DragonTable,
    route: RouteTable,
    head: HeadTable,
    serve: ServeTable,
    monitor: MonitorTable,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
struct DragonTable {
    benches: u64,
    head_length_m: f64,
    body_length_m: f64,
    width_m: f64,
    hole_offset_m: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
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
#[serde(default, deny_unknown_fields, expecting = "a table")]
struct HeadTable {
    speed_mps: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
struct ServeTable {
    rate_hz: u32,
    time_scale: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
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

/// Why a configuration is not valid. Which file it is about is for the caller to say.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Read(io::Error),
    /// The file is larger than any configuration.
    #[error("has more than {MAX_LEN} bytes, the most that a configuration may have")]
    TooLong,
    /// The text is not TOML, or has a key or a type that is not known.
    #[error("line {line}, `{text}`: {message}")]
    Syntax {
        /// The line, from 1.
        line: usize,
        /// What stands there.
        text: String,
        /// What is wrong, in one line.
        message: String,
    },
    /// A value out of range.
    #[error("[{table}] {key} is {}, must be from {lowest} to {highest}", Number(*value))]
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
    Dimensions(DimensionsError),
    /// An impossible route.
    #[error("[route] {0}")]
    Route(RouteError),
    /// Benches and route that do not go together.
    #[error("{0}")]
    Dragon(DragonError),
}

impl Config {
    /// Reads a file, or takes the paper's dragon where there is none, and sets the flags over it.
    ///
    /// # Errors
    /// What is wrong with the file or a value.
    pub fn load(path: Option<&Path>, overrides: Overrides) -> Result<Self, ConfigError> {
        let Some(path) = path else { return Self::from_document(Document::default(), overrides) };
        Self::from_document(parse(&read(path)?)?, overrides)
    }

    /// Reads the text of a description.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn from_toml(text: &str) -> Result<Self, ConfigError> {
        Self::from_document(parse(text)?, Overrides::default())
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
    let dimensions = Dimensions::new(benches, head_length_m, body_length_m, width_m, hole_offset_m)
        .map_err(ConfigError::Dimensions)?;
    let route = match document.route.kind {
        RouteKind::Spiral => {
            Spiral::new(document.route.pitch_m, document.route.start_turns).map_err(ConfigError::Route)?
        }
    };
    Dragon::new(dimensions, Arc::new(route)).map_err(ConfigError::Dragon)
}

fn read(path: &Path) -> Result<String, ConfigError> {
    let mut text = String::new();
    let file = File::open(path).map_err(ConfigError::Read)?;
    file.take(MAX_LEN + 1).read_to_string(&mut text).map_err(ConfigError::Read)?;
    if text.len() as u64 > MAX_LEN { Err(ConfigError::TooLong) } else { Ok(text) }
}

fn parse(text: &str) -> Result<Document, ConfigError> {
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
        assert!(error.starts_with("line 3, `pitsch = 1`: unknown field `pitsch`, expected one of"), "{error}");
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
            ("[route]\nkind = \"ring\"", "line 2, `kind = \"ring\"`: unknown variant `ring`, expected `spiral`"),
            ("[dragon]\nbenches = -3", "line 2, `benches = -3`: "),
            ("[dragon", "line 1, `[dragon`: "),
            (
                "[serve]\nrate_hz = 1e3",
                "line 2, `rate_hz = 1e3`: invalid type: floating point `1000.0`, expected a whole number",
            ),
            ("[route]\npitch_m = \"x\"", "line 2, `pitch_m = \"x\"`: invalid type: string \"x\", expected a number"),
            ("dragon = 3", "line 1, `dragon = 3`: invalid type: integer `3`, expected a table"),
            ("[route]\npitch_m = 1e308", "[route] pitch_m is 1e308, must be"),
        ] {
            let error = error_of(text);
            assert!(error.starts_with(start) && !error.contains('\n'), "{text:?} gives {error:?}");
        }
    }
}
