//! Whether a server with a real-time priority may lock its memory.

use rustix::process::{Resource, getrlimit};
use rustix::thread::{CapabilitySet, capabilities};

use super::{Check, Finding, Patient};
use crate::recording::Size;

/// What a server has mapped beside shared memory, in bytes.
const OWN_MEMORY: u64 = 64 << 20;

/// The limit of locked memory.
pub(super) struct LockedMemory;

impl Check for LockedMemory {
    fn name(&self) -> &'static str {
        "locked memory"
    }

    fn examine(&self, patient: &Patient) -> Finding {
        let may_lock_all = capabilities(None).is_ok_and(|sets| sets.effective.contains(CapabilitySet::IPC_LOCK));
        let limit = getrlimit(Resource::Memlock).current.filter(|_| !may_lock_all);
        judge(limit, patient.shared_memory() + OWN_MEMORY)
    }
}

fn judge(limit: Option<u64>, needed: u64) -> Finding {
    let Some(limit) = limit else { return Finding::ok("unlimited", "a server may lock all of its memory") };
    if limit < needed {
        return Finding::warning(
            Size(limit).to_string(),
            format!("a server may lock {}, with a real-time priority it wants up to {}", Size(limit), Size(needed)),
            "memlock unlimited in /etc/security/limits.d/ for this user, or LimitMEMLOCK=infinity in the unit",
        );
    }
    Finding::ok(Size(limit).to_string(), format!("{} may be locked, a server wants {}", Size(limit), Size(needed)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    #[test]
    fn too_little_is_warned_of_with_what_to_grant() {
        let finding = judge(Some(8 << 20), 100 << 20);
        assert_eq!(finding.status, Verdict::Warning);
        assert!(finding.remedy.is_some_and(|remedy| remedy.contains("LimitMEMLOCK=infinity")));
        assert_eq!(judge(None, 100 << 20).status, Verdict::Ok);
    }
}
