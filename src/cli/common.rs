//! What several commands take.

use std::path::PathBuf;

use bench_dragon_ipc::Instance;
use clap::{Args, ValueEnum, ValueHint};

use super::value::instance;

/// How to print.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// For people.
    #[default]
    Text,
    /// For machines; stable.
    Json,
}

/// Which instance to talk to.
#[derive(Clone, Debug, Args)]
pub(crate) struct BusArgs {
    /// The instance: 1 to 24 of a-z, 0-9 and -.
    #[arg(long, value_name = "NAME", default_value_t, value_parser = instance, global = true)]
    pub(crate) instance: Instance,
}

/// How to print.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct FormatArgs {
    /// How to print.
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t, global = true)]
    pub(crate) format: Format,
}

/// Which dragon.
#[derive(Clone, Debug, Args)]
pub(crate) struct ConfigArgs {
    /// The configuration, TOML; the paper's dragon without one.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) config: Option<PathBuf>,
}

/// Arguments of a process that `show` starts.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct ChildArgs {
    /// End when this process, the parent, ends.
    #[arg(long, value_name = "PID", hide = true, global = true)]
    pub(crate) parent: Option<u32>,
}

/// Something in the arguments that only the command itself could find wrong.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct BadInput(pub(crate) String);
