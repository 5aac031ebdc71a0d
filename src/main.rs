//! The command line: parse, run, report.

use std::io::{self, ErrorKind, IsTerminal as _};
use std::process::ExitCode;

use bench_dragon::config::ConfigError;
use bench_dragon::record::{RecordError, RepairError};
use bench_dragon::replay::ReplayError;
use clap::Parser as _;
use clap::error::ErrorKind as ClapErrorKind;
use iceoryx2::prelude::{LogLevel, set_log_level};
use tracing::Level;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt::format;
use tracing_subscriber::prelude::*;

mod cli;
mod command;
mod limits;

use cli::Cli;
use command::BadInput;
use command::output::complain;

/// Exit status of bad arguments or configuration.
const BAD_INPUT: u8 = 2;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return report_usage(&error),
    };
    log_to_stderr();
    limits::settle();
    match command::run(cli.command) {
        Ok(status) => status,
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            let remedy = remedy(&error).map_or_else(String::new, |remedy| format!(": {remedy}"));
            complain(&format!("error: {error:#}{remedy}"));
            ExitCode::from(if is_bad_input(&error) { BAD_INPUT } else { 1 })
        }
    }
}

/// Warnings and worse, or what `RUST_LOG` says; iceoryx2's own among them, without the dump of the object that each of
/// them comes with.
fn log_to_stderr() {
    let asked: Option<Targets> = std::env::var("RUST_LOG").ok().and_then(|filter| filter.parse().ok());
    set_log_level(if asked.is_some() { LogLevel::Trace } else { LogLevel::Warn });
    let filter = asked.unwrap_or_else(|| Targets::new().with_default(Level::WARN));
    let fields = format::debug_fn(|writer, field, value| match field.name() {
        "message" => write!(writer, "{value:?}"),
        "origin" => Ok(()),
        name => write!(writer, "{name}={value:?}"),
    });
    let lines = tracing_subscriber::fmt::layer()
        .fmt_fields(fields)
        .with_target(false)
        .with_ansi(io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty()))
        .with_writer(io::stderr)
        .without_time();
    tracing_subscriber::registry().with(lines.with_filter(filter)).init();
}

/// Prints help and version as clap does, an error in one line.
fn report_usage(error: &clap::Error) -> ExitCode {
    if matches!(error.kind(), ClapErrorKind::DisplayHelp | ClapErrorKind::DisplayVersion) {
        // Nobody is left to tell where stdout is gone.
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    let rendered = error.render().to_string();
    let lines = rendered.lines().map(str::trim).take_while(|line| !line.starts_with("Usage:"));
    let message: Vec<&str> =
        lines.filter(|line| !line.is_empty() && !line.starts_with("For more information")).collect();
    if error.kind() == ClapErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        complain(&rendered);
    } else {
        complain(&message.join(" "));
    }
    ExitCode::from(BAD_INPUT)
}

fn is_bad_input(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause.is::<BadInput>()
            || cause.is::<ConfigError>()
            || matches!(cause.downcast_ref(), Some(RecordError::Exists { .. } | RecordError::Create { .. }))
            || matches!(cause.downcast_ref(), Some(ReplayError::Open(_)))
            || matches!(cause.downcast_ref(), Some(RepairError::Read { .. } | RepairError::Foreign { .. }))
    })
}

/// What to do about an error that comes of a limit of this process.
fn remedy(error: &anyhow::Error) -> Option<&'static str> {
    error.chain().find_map(|cause| limits::remedy(cause.downcast_ref()?))
}

/// Whether whoever read our output has had enough, as `head` does.
fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .any(|cause| cause.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == ErrorKind::BrokenPipe))
}
