//! The commands, one file each: wiring between the arguments, the library, the bus, clocks and stdout.

use std::process::ExitCode;

use anyhow::Context as _;

use crate::cli::{Cli, Command, ConfigArgs};
use crate::config::{Config, Overrides};
use crate::output::wait_for_reader;

mod bridge;
mod command_trail;
mod completions;
mod ctl;
mod ctl_status;
mod description;
mod doctor;
mod echo;
mod export;
mod follow;
mod guarding;
mod hz;
mod iox2_config;
mod latency;
mod listening;
mod man;
mod metrics;
mod monitor;
mod observing;
mod parent;
pub(crate) mod printable;
mod progress;
mod record;
mod replay;
mod serve;
mod show;
mod solve;
mod timecode;
mod verify;
mod view;
mod watch;

pub(crate) mod colour;
pub(crate) mod output;
mod whole_file;

/// Exit status of a contact where `--fail-on-contact` was given.
const CONTACT: u8 = 3;
/// Exit status of a recorder whose disk is full.
pub(crate) const DISK_FULL: u8 = 4;

/// Something in the arguments that only the command itself could find wrong.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct BadInput(pub(crate) String);

/// Reads the configuration that the arguments name, with the flags over it. An error names the file.
fn load_config(args: &ConfigArgs, overrides: Overrides) -> anyhow::Result<Config> {
    let path = args.config.as_deref();
    let loaded = Config::load(path, overrides);
    match path {
        Some(path) => loaded.with_context(|| path.display().to_string()),
        None => Ok(loaded?),
    }
}

/// Runs a command. The result is the process's exit status.
pub(crate) fn run(cli: Cli) -> anyhow::Result<ExitCode> {
    parent::follow_parent(cli.child)?;
    if is_only_output(&cli.command) {
        wait_for_reader(None);
    }
    match cli.command {
        Command::Show(args) => show::run(&args),
        Command::Serve(args) => serve::run(&args),
        Command::Monitor(args) => monitor::run(&args),
        Command::Record(args) => record::run(&args),
        Command::Replay(args) => replay::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Bridge(args) => bridge::run(&args),
        Command::View(args) => view::run(&args),
        Command::Metrics(args) => metrics::run(&args),
        Command::Ctl(args) => ctl::run(&args),
        Command::Watch(args) => watch::run(&args),
        Command::Echo(args) => echo::run(&args),
        Command::Hz(args) => hz::run(&args),
        Command::Latency(args) => latency::run(&args),
        Command::Solve(args) => solve::run(args.question),
        Command::Doctor(args) => doctor::run(&args),
        Command::Iox2Config(args) => iox2_config::run(&args),
        Command::Completions(args) => completions::run(args),
        Command::Man(args) => man::run(&args),
    }
}

/// Whether a command has nothing to do but its output, and leaves signals as they are.
fn is_only_output(command: &Command) -> bool {
    use Command::{Completions, Doctor, Export, Iox2Config, Man, Solve};
    matches!(command, Solve(_) | Export(_) | Doctor(_) | Iox2Config(_) | Completions(_) | Man(_))
}
