//! Why a configuration is not valid.

use std::io;

use bench_dragon_geometry::dragon::{DimensionsError, DragonError};
use bench_dragon_geometry::number::Number;
use bench_dragon_geometry::route::RouteError;

use super::MAX_ALSO;
use super::document::MAX_LEN;

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
    /// A key that means nothing on a route of this kind.
    #[error("[route] {key} is {}, only allowed with kind = \"{kind}\"", Number(*value))]
    OtherKind {
        /// The key.
        key: &'static str,
        /// The value.
        value: f64,
        /// The kind that it belongs to.
        kind: &'static str,
    },
    /// A plan that ends before it starts.
    #[error("[route] end_s is {}, must be above start_s {}", Number(*end_s), Number(*start_s))]
    EndsBeforeStart {
        /// Seconds.
        start_s: f64,
        /// Seconds.
        end_s: f64,
    },
    /// More commands than a show runs.
    #[error("[[show.also]] is there {count} times, at most {MAX_ALSO} are allowed")]
    TooManyCommands {
        /// How many there are.
        count: usize,
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
