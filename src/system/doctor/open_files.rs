//! How many files a process may open: a server takes three for each reader.

use bench_dragon_ipc::service::SOURCE_FILES;
use rustix::process::{Resource, getrlimit};

use super::{Check, Finding, Patient};

/// With as much again for standard streams, the recording and the system's own.
const NEEDED: u64 = 2 * SOURCE_FILES as u64;

/// The limit of open files.
pub(super) struct OpenFiles;

impl Check for OpenFiles {
    fn name(&self) -> &'static str {
        "open files"
    }

    fn examine(&self, _: &Patient) -> Finding {
        // The program raises its own limit as far as it may.
        judge(getrlimit(Resource::Nofile).maximum)
    }
}

fn judge(limit: Option<u64>) -> Finding {
    let Some(limit) = limit else { return Finding::ok("unlimited", "as many as it takes") };
    if limit < NEEDED {
        return Finding::problem(
            limit.to_string(),
            format!("a process may open {limit} files, a server with all its readers needs {NEEDED}"),
            "`ulimit -n 1024`, or nofile 1024 in /etc/security/limits.conf, or LimitNOFILE=1024 in the unit",
        );
    }
    Finding::ok(limit.to_string(), format!("{limit} are allowed, {NEEDED} are needed"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    #[test]
    fn fewer_files_than_a_server_opens_are_a_problem() {
        assert_eq!(judge(Some(255)).status, Verdict::Problem);
        assert_eq!(judge(Some(256)).status, Verdict::Ok);
        assert_eq!(judge(None).status, Verdict::Ok);
    }
}
