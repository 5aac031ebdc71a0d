//! The processes on the bus according to a census, for an observer that looks only for a short time: it has not heard a reader or
//! a source that was killed or stopped before.

use bench_dragon_ipc::{Census, Domain, NodeEntry};

/// Name under which a server joins the bus.
const SERVER: &str = "serve";

/// The processes on the bus.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Members {
    /// Process id of the source; `None` without one, or in another PID namespace.
    pub source: Option<u32>,
    /// Whether the process of a source exists.
    pub has_source: bool,
    /// Processes that exist.
    pub living: Vec<NodeEntry>,
    /// Processes that were killed, and whose remains no other process has removed yet.
    pub dead: Vec<NodeEntry>,
}

impl Members {
    /// The processes on the bus of a domain, with the remains of killed ones: operators' tools leave those of the show's parts.
    pub fn of(domain: &Domain) -> Self {
        let Census { source, has_source, living, dead, .. } = Census::take(domain).unwrap_or_default();
        Self { source, has_source, living, dead }
    }

    /// These processes, without those that have ended since.
    #[must_use]
    pub fn still_there(self, domain: &Domain) -> Self {
        self.without_ended(&Self::of(domain))
    }

    /// These processes, without those that are not among the present ones. The source is the present one.
    fn without_ended(mut self, now: &Self) -> Self {
        self.living.retain(|member| now.living.contains(member));
        Self { source: now.source, has_source: now.has_source, ..self }
    }

    /// Whether a server was killed, and no source has started since.
    pub fn has_lost_server(&self) -> bool {
        !self.has_source && self.dead.iter().any(|member| member.name == SERVER)
    }

    /// The process ids of the existing processes of a name; `None` for one in another PID namespace.
    pub(super) fn living(&self, name: &str) -> impl Iterator<Item = Option<u32>> {
        self.living.iter().filter(move |member| member.name == name).map(|member| member.pid)
    }

    /// The state of a reader that has sent no report, in a few words; `None` if no such process is known.
    pub(super) fn unheard(&self, name: &str) -> Option<String> {
        let of_name = |members: &[NodeEntry]| members.iter().find(|member| member.name == name).cloned();
        if let Some(NodeEntry { pid, .. }) = of_name(&self.living) {
            let pid = pid.map_or(String::new(), |pid| format!(" (pid {pid})"));
            return Some(format!("does not report{pid}"));
        }
        of_name(&self.dead).map(|_| "was killed".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(name: &str, pid: Option<u32>) -> NodeEntry {
        NodeEntry { name: name.to_owned(), pid }
    }

    #[test]
    fn a_server_is_lost_if_it_was_killed_and_no_source_has_started() {
        let killed = Members { dead: vec![entry("record", Some(3)), entry(SERVER, Some(4))], ..Members::default() };
        assert!(killed.has_lost_server());
        assert!(!Members { has_source: true, ..killed.clone() }.has_lost_server());
        assert!(!Members { dead: vec![entry("record", Some(3))], ..killed }.has_lost_server());
        assert!(!Members::default().has_lost_server());
    }

    #[test]
    fn the_living_of_a_name_are_known_by_their_pids() {
        let living = vec![entry("monitor", Some(1)), entry("record", None), entry("record", Some(2))];
        let members = Members { living, ..Members::default() };
        assert_eq!(members.living("record").collect::<Vec<_>>(), [None, Some(2)]);
        assert_eq!(members.living("psn").count(), 0);
    }

    #[test]
    fn an_unheard_reader_does_not_report_or_was_killed_or_is_unknown() {
        let members = Members {
            living: vec![entry("monitor", Some(7)), entry("psn", None)],
            dead: vec![entry("monitor", Some(5)), entry("record", Some(6))],
            ..Members::default()
        };
        let states = ["monitor", "psn", "record", "osc"].map(|name| members.unheard(name));
        let expected = [Some("does not report (pid 7)"), Some("does not report"), Some("was killed"), None];
        assert_eq!(states.each_ref().map(Option::as_deref), expected);
    }

    #[test]
    fn processes_that_have_ended_are_left_out_and_the_source_is_the_present_one() {
        let before = Members {
            source: Some(1),
            has_source: true,
            living: vec![entry("monitor", Some(2)), entry("record", Some(3))],
            dead: vec![entry("psn", Some(4))],
        };
        let now = Members {
            source: Some(9),
            living: vec![entry("record", Some(3)), entry("osc", Some(5))],
            ..Members::default()
        };
        let left = before.clone().without_ended(&now);
        let expected =
            Members { source: Some(9), has_source: false, living: vec![entry("record", Some(3))], dead: before.dead };
        assert_eq!(left, expected);
    }
}
