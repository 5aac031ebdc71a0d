//! Checks of the running show: the server, its clients, and the guard.

use std::collections::BTreeMap;
use std::fs;
use std::thread;
use std::time::Duration;

use bench_dragon_ipc::guard::GuardLock;
use bench_dragon_ipc::{
    BusError, Census, Description, DescriptionReader, Domain, GuardState, NodeEntry, Status, StatusReader,
};

use super::{Finding, Target};

/// Number of looks for what a server sends. It sends its status ten times a second.
const LOOKS: u32 = 50;
/// Time between two looks.
const LOOK_PERIOD: Duration = Duration::from_millis(20);
/// Greatest number of clients that are named.
const MOST_NAMED: usize = 8;

/// The server and its clients.
pub(super) fn server(target: &Target) -> Finding {
    target.judge_census(|census| {
        let is_stopped = census.source.is_some_and(is_stopped);
        if is_stopped { stopped_server(census) } else { judge_server(census, census.source.is_some_and(was_replaced)) }
    })
}

/// Whether a process is stopped by a signal (`proc(5)`: the field after the name in parentheses).
fn is_stopped(pid: u32) -> bool {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit_once(") ").is_some_and(|(_, rest)| rest.starts_with('T'))
}

fn stopped_server(census: &Census) -> Finding {
    let pid = census.source.map_or("PID".to_owned(), |pid| pid.to_string());
    Finding::problem(
        format!("pid {pid}"),
        format!("pid {pid} is stopped by a signal, and publishes nothing"),
        format!("continue it: kill -CONT {pid}"),
    )
}

/// Whether the program file of a process has been deleted or replaced.
fn was_replaced(pid: u32) -> bool {
    fs::read_link(format!("/proc/{pid}/exe")).is_ok_and(|program| program.to_string_lossy().ends_with(" (deleted)"))
}

fn judge_server(census: &Census, was_replaced: bool) -> Finding {
    let clients = clients(census);
    let Some(pid) = census.source else {
        if census.has_source {
            let clients = if clients.is_empty() { "no clients".to_owned() } else { clients };
            return Finding::ok(
                "runs",
                format!("a server runs in another PID namespace, such as a container; {clients}"),
            );
        }
        let message =
            if clients.is_empty() { "no process is on the bus".to_owned() } else { format!("no server; {clients}") };
        return Finding::ok("none", message);
    };
    let value = format!("pid {pid}");
    let message =
        if clients.is_empty() { format!("pid {pid}, and no clients") } else { format!("pid {pid}; {clients}") };
    if was_replaced {
        let message = format!("{message}; its program file was replaced after the start");
        return Finding::warning(value, message, "restart the server, so that all programs have the same version");
    }
    Finding::ok(value, message)
}

/// The clients, a name for each process: the first ones, and the number of the others.
fn clients(census: &Census) -> String {
    let mut of_processes: BTreeMap<u32, Vec<&str>> = BTreeMap::new();
    let mut elsewhere = Vec::new();
    for NodeEntry { name, pid } in &census.living {
        match pid {
            Some(pid) if census.source == Some(*pid) => {}
            Some(pid) => of_processes.entry(*pid).or_default().push(name),
            None => elsewhere.push(name.clone()),
        }
    }
    let of_process = |(pid, names): (u32, Vec<&str>)| format!("{} ({pid})", common_name(&names));
    let clients: Vec<String> = of_processes.into_iter().map(of_process).chain(elsewhere).collect();
    let named = clients[..clients.len().min(MOST_NAMED)].join(", ");
    match clients.len().saturating_sub(MOST_NAMED) {
        0 => named,
        others => format!("{named}, and {others} more"),
    }
}

/// The words with which all names begin, as `view` of `view-events` and `view-status`; without such a word the shortest name.
fn common_name(names: &[&str]) -> String {
    let shortest = *names.iter().min_by_key(|name| name.len()).expect("a process has a name");
    let starts = |words: &&str| names.iter().all(|name| name.strip_prefix(words).is_some_and(is_end_of_word));
    let ends = shortest.match_indices('-').map(|(end, _)| end).chain([shortest.len()]);
    let common = ends.map(|end| &shortest[..end]).rfind(starts);
    common.unwrap_or(shortest).to_owned()
}

fn is_end_of_word(rest: &str) -> bool {
    rest.is_empty() || rest.starts_with('-')
}

/// Whether a guarded server has a guard.
pub(super) fn guard(target: &Target) -> Finding {
    let Ok(domain) = Domain::new(target.instance.clone()) else {
        return Finding::not_known("the directory cannot be read");
    };
    let has_server = target.has_server();
    let guard = GuardLock::holder(&domain);
    let status = if has_server && guard.is_none() { status_of(target) } else { None };
    judge_guard(has_server, guard, status.and_then(|status| status.guard_state()))
}

/// The status of the server that runs. Reading it joins the bus, which removes leftovers. The doctor must change nothing, so it
/// reads the status only if there are no leftovers.
pub(super) fn status_of(target: &Target) -> Option<Status> {
    let reader = StatusReader::open(&bus_of(target)?, "doctor").ok()?;
    awaited(|| reader.poll())
}

