//! Who is on the bus.

use std::fs;

use bench_dragon_ipc::{Census, NodeEntry};

use super::{Check, Finding, Patient};

/// The server and its clients.
pub(super) struct Server;

impl Check for Server {
    fn name(&self) -> &'static str {
        "server"
    }

    fn examine(&self, patient: &Patient) -> Finding {
        match patient.census() {
            Ok(census) => judge(census, census.source.is_some_and(was_replaced)),
            Err(_) => Finding::not_known("the directory cannot be looked at"),
        }
    }
}

/// Whether the file that a process was started from is no longer there.
fn was_replaced(pid: u32) -> bool {
    fs::read_link(format!("/proc/{pid}/exe")).is_ok_and(|program| program.to_string_lossy().ends_with(" (deleted)"))
}

fn judge(census: &Census, was_replaced: bool) -> Finding {
    let clients = clients(census);
    let Some(pid) = census.source else {
        let told = if clients.is_empty() { "nobody is on the bus".to_owned() } else { format!("no server; {clients}") };
        return Finding::ok("none", told);
    };
    let value = format!("pid {pid}");
    let told = if clients.is_empty() { format!("pid {pid}, and no clients") } else { format!("pid {pid}; {clients}") };
    if was_replaced {
        let message = format!("{told}; its program has been replaced since it was started");
        return Finding::warning(value, message, "start it again, so that both sides are of the same version");
    }
    Finding::ok(value, told)
}

/// The clients by name and process id.
fn clients(census: &Census) -> String {
    let told = |node: &NodeEntry| match node.pid {
        Some(pid) => format!("{} ({pid})", node.name),
        None => node.name.clone(),
    };
    let is_client = |node: &&NodeEntry| node.pid.is_none() || node.pid != census.source;
    census.living.iter().filter(is_client).map(told).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    fn node(name: &str, pid: u32) -> NodeEntry {
        NodeEntry { name: name.to_owned(), pid: Some(pid) }
    }

    #[test]
    fn the_server_and_its_clients_are_told_apart() {
        let living = vec![node("serve", 7), node("monitor", 8)];
        let census = Census { source: Some(7), living, ..Census::default() };
        assert_eq!(judge(&census, false), Finding::ok("pid 7", "pid 7; monitor (8)"));
        assert_eq!(judge(&census, true).status, Verdict::Warning);
    }
}
