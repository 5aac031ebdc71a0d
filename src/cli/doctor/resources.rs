//! Checks of the resources of a show: shared memory, memory, disk, open files, locked memory.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use bench_dragon_ipc::service::{ALERT_MEMORY, SOURCE_FILES};
use rustix::fs::{Access, access, fstatfs};
use rustix::process::{Resource, getrlimit};
use rustix::thread::{CapabilitySet, capabilities};

use super::{Finding, Target};
use crate::output::terminal_text::Printable;
use crate::recording::{DiskSpace, Size, walking_bytes_per_s};

/// `f_type` of a tmpfs (`statfs(2)`).
const TMPFS: i64 = 0x0102_1994;
/// Memory of the program besides shared memory, in bytes. The recorder buffers up to 64 MiB of frames.
const OWN_MEMORY: u64 = 128 << 20;
/// Shortest recording time, in seconds, for which the disk must have room; less is a warning.
const LEAST_DISK_S: f64 = 3600.0;
/// Files that a process must be able to open: those of a server, and as many again for standard streams, the recording and the
/// system.
const NEEDED_FILES: u64 = 2 * SOURCE_FILES as u64;
/// Memory that a server maps besides shared memory, in bytes.
const MAPPED_MEMORY: u64 = 64 << 20;

/// Whether the frames of all readers fit into shared memory. Too little shared memory causes a SIGBUS during a show.
pub(super) fn shared_memory(target: &Target) -> Finding {
    let has_server = target.census.as_ref().is_ok_and(|census| census.has_source);
    let needed = if has_server { ALERT_MEMORY } else { target.shared_memory() };
    judge_shared_memory(mounted(), needed)
}

/// The file system that is mounted at /dev/shm.
struct Mount {
    space: DiskSpace,
    is_memory: bool,
}

fn mounted() -> io::Result<Mount> {
    let folder = File::open("/dev/shm")?;
    access("/dev/shm", Access::WRITE_OK)?;
    Ok(Mount { space: DiskSpace::around(&folder)?, is_memory: fstatfs(&folder)?.f_type == TMPFS })
}

fn judge_shared_memory(mount: io::Result<Mount>, needed: u64) -> Finding {
    const MOUNT: &str = "`mount -t tmpfs -o mode=1777 tmpfs /dev/shm`";
    let Mount { space: DiskSpace { free_bytes, total_bytes }, is_memory } = match mount {
        Ok(mount) => mount,
        Err(error) => return Finding::problem("none", format!("/dev/shm cannot be used: {error}"), MOUNT),
    };
    let value = format!("{} free", Size(free_bytes));
    if free_bytes < needed {
        let size_mib = ((total_bytes + needed - free_bytes) >> 20) + 1;
        return Finding::problem(
            value,
            format!("{} of {} are free, {} are needed", Size(free_bytes), Size(total_bytes), Size(needed)),
            format!(
                "free some space, or `mount -o remount,size={size_mib}M /dev/shm`; in a container, `--shm-size {size_mib}m`"
            ),
        );
    }
    if !is_memory {
        return Finding::warning(value, "/dev/shm is on a disk, so frames are written to the disk", MOUNT);
    }
    Finding::ok(value, format!("{} are free, {} are needed", Size(free_bytes), Size(needed)))
}

/// The memory that the control group leaves. Shared memory counts there. If memory runs out, the kernel kills a process.
pub(super) fn memory_limit(target: &Target) -> Finding {
    judge_memory_limit(tightest().as_ref(), target.shared_memory() + OWN_MEMORY)
}

/// The memory of a control group, in bytes.
struct Group {
    limit: Option<u64>,
    used: u64,
}

/// The control group with the least memory left, among this process's group and its parents. `None` without control groups of
/// version 2.
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

fn judge_memory_limit(group: Option<&Group>, needed: u64) -> Finding {
    let Some(Group { limit, used }) = group else {
        return Finding::not_known("this system has no control groups of version 2");
    };
    let Some(limit) = limit else { return Finding::ok("none", "no control group limits memory") };
    let left = limit.saturating_sub(*used);
    if left < needed {
        return Finding::warning(
            format!("{} left", Size(left)),
            format!("the control group leaves {} of {}, a show needs up to {}", Size(left), Size(*limit), Size(needed)),
            "raise memory.max of the control group (MemoryMax= of the unit, --memory of the container)",
        );
    }
    Finding::ok(format!("{} left", Size(left)), format!("the control group leaves {} of {}", Size(left), Size(*limit)))
}

/// The recording time for which the disk of the show's folder has room.
pub(super) fn disk(target: &Target) -> Finding {
    let layout = target.config.formation().layout();
    let rate_hz = target.config.tables().serve.rate_hz;
    let folder = existing(&target.out);
    let space = File::open(folder).and_then(|folder| DiskSpace::around(&folder));
    judge_disk(&target.out, space, walking_bytes_per_s(layout, rate_hz))
}

/// The folder itself, or its nearest parent that exists: `show` creates the folder there.
pub(super) fn existing(folder: &Path) -> &Path {
    let is_there = |path: &&Path| !path.as_os_str().is_empty() && path.is_dir();
    folder.ancestors().find(is_there).unwrap_or(Path::new("."))
}

