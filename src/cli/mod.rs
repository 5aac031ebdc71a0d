//! The command line: parses it, runs the subcommand and reports its error.
//!
//! Each subcommand has a file or a folder. It holds the subcommand's arguments with their help, and connects the arguments, the
//! library, the bus, the clocks and stdout.

#![allow(
    rustdoc::broken_intra_doc_links,
    clippy::doc_markdown,
    reason = "doc comments of arguments are help texts: brackets enclose defaults, and names have no backticks"
)]

use std::borrow::Cow;
use std::io;
use std::process::ExitCode;

use anyhow::Context as _;
use clap::Parser;
use clap::builder::Styles;
use clap::error::ErrorKind;

use crate::config::{Config, ConfigDocument, Document, PlanDocument};
use crate::output::terminal_text::{Painted, is_coloured, printable};
use crate::output::{self, log, print_to_stderr, wait_for_reader};
use crate::system::limits;

mod bridge;
mod bus_readers;
mod ctl;
mod cues;
mod doctor;
mod echo;
mod endpoint;
mod exit_status;
mod export;
mod flags;
mod hand_over;
mod hz;
mod latency;
mod monitor;
mod parent;
mod parts;
mod plan;
mod print;
mod reading;
mod record;
mod replay;
mod serve;
mod shell;
mod show;
mod solve;
mod status;
mod timecode;
mod watch;
mod web;

use flags::{BusArgs, ChildArgs, ConfigArgs};
pub use record::{RecordLine, RecordSummary};
pub use serve::{ServeLine, run_start};
pub use show::{
    LEAST_ROOM_BYTES, LONGEST_DISK_SILENCE, LONGEST_LOOK, LONGEST_SILENCE, LastSeen, Liveness, Look, MAX_RESTARTS,
    Phase, Resumption, ResumptionSettings,
};

/// Real-time motion server for the bench dragon.
#[derive(Debug, Parser)]
#[command(name = "bench-dragon", version, about, propagate_version = true, disable_help_subcommand = true)]
#[command(subcommand_value_name = "SUBCOMMAND", subcommand_help_heading = "Subcommands")]
#[command(after_help = "Examples:
  bench-dragon show --time-scale 20           the paper's dragon, to its first contact
  bench-dragon serve --config stage.toml      only a server
  bench-dragon ctl pause                      a command to the server
  bench-dragon solve contact --format json    the first contact
  bench-dragon plan street.toml               the plan in a browser, to drag
  bench-dragon hand-over street.toml --out crew   the plan as files, for others

Exit status: 0 done, 1 failed, 2 bad arguments or configuration, 3 contact with --fail-on-contact, 4 disk full while recording, \
130 ended at once by a second Ctrl-C, or an answer of `solve` that Ctrl-C has cancelled.
RUST_LOG=debug logs more detail. NO_COLOR=1 turns colours off.")]
pub(crate) struct Cli {
    /// The subcommand to run.
    #[command(subcommand)]
    pub(crate) subcommand: Subcommand,
    #[command(flatten)]
    pub(crate) child: ChildArgs,
}

/// The program's subcommands.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Subcommand {
    Show(show::ShowArgs),
    Serve(serve::ServeArgs),
    Monitor(monitor::MonitorArgs),
    Record(record::RecordArgs),
    Replay(replay::ReplayArgs),
    Export(export::ExportArgs),
    Bridge(bridge::BridgeArgs),
    View(web::ViewArgs),
    Metrics(web::MetricsArgs),
    Ctl(ctl::CtlArgs),
    Watch(watch::WatchArgs),
    Echo(echo::EchoArgs),
    Hz(hz::HzArgs),
    Latency(latency::LatencyArgs),
    Solve(solve::SolveArgs),
    Plan(plan::PlanArgs),
    HandOver(hand_over::HandOverArgs),
    Doctor(doctor::DoctorArgs),
    /// Print the iceoryx2 configuration of an instance, as TOML.
    #[command(after_help = "Example, with the iox2 command:
  mkdir -p config && bench-dragon iox2-config > config/iceoryx2.toml && iox2 service list")]
    Iox2Config(BusArgs),
    Completions(shell::CompletionsArgs),
    Man(shell::ManArgs),
}

/// Runs the program with this process's arguments.
pub fn main() -> ExitCode {
    output::start();
    let status = run();
    let printed = output::finish_stdout();
    let status = match printed {
        // A failed subcommand has already reported its reason.
        Err(error) if status == ExitCode::SUCCESS => {
            print_error(&error.into());
            ExitCode::FAILURE
        }
        _ => status,
    };
    output::finish_stderr();
    status
}

fn run() -> ExitCode {
    if let Err(error) = limits::require_stack() {
        print_to_stderr(&format!("error: {error}"));
        return ExitCode::FAILURE;
    }
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return report_usage(&error),
    };
    log::to_stderr();
    limits::settle();
    match run_subcommand(cli) {
        Ok(status) => status,
        Err(error) if exit_status::is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            print_error(&error);
            exit_status::of_error(&error)
        }
    }
}

