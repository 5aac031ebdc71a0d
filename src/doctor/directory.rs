//! The directory of the bus: the user's own, or refused.

use bench_dragon_ipc::DomainError;

use super::{Check, Finding, Patient};

/// The directory.
pub(super) struct Directory;

impl Check for Directory {
    fn name(&self) -> &'static str {
        "directory"
    }

    fn examine(&self, patient: &Patient) -> Finding {
        judge(patient.census().map(|census| !census.entries.is_empty()))
    }
}

fn judge(is_there: Result<bool, &DomainError>) -> Finding {
    match is_there {
        Ok(true) => Finding::ok("there", "the bus directory is this user's alone"),
        Ok(false) => Finding::ok("none yet", "the bus directory can be made"),
        // The error names the path, what is wrong, and after a colon what to do.
        Err(error) => {
            let text = error.to_string();
            let (message, remedy) = text.rsplit_once(": ").unwrap_or((&text, "see the message"));
            Finding::problem("not usable", message, remedy)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Verdict;

    #[test]
    fn a_directory_that_others_may_write_is_to_be_closed_to_them() {
        let finding = judge(Err(&DomainError::WritableByOthers { path: "/run/bus".into(), mode: 0o777 }));
        assert_eq!(finding.status, Verdict::Problem);
        assert_eq!(finding.message, "the bus directory /run/bus has mode 0777, must not be writable by others");
        assert_eq!(finding.remedy.as_deref(), Some("chmod 0700 it"));
    }
}