fn judge_disk(folder: &Path, space: io::Result<DiskSpace>, bytes_per_s: f64) -> Finding {
    let named = if folder == Path::new(".") { "the current folder".to_owned() } else { Printable(folder).to_string() };
    let DiskSpace { free_bytes, .. } = match space {
        Ok(space) => space,
        Err(error) => return Finding::not_known(format!("{named} cannot be read: {error}")),
    };
    let seconds = free_bytes as f64 / bytes_per_s;
    let value = format!("{} free", Size(free_bytes));
    let message = format!("{named} has {} free, for some {:.1} hours of recording", Size(free_bytes), seconds / 3600.0);
    if seconds < LEAST_DISK_S {
        return Finding::warning(
            value,
            message,
            "free some space, record elsewhere, or limit the recording: `record FILE --max-total-mb MB`",
        );
    }
    Finding::ok(value, message)
}

/// The number of files that a process may open. A server opens three per reader.
pub(super) fn open_files(_: &Target) -> Finding {
    // The program raises its soft limit to the hard limit, so the hard limit counts.
    judge_open_files(getrlimit(Resource::Nofile).maximum)
}

fn judge_open_files(limit: Option<u64>) -> Finding {
    let Some(limit) = limit else { return Finding::ok("unlimited", "no limit") };
    if limit < NEEDED_FILES {
        return Finding::problem(
            limit.to_string(),
            format!("a process may open {limit} files, a server with all its readers needs {NEEDED_FILES}"),
            "`ulimit -n 1024`, or set nofile 1024 in /etc/security/limits.conf, or LimitNOFILE=1024 in the unit",
        );
    }
    Finding::ok(limit.to_string(), format!("{limit} are allowed, {NEEDED_FILES} are needed"))
}

/// Whether a server with a real-time priority may lock its memory.
pub(super) fn locked_memory(target: &Target) -> Finding {
    let may_lock_all = capabilities(None).is_ok_and(|sets| sets.effective.contains(CapabilitySet::IPC_LOCK));
    let limit = getrlimit(Resource::Memlock).current.filter(|_| !may_lock_all);
    judge_locked_memory(limit, target.shared_memory() + MAPPED_MEMORY)
}

fn judge_locked_memory(limit: Option<u64>, needed: u64) -> Finding {
    let Some(limit) = limit else { return Finding::ok("unlimited", "a server may lock all of its memory") };
    if limit < needed {
        return Finding::warning(
            Size(limit).to_string(),
            format!("a server may lock {}, with a real-time priority it locks up to {}", Size(limit), Size(needed)),
            "set memlock unlimited in /etc/security/limits.d/ for this user, or LimitMEMLOCK=infinity in the unit",
        );
    }
    Finding::ok(Size(limit).to_string(), format!("a server may lock {} and locks up to {}", Size(limit), Size(needed)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::doctor::finding::Verdict;

    fn judged_mount(free_bytes: u64, is_memory: bool) -> Finding {
        judge_shared_memory(Ok(Mount { space: DiskSpace { free_bytes, total_bytes: 64 << 20 }, is_memory }), 63 << 20)
    }

    #[test]
    fn too_little_shared_memory_is_a_problem_with_the_needed_size() {
        let finding = judged_mount(60 << 20, true);
        assert_eq!(finding.status, Verdict::Problem);
        assert!(finding.remedy.is_some_and(|remedy| remedy.contains("remount,size=68M")));
    }

    #[test]
    fn enough_shared_memory_is_ok_unless_it_is_on_a_disk() {
        assert_eq!(judged_mount(63 << 20, true).status, Verdict::Ok);
        assert_eq!(judged_mount(63 << 20, false).status, Verdict::Warning);
        assert_eq!(judge_shared_memory(Err(io::ErrorKind::NotFound.into()), 1).status, Verdict::Problem);
    }

    #[test]
    fn used_memory_reduces_what_the_control_group_leaves() {
        let judged = |limit, used| judge_memory_limit(Some(&Group { limit, used }), 100).status;
        assert_eq!(judged(Some(150), 50), Verdict::Ok);
        assert_eq!(judged(Some(150), 51), Verdict::Warning);
        assert_eq!(judged(None, 1_000), Verdict::Ok);
        assert_eq!(judge_memory_limit(None, 100).status, Verdict::NotKnown);
    }

    #[test]
    fn room_for_less_than_an_hour_is_a_warning() {
        let judged =
            |free_bytes| judge_disk(Path::new("."), Ok(DiskSpace { free_bytes, total_bytes: 1 << 40 }), 1e6).status;
        assert_eq!(judged(3_600_000_000), Verdict::Ok);
        assert_eq!(judged(3_599_000_000), Verdict::Warning);
    }

    #[test]
    fn fewer_files_than_a_server_opens_are_a_problem() {
        assert_eq!(judge_open_files(Some(255)).status, Verdict::Problem);
        assert_eq!(judge_open_files(Some(256)).status, Verdict::Ok);
        assert_eq!(judge_open_files(None).status, Verdict::Ok);
    }

    #[test]
    fn too_little_locked_memory_is_a_warning_with_the_needed_limit() {
        let finding = judge_locked_memory(Some(8 << 20), 100 << 20);
        assert_eq!(finding.status, Verdict::Warning);
        assert!(finding.remedy.is_some_and(|remedy| remedy.contains("LimitMEMLOCK=infinity")));
        assert_eq!(judge_locked_memory(None, 100 << 20).status, Verdict::Ok);
    }
}
