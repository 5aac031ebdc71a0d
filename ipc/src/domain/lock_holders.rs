//! Finds the processes that hold a lock, and whether they are ending.
//!
//! The kernel drops the locks of a killed process when it closes the files of that process, some time after the signal.
//! Until then a process that no longer runs holds the lock. `/proc/locks` lists the holders of a lock, and `/proc/PID`
//! shows which of them are ending.

use std::fs::{self, File};
use std::io;
use std::os::unix::fs::MetadataExt;

/// The processes that hold a lock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Holders {
    /// All of them run, or are stopped and can continue.
    Living,
    /// At least one of them is ending: it was killed, or exits.
    Ending,
    /// None is listed: the lock was dropped just now, or this process may not see its holders.
    Unseen,
}

impl Holders {
    /// Looks up the holders of the `flock` on a file.
    pub(crate) fn of(file: &File) -> Self {
        let pids = pids(file).unwrap_or_default();
        if pids.is_empty() {
            Self::Unseen
        } else if pids.into_iter().any(is_ending) {
            Self::Ending
        } else {
            Self::Living
        }
    }
}

/// Returns the ids of the processes that hold the `flock` on a file.
pub(crate) fn pids(file: &File) -> io::Result<Vec<u32>> {
    let inode = file.metadata()?.ino();
    Ok(fs::read_to_string("/proc/locks")?.lines().filter_map(|line| holder(line, inode)).collect())
}

/// Returns the process id in a line of `/proc/locks`, if the line is a held `flock` on this inode. The device is not
/// compared: on a layered file system `/proc/locks` has another device number.
///
/// Examples of a holder and of a waiting process: `1: FLOCK  ADVISORY  WRITE 123 00:1c:4567 0 EOF`, `1: -> FLOCK  …`.
fn holder(line: &str, inode: u64) -> Option<u32> {
    // The words are not collected: the file has a line for each lock of the system.
    let mut words = line.split_ascii_whitespace().skip(1);
    if words.next()? != "FLOCK" {
        return None;
    }
    let (pid, file) = (words.nth(2)?, words.next()?);
    let (_, number) = file.rsplit_once(':')?;
    (number.parse() == Ok(inode)).then(|| pid.parse().ok())?
}

/// Whether a process is ending or has ended. A stopped process is not ending, nor is one whose files cannot be read.
pub(crate) fn is_ending(pid: u32) -> bool {
    let shows = |name: &str, is_end: fn(&str) -> bool| {
        fs::read_to_string(format!("/proc/{pid}/{name}"))
            .map_or_else(|error| is_of_no_process(&error), |text| is_end(&text))
    };
    shows("stat", has_exited) || shows("status", was_killed)
}

/// Whether an error of reading a file of `/proc/PID` means that the process has ended, also during the read.
fn is_of_no_process(error: &io::Error) -> bool {
    /// The kernel's error number `ESRCH`.
    const NO_SUCH_PROCESS: i32 = 3;
    error.kind() == io::ErrorKind::NotFound || error.raw_os_error() == Some(NO_SUCH_PROCESS)
}

/// Whether `/proc/PID/stat` shows a process that exits or has exited: state Z or X, or the kernel's flag `PF_EXITING`.
fn has_exited(stat: &str) -> bool {
    const PF_EXITING: u32 = 0x4;
    // The program's name, in parentheses, may contain anything.
    let Some((_, fields)) = stat.rsplit_once(')') else { return false };
    let mut fields = fields.split_ascii_whitespace();
    let state = fields.next();
    let flags: u32 = fields.nth(5).and_then(|flags| flags.parse().ok()).unwrap_or_default();
    matches!(state, Some("Z" | "X")) || flags & PF_EXITING != 0
}

/// Whether `/proc/PID/status` shows a pending SIGKILL. The kernel lists every signal that ends a process as SIGKILL from
/// the moment it is sent.
fn was_killed(status: &str) -> bool {
    const SIGKILL: u64 = 1 << 8;
    let pending = |line: &str| {
        let mask = line.strip_prefix("SigPnd:").or_else(|| line.strip_prefix("ShdPnd:"))?;
        u64::from_str_radix(mask.trim(), 16).ok()
    };
    status.lines().filter_map(pending).any(|mask| mask & SIGKILL != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_holders_of_the_file_are_named() {
        let lock = "2: FLOCK  ADVISORY  READ 4711 00:1c:815 0 EOF";
        assert_eq!(holder(lock, 815), Some(4711));
        for other in [
            "2: FLOCK  ADVISORY  READ 4711 00:1c:816 0 EOF",
            "2: POSIX  ADVISORY  WRITE 4711 00:1c:815 0 EOF",
            "2: -> FLOCK  ADVISORY  WRITE 4711 00:1c:815 0 EOF",
            "2: FLOCK  ADVISORY  READ -1 00:1c:815 0 EOF",
            "",
        ] {
            assert_eq!(holder(other, 815), None, "{other}");
        }
    }

    #[test]
    fn a_process_that_exits_or_was_killed_is_ending() {
        assert!(!has_exited("7 (a) b) S 1 7 7 0 -1 4194304 1"));
        assert!(has_exited("7 (a) b) R 1 7 7 0 -1 4194308 1"));
        assert!(has_exited("7 (a) b) Z 1 7 7 0 -1 4194304 1"));
        assert!(was_killed("SigQ:\t0/1\nSigPnd:\t0000000000000000\nShdPnd:\t0000000000000100\n"));
        assert!(!was_killed("SigPnd:\t0000000000004000\nShdPnd:\t0000000000000000\nSigBlk:\t0000000000000100\n"));
        assert!(!is_ending(std::process::id()), "this process runs");
        assert!(is_ending(u32::MAX), "no process has this number");
    }

    #[test]
    fn a_lock_of_this_process_is_held_by_a_living_one() {
        let path = std::env::temp_dir().join(format!("bench-dragon-lock-{}", std::process::id()));
        let file = File::create(&path).expect("the directory can be written");
        fs::remove_file(&path).expect("the file was created just now");
        assert_eq!(Holders::of(&file), Holders::Unseen);
        file.try_lock_shared().expect("no other process has the file");
        assert_eq!(Holders::of(&file), Holders::Living);
    }
}
