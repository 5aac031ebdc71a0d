//! Checks of the bus: its directory, its services, and leftovers of killed processes or other users.

use std::io;
use std::path::Path;

use bench_dragon_ipc::{Census, DomainError, ForeignFile, ServiceLayout};
use rustix::fs::{Access, access};

use super::{Finding, Target};
use crate::output::Counted;

/// Whether the directory of the bus belongs to this user alone.
pub(super) fn directory(target: &Target) -> Finding {
    let usable = target.census.as_ref().map(|_| target.root.as_deref().map_or(Ok(()), may_write));
    judge_directory(target.root.as_deref().unwrap_or(Path::new("")), usable)
}

/// Checks that this user may create files in a directory, or may create the directory.
fn may_write(directory: &Path) -> io::Result<()> {
    let there = directory.ancestors().find(|path| path.exists()).unwrap_or(Path::new("/"));
    Ok(access(there, Access::WRITE_OK | Access::EXEC_OK)?)
}

fn judge_directory(root: &Path, usable: Result<io::Result<()>, &DomainError>) -> Finding {
    let value = root.display().to_string();
    match usable {
        Ok(Ok(())) => Finding::ok(value, format!("{} belongs to this user alone", root.display())),
        Ok(Err(error)) => Finding::problem(
            value,
            format!("{} cannot be written: {error}", root.display()),
            "set XDG_RUNTIME_DIR to a directory that this user owns and can write",
        ),
        // The error has the path, the problem, and after a colon the remedy.
        Err(error) => {
            let text = error.to_string();
            let (message, remedy) = text.rsplit_once(": ").unwrap_or((&text, "see the message"));
            Finding::problem(value, message, remedy)
        }
    }
}

/// Whether this program can read the services on the bus.
pub(super) fn services(target: &Target) -> Finding {
    target.judge_census(|census| judge_services(&census.services))
}

fn judge_services(services: &[ServiceLayout]) -> Finding {
    let value = services.len().to_string();
    if services.is_empty() {
        return Finding::ok(value, "no services");
    }
    let differing =
        services.iter().filter(|service| !service.agrees()).map(|ServiceLayout { service, found, expected }| {
            let found = found.as_ref().unwrap_or_else(|reason| reason);
            format!("{service} is {found}, this program needs {expected}")
        });
    match differing.collect::<Vec<_>>().join("; ") {
        none if none.is_empty() => Finding::ok(value, "all have this program's layouts"),
        differing => Finding::problem(
            value,
            differing,
            "run the same version of bench-dragon on both sides: `bench-dragon ctl stop`, then start it again",
        ),
    }
}

/// Services that a killed server had not created completely.
pub(super) fn half_made(target: &Target) -> Finding {
    target.judge_census(|census| judge_half_made(census, &target.fix()))
}

fn judge_half_made(census: &Census, fix: &str) -> Finding {
    let Census { half_made, source, has_source, .. } = census;
    let value = half_made.len().to_string();
    match (half_made.as_slice(), source) {
        ([], _) => Finding::ok(value, "none"),
        (_, Some(pid)) => Finding::ok(value, format!("the server, pid {pid}, is creating its services")),
        _ if *has_source => Finding::ok(value, "a server of another PID namespace is creating its services"),
        ([first, ..], None) => Finding::problem(
            value,
            format!("a server was killed while it created {}: clients cannot open it", first.display()),
            format!("{fix}, or start a server, which removes it"),
        ),
    }
}

/// Files and nodes of killed processes.
pub(super) fn leftovers(target: &Target) -> Finding {
    target.judge_census(|census| judge_leftovers(census, &target.fix()))
}

fn judge_leftovers(census: &Census, fix: &str) -> Finding {
    let Census { dead, entries, unknown, .. } = census;
    if census.is_deserted() && !entries.is_empty() {
        return Finding::warning(
            entries.len().to_string(),
            format!("{} of killed processes", Counted(entries.len() as u64, "file")),
            format!("{fix}, or start a server, which removes them"),
        );
    }
    match (dead.len(), unknown) {
        (0, 0) => Finding::ok("0", "none"),
        (0, unknown) => Finding::not_known(format!("{unknown} entries of processes cannot be read")),
        (dead, _) => Finding::warning(
            dead.to_string(),
            format!("{} of killed processes", Counted(dead as u64, "leftover")),
            format!("{fix}; the next process that joins the bus removes them, too"),
        ),
    }
}

