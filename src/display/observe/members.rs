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
    pub fn still_there(mut self, domain: &Domain) -> Self {
        let now = Self::of(domain);
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
