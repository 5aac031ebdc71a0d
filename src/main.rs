//! The command line: parse, run, report.

use std::io::{self, ErrorKind};
use std::process::ExitCode;

use bench_dragon::config::ConfigError;
use bench_dragon::export::ExportError;
use bench_dragon::record::{NothingFound, RecordError, RepairError};
use bench_dragon::replay::ReplayError;
use clap::Parser as _;
use clap::builder::Styles;
use clap::error::ErrorKind as ClapErrorKind;

mod cli;
mod command;
mod held_stderr;
mod limits;
mod log;

use cli::Cli;
use command::BadInput;
use command::colour::{Painted, is_coloured};
use command::output::complain;

/// Exit status of bad arguments or configuration.
const BAD_INPUT: u8 = 2;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return report_usage(&error),
    };
    log::to_stderr();
    limits::settle();
    match command::run(cli) {
        Ok(status) => status,
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            let remedy = remedy(&error).map_or_else(String::new, |remedy| format!(": {remedy}"));
            let label = Painted::on(&io::stderr(), *Styles::styled().get_error(), "error:");
            complain(&format!("{label} {error:#}{remedy}"));
            ExitCode::from(if is_bad_input(&error) { BAD_INPUT } else { 1 })
        }
    }
}

/// Prints help and version as clap does, an error in one line.
fn report_usage(error: &clap::Error) -> ExitCode {
    if matches!(error.kind(), ClapErrorKind::DisplayHelp | ClapErrorKind::DisplayVersion) {
        // Nobody is left to tell where stdout is gone.
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    let rendered = error.render();
    let plain = rendered.to_string();
    let shown = if is_coloured(&io::stderr()) { rendered.ansi().to_string() } else { plain.clone() };
    if error.kind() == ClapErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        complain(&shown);
    } else {
        let lines = plain.lines().map(str::trim).zip(shown.lines().map(str::trim));
        let message = lines.take_while(|(line, _)| !line.starts_with("Usage:"));
        let said = message.filter(|(line, _)| !line.is_empty() && !line.starts_with("For more information"));
        complain(&said.map(|(_, shown)| shown).collect::<Vec<_>>().join(" "));
    }
    ExitCode::from(BAD_INPUT)
}

fn is_bad_input(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause.is::<BadInput>()
            || cause.is::<ConfigError>()
            || matches!(cause.downcast_ref(), Some(RecordError::Exists { .. } | RecordError::Create { .. }))
            || matches!(
                cause.downcast_ref(),
                Some(ReplayError::Open(_) | ReplayError::Nothing(NothingFound::NothingThere { .. }))
            )
            || matches!(
                cause.downcast_ref(),
                Some(
                    ExportError::Open(_)
                        | ExportError::Nothing(NothingFound::NothingThere { .. })
                        | ExportError::TooMuch { .. }
                )
            )
            || matches!(
                cause.downcast_ref(),
                Some(RepairError::Read { .. } | RepairError::Foreign { .. } | RepairError::Damaged { .. })
            )
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