/// Runs a subcommand. Returns the exit status of the process.
fn run_subcommand(cli: Cli) -> anyhow::Result<ExitCode> {
    parent::end_with_parent(cli.child)?;
    if cli.child.report_progress {
        print::print_progress();
    }
    if is_only_output(&cli.subcommand) {
        wait_for_reader(None);
    }
    match cli.subcommand {
        Subcommand::Show(args) => show::run(&args),
        Subcommand::Serve(args) => serve::run(&args),
        Subcommand::Monitor(args) => monitor::run(&args),
        Subcommand::Record(args) => record::run(&args),
        Subcommand::Replay(args) => replay::run(&args),
        Subcommand::Export(args) => export::run(&args),
        Subcommand::Bridge(args) => bridge::run(&args),
        Subcommand::View(args) => web::view(&args),
        Subcommand::Metrics(args) => web::metrics(&args),
        Subcommand::Ctl(args) => ctl::run(&args),
        Subcommand::Watch(args) => watch::run(&args),
        Subcommand::Echo(args) => echo::run(&args),
        Subcommand::Hz(args) => hz::run(&args),
        Subcommand::Latency(args) => latency::run(&args),
        Subcommand::Solve(args) => solve::run(args.question),
        Subcommand::Plan(args) => plan::run(&args),
        Subcommand::HandOver(args) => hand_over::run(&args),
        Subcommand::Doctor(args) => doctor::run(&args),
        Subcommand::Iox2Config(args) => print_iox2_config(&args),
        Subcommand::Completions(args) => shell::completions(args),
        Subcommand::Man(args) => shell::man(&args),
    }
}

/// Whether a subcommand only produces output and installs no signal handlers.
fn is_only_output(subcommand: &Subcommand) -> bool {
    use Subcommand::{Completions, Doctor, Export, HandOver, Iox2Config, Man, Solve};
    matches!(subcommand, Solve(_) | HandOver(_) | Export(_) | Doctor(_) | Iox2Config(_) | Completions(_) | Man(_))
}

fn print_iox2_config(args: &BusArgs) -> anyhow::Result<ExitCode> {
    let domain = args.domain()?;
    domain.create_secret()?;
    print::print_line(domain.iceoryx2_toml().trim_end())?;
    Ok(ExitCode::SUCCESS)
}

/// Reads the configuration that the arguments name; `set_flags` overrides its values. An error names the file.
fn load_config(args: &ConfigArgs, set_flags: impl FnOnce(&mut Document)) -> anyhow::Result<Config> {
    let file = args.config.as_deref();
    let document = reading::within_limits(file, || PlanDocument::load(file, set_flags, None));
    in_file(args, document.and_then(PlanDocument::build))
}

/// Reads a configuration without a dragon on its route.
fn load_document(args: &ConfigArgs) -> anyhow::Result<ConfigDocument> {
    let file = args.config.as_deref();
    in_file(args, reading::within_limits(file, || ConfigDocument::load(file, |_| ())))
}

/// Adds the file's name to the error of a configuration.
fn in_file<T, E>(args: &ConfigArgs, result: Result<T, E>) -> anyhow::Result<T>
where
    E: std::error::Error + Send + Sync + 'static,
{
    match &args.config {
        Some(path) => result.with_context(|| path.display().to_string()),
        None => Ok(result?),
    }
}

fn print_error(error: &anyhow::Error) {
    let remedy = remedy(error).map_or_else(String::new, |remedy| format!(": {remedy}"));
    let label = Painted::on(&io::stderr(), *Styles::styled().get_error(), "error:");
    print_to_stderr(&format!("{label} {}{remedy}", printable(&format!("{error:#}"))));
}

/// Prints help and version as clap does. Prints an error in one line.
fn report_usage(error: &clap::Error) -> ExitCode {
    let rendered = error.render();
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        let text = if is_coloured(&io::stdout()) { rendered.ansi().to_string() } else { rendered.to_string() };
        wait_for_reader(None);
        // `main` reports a failure when it finishes stdout.
        let _ = output::print(text.into_bytes());
        return ExitCode::SUCCESS;
    }
    let plain = rendered.to_string();
    // The message repeats the user's input. If the input has control characters, the message is escaped and has no colours.
    let is_plain = plain.lines().any(|line| matches!(printable(line), Cow::Owned(_)));
    let plain = plain.lines().map(printable).collect::<Vec<_>>().join("\n");
    let shown = if is_coloured(&io::stderr()) && !is_plain { rendered.ansi().to_string() } else { plain.clone() };
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        print_to_stderr(&shown);
    } else {
        print_to_stderr(&without_usage(&plain, &shown));
    }
    ExitCode::from(exit_status::BAD_INPUT)
}

/// A message of clap in one line, without usage and hints. `shown` has the same lines as `plain`, with colours or escaped.
fn without_usage(plain: &str, shown: &str) -> String {
    let lines = plain.lines().map(str::trim).zip(shown.lines().map(str::trim));
    let message = lines.take_while(|(line, _)| !line.starts_with("Usage:"));
    let said = message.filter(|(line, _)| !line.is_empty() && !line.starts_with("For more information"));
    said.map(|(_, shown)| shown).collect::<Vec<_>>().join(" ")
}

/// The remedy for an error that a limit of this process causes.
fn remedy(error: &anyhow::Error) -> Option<String> {
    let of_cause = error.chain().find_map(|cause| limits::remedy(cause.downcast_ref()?));
    of_cause.or_else(|| limits::remedy_in_words(&format!("{error:#}")))
}
