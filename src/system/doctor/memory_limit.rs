//! What the control group leaves of memory: shared memory counts there, and too little of it ends a process by SIGKILL.

use std::fs;
use std::path::{Path, PathBuf};

use super::{Check, Finding, Patient};
use crate::recording::Size;

/// What the program itself takes beside shared memory, in bytes: the recorder keeps up to 64 MiB of frames.
const OWN_MEMORY: u64 = 128 << 20;

/// The control group's limit.
pub(super) struct MemoryLimit;

/// A control group's memory in bytes.
struct Group {
    limit: Option<u64>,
    used: u64,
}

impl Check for MemoryLimit {
    fn name(&self) -> &'static str {
        "memory limit"
    }

    fn examine(&self, patient: &Patient) -> Finding {
        judge(tightest().as_ref(), patient.shared_memory() + OWN_MEMORY)
    }
}

/// The group with the least left, of this process's and those that it lies in; `None` without version 2 of control groups.
fn tightest() -> Option<Group> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let own = groups.lines().find_map(|line| line.strip_prefix("0::/"))?;
    let root = Path::new("/sys/fs/cgroup");
    let group = |folder: &Path| {
        let number = |file| fs::read_to_string(folder.join(file)).ok()?.trim().parse().ok();
        Group { limit: number("memory.max"), used: number("memory.current").unwrap_or(0) }
    };
    let path: PathBuf = root.join(own);
    let groups = path.ancestors().take_while(|folder| folder.starts_with(root)).map(group);
    groups.min_by_key(|group| group.limit.map_or(u64::MAX, |limit| limit.saturating_sub(group.used)))
}

fn judge(group: Option<&Group>, needed: u64) -> Finding {
    let Some(Group { limit, used }) = group else {
        return Finding::not_known("this system has no control groups of version 2");
    };
    let Some(limit) = limit else { return Finding::ok("none", "no control group limits memory") };
    let left = limit.saturating_sub(*used);
    if left < needed {
        return Finding::warning(
            format!("{} left", Size(left)),
            format!("the control group leaves {} of {}, a show takes up to {}", Size(left), Size(*limit), Size(needed)),
            "raise memory.max of the control group (MemoryMax= of the unit, --memory of the container)",
        );
    }
    Finding::ok(format!("{} left", Size(left)), format!("the control group leaves {} of {}", Size(left), Size(*limit)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    #[test]
    fn what_is_used_already_counts() {
        let judged = |limit, used| judge(Some(&Group { limit, used }), 100).status;
        assert_eq!(judged(Some(150), 50), Verdict::Ok);
        assert_eq!(judged(Some(150), 51), Verdict::Warning);
        assert_eq!(judged(None, 1_000), Verdict::Ok);
        assert_eq!(judge(None, 100).status, Verdict::NotKnown);
    }
}
