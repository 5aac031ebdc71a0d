//! Checks of the machine and the installation: what can prevent or disturb a show, and how to mend it.
//!
//! | file | checks |
//! |---|---|
//! | `bus` | directory, service layouts, half-made services, leftovers, foreign files |
//! | `server` | the server and its clients, the guard |
//! | `resources` | shared memory, memory limit, disk, open files, locked memory |
//! | `logout` | systemd's removal of shared memory |
//! | `real_time` | real-time priority and throttling |
//! | `machine` | versions, processor governor, clock source, timers |
//!
//! Each check reads its facts, and has a pure function to judge them. An examination changes nothing, and a running show does
//! not notice it: it takes no lock, and joins no bus. The one exception is a server without a guard: it is asked for its
//! status, as by any client. The real-time priority is tried in a thread of its own, which ends at once.

mod bus;
mod logout;
mod machine;
mod real_time;
mod resources;
mod server;

use std::fmt;
use std::path::PathBuf;

use bench_dragon_ipc::{Census, Domain, DomainError, Instance, service};
use serde::Serialize;

use crate::config::Config;

/// Reads the facts of one check and judges them.
type Check = fn(&Target) -> Finding;

/// Every check with its name, in the order of the report. The names are stable: JSON has them as they are.
const CHECKS: [(&str, Check); 19] = [
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
#[derive(Clone, Debug, Serialize)]
pub struct Examination {
    /// Each check's finding.
    pub checks: Vec<Examined>,
    /// What was cleaned up before, a line each.
    pub fixed: Vec<String>,
    /// Whether nothing is a problem.
    pub healthy: bool,
}

/// A check and its finding.
#[derive(Clone, Debug, Serialize)]
pub struct Examined {
    /// The check.
    pub name: &'static str,
    /// Its finding.
    #[serde(flatten)]
    pub finding: Finding,
}

impl Examination {
    /// Makes every check, after `fixed` was cleaned up.
    pub fn of(target: &Target, fixed: Vec<String>) -> Self {
        let checks = CHECKS.map(|(name, check)| Examined { name, finding: check(target) }).to_vec();
        let healthy = checks.iter().all(|check| check.finding.status != Verdict::Problem);
        Self { checks, fixed, healthy }
    }
}

/// How things stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// As it should be.
    Ok,
    /// A show runs, and may run worse than it could.
    Warning,
    /// A show does not run.
    Problem,
    /// This machine, or this user's rights, do not let it be told.
    NotKnown,
}

impl fmt::Display for Verdict {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Ok => "ok",
            Self::Warning => "warning",
            Self::Problem => "problem",
            Self::NotKnown => "not known",
        })
    }
}

/// What was found, what it means, and how to mend it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// How things stand.
    pub status: Verdict,
    /// What was found, as the system has it.
    pub value: String,
    /// What it means.
    pub message: String,
    /// How to mend it, where there is something to mend.
    pub remedy: Option<String>,
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

/// An instance on this machine, the dragon that it is to play, and the folder that it is to be recorded in.
#[derive(Debug)]
pub struct Target {
    instance: Instance,
    /// The directory of the bus, where the instance can have one.
    root: Option<PathBuf>,
    /// The processes and services on the bus, or the reason why they cannot be listed.
    census: Result<Census, DomainError>,
    config: Config,
    folder: PathBuf,
}

impl Target {
    /// Looks at the instance; the rest is read by the checks.
    pub fn new(instance: Instance, config: Config, folder: PathBuf) -> Self {
        let domain = Domain::new(instance.clone());
        let root = domain.as_ref().ok().map(|domain| domain.root().to_owned());
        let census = domain.and_then(|domain| Census::take(&domain));
        Self { instance, root, census, config, folder }
    }

    /// The finding of a check that judges the census.
    fn judge_census(&self, judge: impl FnOnce(&Census) -> Finding) -> Finding {
        self.census.as_ref().map_or_else(|_| Finding::not_known("the directory cannot be looked at"), judge)
    }

    /// Shared memory that a server of this dragon takes, with all its readers, in bytes.
    fn shared_memory(&self) -> u64 {
        let benches = self.config.dragon().dimensions().benches();
        service::frame_memory(benches) + service::SOURCE_MEMORY + service::ALERT_MEMORY
    }

    /// The command that cleans up.
    fn fix(&self) -> String {
        match &self.instance {
            default if *default == Instance::default() => "`bench-dragon doctor --fix`".to_owned(),
            other => format!("`bench-dragon doctor --fix --instance {other}`"),
        }
    }
}
