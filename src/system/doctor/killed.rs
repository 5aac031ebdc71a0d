//! What killed processes have left.

use bench_dragon_ipc::Census;

use super::{Check, Finding, Patient};
use crate::output::number::Counted;

/// What is left.
pub(super) struct Killed;

impl Check for Killed {
    fn name(&self) -> &'static str {
        "leftovers"
    }

    fn examine(&self, patient: &Patient) -> Finding {
        match patient.census() {
            Ok(census) => judge(census, &patient.fix()),
            Err(_) => Finding::not_known("the directory cannot be looked at"),
        }
    }
}

fn judge(census: &Census, fix: &str) -> Finding {
    let Census { dead, entries, unknown, .. } = census;
    if census.is_deserted() && !entries.is_empty() {
        return Finding::warning(
            entries.len().to_string(),
            format!("{} of processes that were killed", Counted(entries.len() as u64, "file")),
            format!("{fix}, or start a server, which removes them"),
        );
    }
    match (dead.len(), unknown) {
        (0, 0) => Finding::ok("0", "none"),
        (0, unknown) => Finding::not_known(format!("{unknown} entries of processes cannot be read")),
        (dead, _) => Finding::warning(
            dead.to_string(),
            format!("{} of killed processes", Counted(dead as u64, "leftover")),
            format!("{fix}; the next process to join the bus removes them, too"),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    #[test]
    fn what_is_there_while_nobody_is_was_left_behind() {
        let mut census = Census { entries: vec!["/dev/shm/bd_0_dragon_a".into()], ..Census::default() };
        assert_eq!(judge(&census, "fix it").status, Verdict::Warning);
        census.source = Some(5);
        assert_eq!(judge(&census, "fix it"), Finding::ok("0", "none"));
    }
}
