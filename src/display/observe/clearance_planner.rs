//! The thread that works out the planned clearance.

use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::thread;

use bench_dragon_geometry::dragon::Dragon;
use bench_dragon_geometry::planner::on_one_core;
use rustix::process::setpriority_process;

use super::planned_clearance::{PlannedClearance, Planning};

/// The thread's niceness: frames and scenes come first.
const NICENESS: i32 = 10;

/// A plan in the making. The thread is not joined: it ends with its owner, after the step that it is in.
#[derive(Debug)]
pub(super) struct ClearancePlanner {
    latest: Arc<Mutex<Arc<PlannedClearance>>>,
}

impl ClearancePlanner {
    /// Starts to plan the dragon's run, with the near misses under `near_m`.
    ///
    /// # Errors
    /// The operating system's reason why there can be no thread for it.
    pub(super) fn start(dragon: &Dragon, near_m: f64) -> io::Result<Self> {
        let latest = Arc::new(Mutex::new(Arc::default()));
        let shared = Arc::downgrade(&latest);
        let dragon = dragon.clone();
        let work = move || {
            // Of the calling thread alone, as Linux has it. Where it is refused, the work is done all the same.
            let _ = setpriority_process(None, NICENESS);
            on_one_core(|| plan(&dragon, near_m, &shared));
        };
        thread::Builder::new().name("plan".to_owned()).spawn(work)?;
        Ok(Self { latest })
    }

    /// What is known at present.
    pub(super) fn latest(&self) -> Arc<PlannedClearance> {
        Arc::clone(&lock(&self.latest))
    }
}

/// Works the plan out for as long as somebody waits for it.
fn plan(dragon: &Dragon, near_m: f64, latest: &Weak<Mutex<Arc<PlannedClearance>>>) {
    for plan in Planning::new(dragon, near_m) {
        let Some(latest) = latest.upgrade() else { return };
        *lock(&latest) = Arc::new(plan);
    }
}

fn lock(latest: &Mutex<Arc<PlannedClearance>>) -> MutexGuard<'_, Arc<PlannedClearance>> {
    latest.lock().unwrap_or_else(PoisonError::into_inner)
}
