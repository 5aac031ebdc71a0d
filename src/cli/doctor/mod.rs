//! `doctor`: finds problems of the machine and the installation that can prevent or disturb a show, and their remedies.
//!
//! | file | checks |
//! |---|---|
//! | `bus` | directory, service layouts, half-made services, leftovers, foreign files |
//! | `server` | the server and its clients, the guard |
//! | `resources` | shared memory, memory limit, disk, open files, locked memory |
//! | `logout` | systemd's removal of shared memory |
//! | `real_time` | real-time priority and throttling |
//! | `machine` | versions, processor governor and idle states, clock source, timers |
//! | `tonight` | with `--tonight`: the configuration of the show that runs, plan, room for the recording, ports, desks |
//! | `page`, `timecode` | with `--tonight`: whether browsers reach the pages, and whether timecode arrives |
//!
//! `finding` has what a check returns, `sheet` the check sheet in the show's folder.
//!
//! Each check reads its facts and judges them in a pure function. The checks change nothing and do not disturb a running show:
//! they take no lock and join no bus. There is one exception: if a server runs without a guard, with timecode, or with
//! `--tonight`, a check reads the server's status or its description, like any client. The check of the real-time priority requests it
//! in a separate thread, which ends at once.

use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context as _;
use bench_dragon_ipc::{BusError, Census, Cleared, Domain, DomainError, Instance, NodeEntry, clear, service};
use clap::{Args, ValueHint};

use crate::cli::flags::{BadInput, Format, FormatArgs};
use crate::cli::print::{print_json, print_line};
use crate::cli::serve::{RunArgs, check_pace, configure, end_s};
use crate::cli::show::{AlsoCommand, MannerArgs};
use crate::cli::timecode::{TimecodeArgs, check_show};
use crate::config::Config;
use crate::output::terminal_text::Painted;

mod bus;
mod finding;
mod logout;
mod machine;
mod page;
mod real_time;
mod resources;
mod server;
mod sheet;
mod timecode;
mod tonight;

use finding::{Examination, Examined, Finding};
pub(crate) use sheet::CheckSheet;

/// Check the machine and the installation, and print a remedy for each problem.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon doctor
  bench-dragon doctor --config stage.toml --instance main --out /mnt/show/tonight
  bench-dragon doctor --tonight --config stage.toml --view --out tonight
  bench-dragon doctor --fix
  bench-dragon doctor --format json | jq .healthy

The exit status is 1 if a check finds a problem; a warning is not a problem. The checks do not disturb a running show.

Give --tonight all flags of the show, such as --view, --timecode, --guard and --out. With --out it removes the sheet of earlier checks, and writes the check sheet into \
the folder: checks.html to print and to sign, and checks.json. The show with this folder has the sheet as the first page of its report.")]
pub(crate) struct DoctorArgs {
    /// Before the checks, remove files and entries of the instance that no living process owns.
    #[arg(long)]
    pub(crate) fix: bool,
    /// Also check whether a show that runs plays this configuration, and what it needs: a plan that a guard can prove
    /// to its end, room for the recording, free ports, a way to each desk of `[[show.also]]`, pages that browsers
    /// reach, and timecode that arrives.
    #[arg(long)]
    pub(crate) tonight: bool,
    /// Folder of the show, as for `show`, whose disk is checked [default: the current folder]. With --tonight, the check sheet is
    /// written into it.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) run: RunArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
    #[command(flatten, next_help_heading = "Flags of the show, for the checks of --tonight")]
    pub(crate) manner: MannerArgs,
}

