//! `doctor`: finds problems of the machine and the installation that can prevent or disturb a show, and their remedies.
//!
//! | file | checks |
//! |---|---|
//! | `bus` | directory, service layouts, half-made services, leftovers, foreign files |
//! | `server` | the server and its clients, the guard |
//! | `resources` | shared memory, memory limit, disk, open files, locked memory |
//! | `logout` | systemd's removal of shared memory |
//! | `real_time` | real-time priority and throttling |
//! | `machine` | versions, processor governor, clock source, timers |
//! | `tonight` | with `--tonight`: plan, room for the recording, ports, desks |
//!
//! Each check reads its facts and judges them in a pure function. The checks change nothing and do not disturb a running show:
//! they take no lock and join no bus. There is one exception: if a server runs without a guard, a check reads the server's
//! status, like any client. The check of the real-time priority requests it in a separate thread, which ends at once.

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context as _;
use bench_dragon_ipc::{BusError, Census, Cleared, Domain, DomainError, Instance, NodeEntry, clear, service};
use clap::builder::styling::{AnsiColor, Style};
use clap::{Args, ValueHint};
use serde::Serialize;

use crate::cli::flags::{BusArgs, ConfigArgs, Format, FormatArgs};
use crate::cli::load_config;
use crate::cli::print::{print_json, print_line};
use crate::cli::show::AlsoCommand;
use crate::config::Config;
use crate::output::terminal_text::Painted;

mod bus;
mod logout;
mod machine;
mod real_time;
mod resources;
mod server;
mod tonight;

/// Check the machine and the installation, and print a remedy for each problem.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon doctor
  bench-dragon doctor --config stage.toml --instance main --out /mnt/show/tonight
  bench-dragon doctor --tonight --config stage.toml
  bench-dragon doctor --fix
  bench-dragon doctor --format json | jq .healthy

The exit status is 1 if a check finds a problem; a warning is not a problem. The checks do not disturb a running show.")]
pub(crate) struct DoctorArgs {
    /// Before the checks, remove files and entries of the instance that no living process owns.
    #[arg(long)]
    pub(crate) fix: bool,
    /// Also check what the show of the configuration needs: a plan that a guard can prove to its end, room for the recording, free
    /// ports and a way to each desk of `[[show.also]]`.
    #[arg(long)]
    pub(crate) tonight: bool,
    /// Folder of the show, as for `show`, whose disk is checked [default: the current folder].
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

pub(crate) fn run(args: &DoctorArgs) -> anyhow::Result<ExitCode> {
    let config = load_config(&args.config, |_| ())?;
    let fixed = if args.fix {
        Domain::new(args.bus.instance.clone()).map_err(BusError::from).and_then(|domain| clear(&domain))
    } else {
        Ok(Cleared::default())
    };
    let (fixed, failed) = match fixed {
        Ok(cleared) => (lines(&cleared), None),
        // The check of the directory reports this error.
        Err(BusError::Domain(_)) => (Vec::new(), None),
        Err(error) => (Vec::new(), Some(error)),
    };
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from("."));
    let beside = if args.tonight { AlsoCommand::read_all(&config.also(), &args.bus.instance)? } else { Vec::new() };
    let target = Target::new(args.bus.instance.clone(), config, out, beside);
    let tonight = if args.tonight { tonight::CHECKS } else { &[] };
    let checks: Vec<Examined> =
        CHECKS.iter().chain(tonight).map(|&(name, check)| Examined { name, finding: check(&target) }).collect();
    let healthy = checks.iter().all(|check| check.finding.status != Verdict::Problem);
    let examination = Examination { checks, fixed, healthy };
    match args.format.format {
        Format::Json => print_json(&examination)?,
        Format::Text => print_text(&examination)?,
    }
    match failed {
        Some(error) => Err(error).context("cannot clean up"),
        None if examination.healthy => Ok(ExitCode::SUCCESS),
        None => Ok(ExitCode::FAILURE),
    }
}

/// The removed nodes and files, one line each.
fn lines(cleared: &Cleared) -> Vec<String> {
    let node = |node: &NodeEntry| match node.pid {
        Some(pid) => format!("removed the entry of {}, pid {pid}, which was killed", node.name),
        None => "removed the entry of a process that was killed".to_owned(),
    };
    let paths = cleared.paths.iter().map(|path| format!("removed {}", path.display()));
    cleared.nodes.iter().map(node).chain(paths).collect()
}

/// Prints one line per check, and a second line with the remedy if there is one.
fn print_text(examination: &Examination) -> anyhow::Result<()> {
    for line in &examination.fixed {
        print_line(line)?;
    }
    for Examined { name, finding } in &examination.checks {
        let (status, style) = finding.status.shown();
        let status = Painted::on(&io::stdout(), style, format!("{status:<9}"));
        print_line(format_args!("{status}  {name:<20}  {}", finding.message))?;
        if let Some(remedy) = &finding.remedy {
            print_line(format_args!("{:<9}  {:<20}  remedy: {remedy}", "", ""))?;
        }
    }
    Ok(())
}

