//! The command line: parse, run, report.

use std::borrow::Cow;
use std::error::Error;
use std::io::{self, ErrorKind};
use std::process::ExitCode;

use bench_dragon_ipc::{BusError, DomainError};
use clap::Parser as _;
use clap::builder::Styles;
use clap::error::ErrorKind as ClapErrorKind;

use crate::cli::Cli;
use crate::command::BadInput;
use crate::command::colour::{Painted, is_coloured};
use crate::command::printable::printable;
use crate::config::ConfigError;
use crate::output::complain;
use crate::recording::export::ExportError;
use crate::recording::{NothingFound, RecordError, RepairError};
use crate::source::replay::ReplayError;
use crate::system::{limits, log};
use crate::{command, output};

/// Exit status of bad arguments or configuration.
const BAD_INPUT: u8 = 2;

/// Runs the program with the arguments of this process.
pub fn main() -> ExitCode {
    output::start();
    let status = run();
    let printed = output::finish_stdout();
    let status = match printed {
        // A command that has failed has given its reason.
        Err(error) if status == ExitCode::SUCCESS => {
            complain_of(&error.into());
            ExitCode::FAILURE
        }
        _ => status,
    };
    output::finish_stderr();
    status
}

fn run() -> ExitCode {
    if let Err(error) = limits::require_stack() {
        complain(&format!("error: {error}"));
        return ExitCode::FAILURE;
    }
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
            complain_of(&error);
            exit_code(&error)
        }
    }
}

/// Prints an error in one line.
fn complain_of(error: &anyhow::Error) {
    let remedy = remedy(error).map_or_else(String::new, |remedy| format!(": {remedy}"));
    let label = Painted::on(&io::stderr(), *Styles::styled().get_error(), "error:");
    complain(&format!("{label} {}{remedy}", printable(&format!("{error:#}"))));
}

/// Prints help and version as clap does, an error in one line.
fn report_usage(error: &clap::Error) -> ExitCode {
    let rendered = error.render();
    if matches!(error.kind(), ClapErrorKind::DisplayHelp | ClapErrorKind::DisplayVersion) {
        let text = if is_coloured(&io::stdout()) { rendered.ansi().to_string() } else { rendered.to_string() };
        output::wait_for_reader(None);
        // Where it fails, the end of the process reports it.
        let _ = output::print(text.into_bytes());
        return ExitCode::SUCCESS;
    }
    let plain = rendered.to_string();
    // What was typed is part of the message: where it could drive the terminal, it is shown escaped and without colour.
    let is_plain = plain.lines().any(|line| matches!(printable(line), Cow::Owned(_)));
    let plain = plain.lines().map(printable).collect::<Vec<_>>().join("\n");
    let shown = if is_coloured(&io::stderr()) && !is_plain { rendered.ansi().to_string() } else { plain.clone() };
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

fn exit_code(error: &anyhow::Error) -> ExitCode {
    let is_disk_full =
        |cause: &(dyn Error + 'static)| cause.downcast_ref::<RecordError>().is_some_and(RecordError::is_disk_full);
    match () {
        () if error.chain().any(is_disk_full) => ExitCode::from(command::DISK_FULL),
        () if is_bad_input(error) => ExitCode::from(BAD_INPUT),
        () => ExitCode::FAILURE,
    }
}

fn is_bad_input(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause.is::<BadInput>()
            || cause.is::<ConfigError>()
            || matches!(cause.downcast_ref(), Some(DomainError::RootPath { .. }))
            || matches!(cause.downcast_ref(), Some(BusError::Domain(DomainError::RootPath { .. })))
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
fn remedy(error: &anyhow::Error) -> Option<String> {
    let of_cause = error.chain().find_map(|cause| limits::remedy(cause.downcast_ref()?));
    of_cause.or_else(|| limits::remedy_in_words(&format!("{error:#}")))
}

/// Whether whoever read our output has had enough, as `head` does.
fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .any(|cause| cause.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == ErrorKind::BrokenPipe))
}
