//! The directory of the bus: the user's own, or refused.

use std::io;
use std::path::Path;

use bench_dragon_ipc::DomainError;
use rustix::fs::{Access, access};

use super::{Check, Finding, Patient};

/// The directory.
pub(super) struct Directory;

impl Check for Directory {
    fn name(&self) -> &'static str {
        "directory"
    }

    fn examine(&self, patient: &Patient) -> Finding {
        let usable = patient.census().map(|_| patient.root().map_or(Ok(()), may_write));
        judge(patient.root().unwrap_or(Path::new("")), usable)
    }
}

/// Whether this user may make something in a directory, or make the directory.
fn may_write(directory: &Path) -> io::Result<()> {
    let there = directory.ancestors().find(|path| path.exists()).unwrap_or(Path::new("/"));
    Ok(access(there, Access::WRITE_OK | Access::EXEC_OK)?)
}

fn judge(root: &Path, usable: Result<io::Result<()>, &DomainError>) -> Finding {
    let value = root.display().to_string();
    match usable {
        Ok(Ok(())) => Finding::ok(value, format!("{} is this user's alone", root.display())),
        Ok(Err(error)) => Finding::problem(
            value,
            format!("{} cannot be written: {error}", root.display()),
            "set XDG_RUNTIME_DIR to a directory of this user's that can be written",
        ),
        // The error names the path, what is wrong, and after a colon what to do.
        Err(error) => {
            let text = error.to_string();
            let (message, remedy) = text.rsplit_once(": ").unwrap_or((&text, "see the message"));
            Finding::problem(value, message, remedy)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    #[test]
    fn a_directory_that_others_may_write_is_to_be_closed_to_them() {
        let finding =
            judge(Path::new("/run/bus"), Err(&DomainError::WritableByOthers { path: "/run/bus".into(), mode: 0o777 }));
        assert_eq!(finding.status, Verdict::Problem);
        assert_eq!(finding.message, "the bus directory /run/bus has mode 0777, must not be writable by others");
        assert_eq!(finding.remedy.as_deref(), Some("chmod 0700 it"));
        assert_eq!(
            judge(Path::new("/run/bus"), Ok(Err(io::ErrorKind::ReadOnlyFilesystem.into()))).status,
            Verdict::Problem
        );
        assert_eq!(judge(Path::new("/run/bus"), Ok(Ok(()))).status, Verdict::Ok);
    }
}
