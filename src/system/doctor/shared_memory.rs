//! Whether the frames of all readers fit into shared memory: too little of it is a SIGBUS in the middle of a show.

use std::fs::File;
use std::io;

use bench_dragon_ipc::service::ALERT_MEMORY;
use rustix::fs::fstatfs;

use super::{Check, Finding, Patient};
use crate::recording::{DiskSpace, Size};

const TMPFS: i64 = 0x0102_1994;

/// Shared memory.
pub(super) struct SharedMemory;

/// What is mounted there.
struct Mount {
    space: DiskSpace,
    is_memory: bool,
}

impl Check for SharedMemory {
    fn name(&self) -> &'static str {
        "shared memory"
    }

    fn examine(&self, patient: &Patient) -> Finding {
        let has_server = patient.census().is_ok_and(|census| census.source.is_some());
        let needed = if has_server { ALERT_MEMORY } else { patient.shared_memory() };
        judge(look(), needed)
    }
}

fn look() -> io::Result<Mount> {
    let folder = File::open("/dev/shm")?;
    Ok(Mount { space: DiskSpace::around(&folder)?, is_memory: fstatfs(&folder)?.f_type == TMPFS })
}

fn judge(mount: io::Result<Mount>, needed: u64) -> Finding {
    const MOUNT: &str = "`mount -t tmpfs -o mode=1777 tmpfs /dev/shm`";
    let Mount { space: DiskSpace { free_bytes, total_bytes }, is_memory } = match mount {
        Ok(mount) => mount,
        Err(error) => return Finding::problem("none", format!("/dev/shm cannot be read: {error}"), MOUNT),
    };
    let value = format!("{} free", Size(free_bytes));
    if free_bytes < needed {
        let size_mib = ((total_bytes + needed - free_bytes) >> 20) + 1;
        return Finding::problem(
            value,
            format!("{} of {} are free, this needs {}", Size(free_bytes), Size(total_bytes), Size(needed)),
            format!(
                "free some, or `mount -o remount,size={size_mib}M /dev/shm`; in a container, `--shm-size {size_mib}m`"
            ),
        );
    }
    if !is_memory {
        return Finding::warning(value, "/dev/shm is on a disk: frames are written to it", MOUNT);
    }
    Finding::ok(value, format!("{} are free, this needs {}", Size(free_bytes), Size(needed)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    fn judged(free_bytes: u64, is_memory: bool) -> Finding {
        judge(Ok(Mount { space: DiskSpace { free_bytes, total_bytes: 64 << 20 }, is_memory }), 63 << 20)
    }

    #[test]
    fn too_little_is_a_problem_with_the_size_that_would_do() {
        let finding = judged(60 << 20, true);
        assert_eq!(finding.status, Verdict::Problem);
        assert!(finding.remedy.is_some_and(|remedy| remedy.contains("remount,size=68M")));
    }

    #[test]
    fn enough_is_well_unless_it_is_on_a_disk() {
        assert_eq!(judged(63 << 20, true).status, Verdict::Ok);
        assert_eq!(judged(63 << 20, false).status, Verdict::Warning);
        assert_eq!(judge(Err(io::ErrorKind::NotFound.into()), 1).status, Verdict::Problem);
    }
}