pub(crate) fn run(args: &DoctorArgs) -> anyhow::Result<ExitCode> {
    if args.manner.view.is_some() && !args.tonight {
        return Err(BadInput("--view is a check of --tonight, must be given with it".to_owned()).into());
    }
    let sheet_folder = args.out.as_deref().filter(|_| args.tonight);
    sheet_folder.map_or(Ok(()), sheet::make_room)?;
    let mut target = Target::read(args)?;
    let (fixed, failed) = fix(args);
    if args.fix {
        target.census = census(&target.instance);
    }
    let tonight = if args.tonight { tonight::CHECKS } else { &[] };
    let examined = |&(name, check): &(&str, Check)| Examined { name: name.to_owned(), finding: check(&target) };
    let examination = Examination::new(CHECKS.iter().chain(tonight).map(examined).collect(), fixed);
    match args.format.format {
        Format::Json => print_json(&examination)?,
        Format::Text => print_text(&examination, args.tonight)?,
    }
    let healthy = examination.healthy;
    if let Some(folder) = sheet_folder {
        write_sheet(args, &target, examination, folder)?;
    }
    match failed {
        Some(error) => Err(error).context("cannot clean up"),
        None if healthy => Ok(ExitCode::SUCCESS),
        None => Ok(ExitCode::FAILURE),
    }
}

/// Cleans up, if asked. Returns what was removed, and the error.
fn fix(args: &DoctorArgs) -> (Vec<String>, Option<BusError>) {
    if !args.fix {
        return (Vec::new(), None);
    }
    let domain = Domain::new(args.run.bus.instance.clone()).map_err(BusError::from);
    match domain.and_then(|domain| clear(&domain)) {
        Ok(cleared) => (lines(&cleared), None),
        // The check of the directory reports this error.
        Err(BusError::Domain(_)) => (Vec::new(), None),
        Err(error) => (Vec::new(), Some(error)),
    }
}

/// Writes the check sheet of a show into its folder.
fn write_sheet(args: &DoctorArgs, target: &Target, examination: Examination, folder: &Path) -> anyhow::Result<()> {
    let sheet = CheckSheet::new(examination, target, args.run.config.config.clone());
    let page = sheet.write(folder)?;
    if args.format.format == Format::Text {
        print_line(format_args!("check sheet: {}", page.display()))?;
    }
    Ok(())
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

/// Prints one line per check, a second line with the remedy if there is one, and whether the show of tonight may begin.
fn print_text(examination: &Examination, is_tonight: bool) -> anyhow::Result<()> {
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
    if is_tonight {
        print_line(examination.verdict().words)?;
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
    ("processor idle", machine::idle_states),
    ("clock source", machine::clock_source),
    ("timers", machine::timers),
];

/// An instance on this machine, and its show.
struct Target {
    instance: Instance,
    /// The directory of the bus, if the instance can have one.
    root: Option<PathBuf>,
    /// The processes and services on the bus, or the reason for which they cannot be listed.
    census: Result<Census, DomainError>,
    config: Config,
    /// Show times at which the show starts and ends, in seconds.
    from_s: f64,
    until_s: f64,
    /// The folder in which the show would record.
    out: PathBuf,
    /// The commands of `[[show.also]]`; none without `--tonight`.
    beside: Vec<AlsoCommand>,
    /// The page of the show.
    view: Option<SocketAddr>,
    timecode: TimecodeArgs,
}

fn census(instance: &Instance) -> Result<Census, DomainError> {
    Domain::new(instance.clone()).and_then(|domain| Census::take(&domain))
}

impl Target {
    /// Reads the configuration, and takes a census of the instance. The checks read all other facts.
    fn read(args: &DoctorArgs) -> anyhow::Result<Self> {
        let RunArgs { bus, config, pace, timecode } = &args.run;
        let config = configure(config, pace, args.manner.guard)?;
        check_pace(&config, pace)?;
        check_show(timecode, &config)?;
        let instance = bus.instance.clone();
        let beside = if args.tonight { AlsoCommand::read_all(&config.also(), &instance)? } else { Vec::new() };
        let from_s = pace.start_at.unwrap_or_else(|| config.start_s());
        let until_s = pace.until.unwrap_or_else(|| end_s(&config, from_s));
        let root = Domain::new(instance.clone()).ok().map(|domain| domain.root().to_owned());
        let census = census(&instance);
        let out = args.out.clone().unwrap_or_else(|| PathBuf::from("."));
        let (view, timecode) = (args.manner.view, timecode.clone());
        Ok(Self { instance, root, census, config, from_s, until_s, out, beside, view, timecode })
    }

    /// Whether a server runs.
    fn has_server(&self) -> bool {
        self.census.as_ref().is_ok_and(|census| census.has_source)
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
