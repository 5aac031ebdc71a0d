//! What of the machine and the installation stands in the way of a show: one [`Check`] a file, each of which reads its facts
//! and has a pure function to judge them.
//!
//! An examination changes nothing, and a running show does not notice it: it takes no lock, and joins no bus. The one
//! exception is a server without a guard: it is asked for its status, as by any client. The one thing that an examination
//! tries out, a real-time priority, it tries in a thread of its own that ends at once.

mod clock_source;
mod directory;
mod disk;
mod finding;
mod foreign;
mod governor;
mod guard;
mod half_made;
mod killed;
mod locked_memory;
mod memory_limit;
mod open_files;
mod patient;
mod real_time;
mod remove_ipc;
mod server;
mod services;
mod shared_memory;
mod throttling;
mod timers;
mod version;

pub use finding::{Finding, Verdict};
pub use patient::Patient;

use serde::Serialize;

/// One thing to look at.
pub trait Check {
    /// Its name, stable: in JSON as it is.
    fn name(&self) -> &'static str;

    /// Reads the facts and judges them.
    fn examine(&self, patient: &Patient) -> Finding;
}

/// All that was found.
#[derive(Clone, Debug, Serialize)]
pub struct Examination {
    /// Each check's finding.
    pub checks: Vec<Examined>,
    /// What was cleaned up before, a line each.
    pub fixed: Vec<String>,
    /// Whether nothing is a problem.
    pub healthy: bool,
}

/// What one check has found.
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
    pub fn of(patient: &Patient, fixed: Vec<String>) -> Self {
        let examined = |check: &dyn Check| Examined { name: check.name(), finding: check.examine(patient) };
        let checks: Vec<Examined> = all().iter().map(|check| examined(check.as_ref())).collect();
        let healthy = checks.iter().all(|check| check.finding.status != Verdict::Problem);
        Self { checks, fixed, healthy }
    }
}

/// The checks, in the order in which they are told.
fn all() -> Vec<Box<dyn Check>> {
    vec![
        Box::new(version::Version),
        Box::new(directory::Directory),
        Box::new(server::Server),
        Box::new(guard::Guard),
        Box::new(services::Services),
        Box::new(half_made::HalfMade),
        Box::new(killed::Killed),
        Box::new(foreign::Foreign),
        Box::new(shared_memory::SharedMemory),
        Box::new(memory_limit::MemoryLimit),
        Box::new(remove_ipc::RemoveIpc),
        Box::new(disk::Disk),
        Box::new(open_files::OpenFiles),
        Box::new(locked_memory::LockedMemory),
        Box::new(real_time::RealTime),
        Box::new(throttling::Throttling),
        Box::new(governor::Governor),
        Box::new(clock_source::ClockSource),
        Box::new(timers::Timers),
    ]
}