/// Files of other users whose names begin with this instance's prefix.
pub(super) fn foreign_files(target: &Target) -> Finding {
    target.judge_census(judge_foreign_files)
}

fn judge_foreign_files(census: &Census) -> Finding {
    let value = census.foreign.len().to_string();
    let Some(ForeignFile { path, owner }) = census.foreign.first() else { return Finding::ok(value, "none") };
    let noun = if census.foreign.len() == 1 { "file" } else { "files" };
    let one = path.to_string_lossy();
    Finding::warning(
        &value,
        format!("{value} {noun} of other users with this instance's prefix; one is {one:?} of user {owner}"),
        "this program takes another name where one is occupied; a stock iceoryx2 client needs the present output of `bench-dragon iox2-config`; \
         the owner or root can remove such a file",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::doctor::finding::Verdict;

    #[test]
    fn a_directory_that_others_may_write_is_a_problem() {
        let finding = judge_directory(
            Path::new("/run/bus"),
            Err(&DomainError::WritableByOthers { path: "/run/bus".into(), mode: 0o777 }),
        );
        assert_eq!(finding.status, Verdict::Problem);
        assert_eq!(finding.message, "the bus directory /run/bus has mode 0777, must not be writable by others");
        assert_eq!(finding.remedy.as_deref(), Some("chmod 0700 it"));
        assert_eq!(
            judge_directory(Path::new("/run/bus"), Ok(Err(io::ErrorKind::ReadOnlyFilesystem.into()))).status,
            Verdict::Problem
        );
        assert_eq!(judge_directory(Path::new("/run/bus"), Ok(Ok(()))).status, Verdict::Ok);
    }

    #[test]
    fn a_different_layout_is_reported_with_ours() {
        let service = ServiceLayout {
            service: "bench-dragon/status",
            found: Ok("Status.v9 of 8 bytes".to_owned()),
            expected: "Status.v1 of 80 bytes".to_owned(),
        };
        let finding = judge_services(&[service]);
        assert_eq!(finding.status, Verdict::Problem);
        assert_eq!(
            finding.message,
            "bench-dragon/status is Status.v9 of 8 bytes, this program needs Status.v1 of 80 bytes"
        );
    }

    #[test]
    fn a_half_made_service_is_a_problem_unless_its_server_lives() {
        let mut census = Census { half_made: vec!["/run/a.service".into()], ..Census::default() };
        let finding = judge_half_made(&census, "fix it");
        assert_eq!(finding.status, Verdict::Problem);
        assert_eq!(finding.remedy.as_deref(), Some("fix it, or start a server, which removes it"));
        census.source = Some(5);
        assert_eq!(judge_half_made(&census, "fix it").status, Verdict::Ok);
    }

    #[test]
    fn files_without_a_living_process_are_leftovers() {
        let mut census = Census { entries: vec!["/dev/shm/bd_0_dragon_a".into()], ..Census::default() };
        assert_eq!(judge_leftovers(&census, "fix it").status, Verdict::Warning);
        census.has_source = true;
        assert_eq!(judge_leftovers(&census, "fix it"), Finding::ok("0", "none"));
    }

    #[test]
    fn a_foreign_file_is_a_warning_with_its_owner() {
        let foreign = vec![ForeignFile { path: "/dev/shm/bd_0_dragon_junk".into(), owner: 4711 }];
        let finding = judge_foreign_files(&Census { foreign, ..Census::default() });
        assert_eq!((finding.status, finding.remedy.is_some()), (Verdict::Warning, true));
        assert!(finding.message.contains("\"/dev/shm/bd_0_dragon_junk\" of user 4711"), "{}", finding.message);
    }
}