/// The description of the server that runs: read as its status is.
pub(super) fn description_of(target: &Target) -> Option<Description> {
    let reader = DescriptionReader::open(&bus_of(target)?, "doctor").ok()?;
    awaited(|| reader.poll())
}

/// The bus of a server that runs; `None` if joining it would remove leftovers.
fn bus_of(target: &Target) -> Option<Domain> {
    let is_clean = |census: &Census| census.has_source && census.dead.is_empty() && census.half_made.is_empty();
    target.census.as_ref().ok().filter(|census| is_clean(census))?;
    Some(Domain::new(target.instance.clone()).ok()?.for_operators())
}

/// Waits for what the server sends, up to a second. `None` if it sends nothing.
fn awaited<T>(poll: impl Fn() -> Result<Option<T>, BusError>) -> Option<T> {
    (0..LOOKS).find_map(|look| {
        if look > 0 {
            thread::sleep(LOOK_PERIOD);
        }
        poll().ok().flatten()
    })
}

/// Judges the guard by its lock and by the server's status. Only the status reports a guard of another PID namespace.
fn judge_guard(has_server: bool, guard: Option<u32>, reported: Option<GuardState>) -> Finding {
    match (has_server, guard, reported) {
        (true, Some(pid), _) => Finding::ok(format!("pid {pid}"), format!("pid {pid} proves the travel ahead")),
        (false, Some(pid), _) => Finding::ok(format!("pid {pid}"), format!("pid {pid} waits for a server")),
        (false, None, _) => Finding::ok("none", "no server, and no guard"),
        (true, None, Some(GuardState::None)) => Finding::ok("none", "the server is not guarded and needs no guard"),
        (true, None, Some(GuardState::Running)) => {
            Finding::ok("runs", "a guard runs in another PID namespace, and proves the travel ahead")
        }
        (true, None, Some(GuardState::Missing)) => Finding::problem(
            "none",
            "the server is guarded, but no guard runs: the head stops at the end of its last grant",
            "start `bench-dragon monitor --guard`, or the server without --guarded",
        ),
        (true, None, None) => Finding::not_known(
            "no guard runs; whether the server needs one is unknown: it sends no status, or leftovers prevent the check",
        ),
    }
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use rustix::process::{Pid, Signal, WaitOptions, kill_process, waitpid};

    use super::*;
    use crate::cli::doctor::finding::Verdict;

    fn node(name: &str, pid: u32) -> NodeEntry {
        NodeEntry { name: name.to_owned(), pid: Some(pid) }
    }

    #[test]
    fn the_server_is_not_listed_among_its_clients() {
        let living = vec![node("serve", 7), node("monitor", 8)];
        let census = Census { source: Some(7), has_source: true, living, ..Census::default() };
        assert_eq!(judge_server(&census, false), Finding::ok("pid 7", "pid 7; monitor (8)"));
        assert_eq!(judge_server(&census, true).status, Verdict::Warning);
        let crowd = Census { living: (0..20).map(|pid| node("hz", 100 + pid)).collect(), ..census };
        let message = judge_server(&crowd, false).message;
        assert!(message.ends_with("hz (107), and 12 more"), "{message}");
    }

    #[test]
    fn a_process_with_several_names_is_one_client() {
        for (names, expected) in [
            (&["view-events", "view-status"][..], "view"),
            (&["my-reader"], "my-reader"),
            (&["my-reader", "my-reader-status"], "my-reader"),
            (&["guard-status", "monitor", "guard", "monitor-status"], "guard"),
            (&["bridge-psn", "bridge-p"], "bridge"),
        ] {
            let living = names.iter().map(|name| node(name, 8)).collect();
            let census = Census { source: Some(7), has_source: true, living, ..Census::default() };
            assert_eq!(judge_server(&census, false).message, format!("pid 7; {expected} (8)"));
        }
    }

    #[test]
    fn a_stopped_server_is_a_problem() {
        let census = Census { source: Some(7), has_source: true, ..Census::default() };
        assert_eq!(stopped_server(&census).status, Verdict::Problem);
        let mut child = Command::new("sleep").arg("600").spawn().expect("a process");
        assert!(!is_stopped(child.id()));
        kill_process(Pid::from_child(&child), Signal::STOP).expect("a child");
        let stopped =
            waitpid(Some(Pid::from_child(&child)), WaitOptions::UNTRACED).expect("a child").expect("a change");
        assert!(stopped.1.stopped() && is_stopped(child.id()));
        child.kill().expect("a child");
        child.wait().expect("a child");
    }

    #[test]
    fn only_a_guarded_server_without_a_guard_is_a_problem() {
        for (has_server, guard, reported, expected) in [
            (false, None, None, Verdict::Ok),
            (true, None, Some(GuardState::None), Verdict::Ok),
            (true, Some(7), Some(GuardState::Running), Verdict::Ok),
            (true, Some(7), None, Verdict::Ok),
            (true, None, Some(GuardState::Running), Verdict::Ok),
            (true, None, Some(GuardState::Missing), Verdict::Problem),
            (true, None, None, Verdict::NotKnown),
        ] {
            assert_eq!(
                judge_guard(has_server, guard, reported).status,
                expected,
                "{has_server} {guard:?} {reported:?}"
            );
        }
    }
}
