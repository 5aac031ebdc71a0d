//! Whether a guarded server has a guard.

use std::thread;
use std::time::Duration;

use bench_dragon_ipc::{Domain, GuardLock, Status, StatusReader};

use super::{Check, Finding, Patient};

/// How long the status of a server is waited for: the server sends it ten times a second.
const LOOKS: u32 = 50;
const LOOK_PERIOD: Duration = Duration::from_millis(20);

/// The guard.
pub(super) struct Guard;

impl Check for Guard {
    fn name(&self) -> &'static str {
        "guard"
    }

    fn examine(&self, patient: &Patient) -> Finding {
        let Ok(domain) = Domain::new(patient.instance().clone()) else {
            return Finding::not_known("the directory cannot be looked at");
        };
        let census = patient.census();
        let has_server = census.is_ok_and(|census| census.source.is_some());
        let guard = GuardLock::holder(&domain);
        // The server alone knows whether it is guarded. It is asked only where the answer matters, and where there is
        // nothing that a process removes by joining the bus: an examination changes nothing.
        let is_clean = census.is_ok_and(|census| census.dead.is_empty() && census.half_made.is_empty());
        let status = if has_server && guard.is_none() && is_clean { status(&domain) } else { None };
        judge(has_server, guard, status.map(|status| !status.granted_to_m.is_nan()))
    }
}

/// The status of the server of a domain, where it sends one.
fn status(domain: &Domain) -> Option<Status> {
    let reader = StatusReader::open(domain, "doctor").ok()?;
    (0..LOOKS).find_map(|look| {
        if look > 0 {
            thread::sleep(LOOK_PERIOD);
        }
        reader.poll().ok().flatten()
    })
}

fn judge(has_server: bool, guard: Option<u32>, is_guarded: Option<bool>) -> Finding {
    match (has_server, guard, is_guarded) {
        (_, Some(pid), _) => Finding::ok(format!("pid {pid}"), format!("pid {pid} proves the way ahead")),
        (false, None, _) => Finding::ok("none", "no server, and no guard"),
        (true, None, Some(false)) => Finding::ok("none", "the server is not guarded, and needs none"),
        (true, None, Some(true)) => Finding::problem(
            "none",
            "the server is guarded and no guard runs: the head stands where its last grant ends",
            "start `bench-dragon monitor --guard`, or the server without --guarded",
        ),
        (true, None, None) => Finding::not_known(
            "no guard runs; the server is asked whether it needs one once no leftovers are in the way",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    #[test]
    fn only_a_guarded_server_without_a_guard_is_a_problem() {
        for (has_server, guard, is_guarded, expected) in [
            (false, None, None, Verdict::Ok),
            (true, None, Some(false), Verdict::Ok),
            (true, Some(7), Some(true), Verdict::Ok),
            (true, Some(7), None, Verdict::Ok),
            (true, None, Some(true), Verdict::Problem),
            (true, None, None, Verdict::NotKnown),
        ] {
            assert_eq!(judge(has_server, guard, is_guarded).status, expected, "{has_server} {guard:?} {is_guarded:?}");
        }
    }
}
