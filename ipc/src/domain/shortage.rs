//! Finds the resource of the machine or the process that is short, where iceoryx2 reports only a failure.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write as _};

/// Folder of shared memory in the file system.
pub(crate) const SHARED_MEMORY: &str = "/dev/shm";
/// Least address space that a port needs, in bytes. Less is reported as a shortage.
const LEAST_LEFT: u64 = 64 << 20;
/// Size of the test write into shared memory, in bytes.
const PROBE: usize = 256 << 10;

/// Returns the shortage and its remedy in one line; `None` if no shortage is found.
pub(crate) fn shortage() -> Option<String> {
    no_open_files().or_else(no_shared_memory).or_else(no_address_space)
}

fn no_open_files() -> Option<String> {
    let error = File::open("/dev/null").err().filter(is_out_of_files)?;
    Some(format!("no more files may be opened ({error}): raise the limit, `ulimit -n 1024`"))
}

/// Whether an error means that this process or the system may open no more files.
pub(crate) fn is_out_of_files(error: &io::Error) -> bool {
    /// The kernel's error numbers `EMFILE` and `ENFILE`.
    const TOO_MANY: [Option<i32>; 2] = [Some(24), Some(23)];
    TOO_MANY.contains(&error.raw_os_error())
}

fn no_shared_memory() -> Option<String> {
    let path = format!("{SHARED_MEMORY}/bench-dragon-probe-{}", std::process::id());
    let written = File::create_new(&path).and_then(|mut file| {
        fs::remove_file(&path)?;
        file.write_all(&vec![0; PROBE])
    });
    // An existing file of this name does not indicate a shortage of memory.
    let error = written.err().filter(|error| error.kind() != ErrorKind::AlreadyExists)?;
    Some(format!("{SHARED_MEMORY} takes no more memory ({error}): free some or mount it larger"))
}

fn no_address_space() -> Option<String> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let (limit, used) = (address_space_limit(&limits)?, address_space_used(&status)?);
    (limit < used + LEAST_LEFT).then(|| {
        let mb = |bytes: u64| bytes as f64 * 1e-6;
        format!(
            "the address space is limited to {:.0} MB, of which {:.0} MB are in use: raise the limit, `ulimit -v unlimited`",
            mb(limit),
            mb(used)
        )
    })
}

/// Returns the soft limit in bytes; `None` for no limit.
fn address_space_limit(limits: &str) -> Option<u64> {
    let values = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    values.split_ascii_whitespace().next()?.parse().ok()
}

fn address_space_used(status: &str) -> Option<u64> {
    let size = status.lines().find_map(|line| line.strip_prefix("VmSize:"))?;
    let kib: u64 = size.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(kib << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_and_sizes_are_read_as_the_kernel_writes_them() {
        let limits = "Max open files  1024  4096  files\nMax address space         400000000   unlimited   bytes\n";
        assert_eq!(address_space_limit(limits), Some(400_000_000));
        assert_eq!(address_space_limit("Max address space   unlimited   unlimited   bytes\n"), None);
        assert_eq!(address_space_used("Name:\tserve\nVmSize:\t    1024 kB\n"), Some(1 << 20));
    }
}