/// Reads the facts of one check and judges them.
type Check = fn(&Target) -> Finding;

/// All checks with their names, in the order of the report. The names are stable, because the JSON contains them.
const CHECKS: &[(&str, Check)] = &[
    ("version", machine::version),
    ("directory", bus::directory),
    ("server", server::server),
    ("guard", server::guard),
    ("services", bus::services),
    ("half-made services", bus::half_made),
    ("leftovers", bus::leftovers),
    ("foreign files", bus::foreign_files),
    ("shared memory", resources::shared_memory),
    ("memory limit", resources::memory_limit),
    ("logout", logout::shared_memory_at_logout),
    ("disk", resources::disk),
    ("open files", resources::open_files),
    ("locked memory", resources::locked_memory),
    ("real-time priority", real_time::priority),
    ("real-time throttling", real_time::throttling),
    ("processor governor", machine::governor),
    ("clock source", machine::clock_source),
    ("timers", machine::timers),
];

/// The findings of all checks.
#[derive(Serialize)]
struct Examination {
    checks: Vec<Examined>,
    /// The removed nodes and files, one line each.
    fixed: Vec<String>,
    /// Whether no check found a problem.
    healthy: bool,
}

/// A check and its finding.
#[derive(Serialize)]
struct Examined {
    name: &'static str,
    #[serde(flatten)]
    finding: Finding,
}

/// The judgement of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Verdict {
    Ok,
    /// A show runs, but may be disturbed.
    Warning,
    /// A show does not run.
    Problem,
    /// The machine does not report the fact, or this user has no right to read it.
    NotKnown,
}

impl Verdict {
    /// The verdict's word and its style in the report.
    fn shown(self) -> (&'static str, Style) {
        match self {
            Self::Ok => ("ok", AnsiColor::Green.on_default()),
            Self::Warning => ("warning", AnsiColor::Yellow.on_default()),
            Self::Problem => ("problem", AnsiColor::Red.on_default().bold()),
            Self::NotKnown => ("not known", Style::new().dimmed()),
        }
    }
}

/// The result of a check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
struct Finding {
    status: Verdict,
    /// The fact, as the system reports it.
    value: String,
    /// The meaning of the fact.
    message: String,
    /// The remedy for a warning or a problem.
    remedy: Option<String>,
}

impl Finding {
    fn ok(value: impl Into<String>, message: impl Into<String>) -> Self {
        Self { status: Verdict::Ok, value: value.into(), message: message.into(), remedy: None }
    }

    fn not_known(message: impl Into<String>) -> Self {
        Self { status: Verdict::NotKnown, value: String::new(), message: message.into(), remedy: None }
    }

    fn warning(value: impl Into<String>, message: impl Into<String>, remedy: impl Into<String>) -> Self {
        let (value, message, remedy) = (value.into(), message.into(), Some(remedy.into()));
        Self { status: Verdict::Warning, value, message, remedy }
    }

    fn problem(value: impl Into<String>, message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { status: Verdict::Problem, ..Self::warning(value, message, remedy) }
    }
}

/// An instance on this machine, and the configuration of its dragon.
struct Target {
    instance: Instance,
    /// The directory of the bus, if the instance can have one.
    root: Option<PathBuf>,
    /// The processes and services on the bus, or the reason for which they cannot be listed.
    census: Result<Census, DomainError>,
    config: Config,
    /// The folder in which the show would record.
    out: PathBuf,
    /// The commands of `[[show.also]]`; none without `--tonight`.
    beside: Vec<AlsoCommand>,
}

impl Target {
    /// Takes a census of the instance. The checks read all other facts.
    fn new(instance: Instance, config: Config, out: PathBuf, beside: Vec<AlsoCommand>) -> Self {
        let domain = Domain::new(instance.clone());
        let root = domain.as_ref().ok().map(|domain| domain.root().to_owned());
        let census = domain.and_then(|domain| Census::take(&domain));
        Self { instance, root, census, config, out, beside }
    }

    /// The finding of a check that judges the census.
    fn judge_census(&self, judge: impl FnOnce(&Census) -> Finding) -> Finding {
        self.census.as_ref().map_or_else(|_| Finding::not_known("the directory cannot be read"), judge)
    }

    /// Shared memory, in bytes, of a server of this dragon with the greatest number of readers.
    fn shared_memory(&self) -> u64 {
        let handles = self.config.formation().layout().handles();
        service::frame_memory(handles) + service::SOURCE_MEMORY + service::ALERT_MEMORY
    }

    /// The command that removes leftovers.
    fn fix(&self) -> String {
        match &self.instance {
            default if *default == Instance::default() => "`bench-dragon doctor --fix`".to_owned(),
            other => format!("`bench-dragon doctor --fix --instance {other}`"),
        }
    }
}
