//! Page of shared memory with the wake word of an instance's frames.
//!
//! The page is a file of mode 0600 in `/dev/shm`, whose name is the domain's prefix, a random number and `.wake`. The
//! symbolic link `PREFIXwake` in the domain's directory leads to it. Others may create files in `/dev/shm`, but not in that
//! directory. The first source creates page and link, and later sources use them again. The last member to leave removes
//! them with the rest of the domain. So a reader keeps its page through all restarts.
//!
//! The word is the first four bytes, in the machine's byte order; see [`word`] for its protocol. The
//! other bytes are 0.

#![allow(unsafe_code, reason = "maps shared memory")]

use core::ptr::NonNull;
use core::sync::atomic::AtomicU32;
use core::sync::atomic::Ordering::{AcqRel, Acquire};
use core::time::Duration;
use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, ErrorKind, Write as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _, PermissionsExt as _, symlink};
use std::path::{Path, PathBuf};

use rustix::io::Errno;
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};
use rustix::rand::{GetRandomFlags, getrandom};
use rustix::thread::futex;
use rustix::time::Timespec;

use super::word::{self, Slept, Word};
use crate::domain::{BusError, Domain, DomainError, SHARED_MEMORY, if_there};
use crate::wire::services::FRAMES;

/// Size of the file in bytes.
const PAGE_LEN: usize = 4096;
/// Longest sleep of one system call. Times of the kernel are limited, and a waiter that sleeps longer sleeps again.
const LONGEST_SLEEP: Duration = Duration::from_hours(1);

/// The mapped page. Any thread may use it.
#[derive(Debug)]
pub struct WakePage {
    address: NonNull<AtomicU32>,
}

// SAFETY: the page is mapped until it is dropped, and its word is only accessed by atomic operations.
unsafe impl Send for WakePage {}
// SAFETY: as above.
unsafe impl Sync for WakePage {}

impl WakePage {
    /// Opens the page of a domain, and creates it if it is missing. Only the source calls it.
    ///
    /// # Errors
    /// [`BusError::SharedMemoryUnusable`] where the page cannot be created or mapped, [`BusError::Domain`] where the link
    /// cannot be created.
    pub(crate) fn create(domain: &Domain) -> Result<Self, BusError> {
        match open(domain) {
            Ok(page) => return Ok(page),
            Err(error) if is_missing(&error) => {}
            Err(error) => return Err(BusError::SharedMemoryUnusable { error }),
        }
        let page = create_file(domain).map_err(|error| BusError::SharedMemoryUnusable { error })?;
        let link = link(domain);
        let failed = |error| BusError::Domain(DomainError::Io { path: link.clone(), error });
        // A link of a name with the domain's prefix, so that a source killed in between leaves nothing.
        let draft = domain.root().join(format!("{}wake.draft", domain.prefix()));
        remove_if_there(&draft).map_err(failed)?;
        symlink(&page, &draft).and_then(|()| fs::rename(&draft, &link)).map_err(failed)?;
        open(domain).map_err(|error| BusError::SharedMemoryUnusable { error })
    }

    /// Opens the page of a domain whose source has created the frames.
    ///
    /// # Errors
    /// [`BusError::VersionMismatch`] where the source has created no page, as earlier versions do. [`BusError::Failed`]
    /// where somebody has removed it.
    /// [`BusError::SharedMemoryUnusable`] where the page cannot be mapped.
    pub(crate) fn open(domain: &Domain) -> Result<Self, BusError> {
        open(domain).map_err(|error| {
            if is_missing(&error) && fs::symlink_metadata(link(domain)).is_ok() {
                BusError::Failed { service: FRAMES, reason: "the wake page was removed: restart the server".to_owned() }
            } else if is_missing(&error) {
                BusError::VersionMismatch { service: FRAMES }
            } else {
                BusError::SharedMemoryUnusable { error }
            }
        })
    }

    /// Wakes all readers that wait. Never waits; makes no system call where no reader sleeps.
    pub fn raise(&self) {
        word::raise(self);
    }

    /// Wakes all readers that wait, and those that wait by the clock.
    pub(crate) fn raise_for_all(&self) {
        word::raise(self);
        self.wake_all();
    }

    fn word(&self) -> &AtomicU32 {
        // SAFETY: the page is mapped until `self` is dropped, is aligned, and has only atomic accesses.
        unsafe { self.address.as_ref() }
    }
}

impl Word for WakePage {
    fn load(&self) -> u32 {
        self.word().load(Acquire)
    }

    fn exchange(&self, current: u32, new: u32) -> Result<(), u32> {
        self.word().compare_exchange(current, new, AcqRel, Acquire).map(drop)
    }

    fn sleep(&self, expected: u32, timeout: Duration) -> Slept {
        let timeout = Timespec::try_from(timeout.min(LONGEST_SLEEP)).expect("an hour is a valid time");
        match futex::wait(self.word(), futex::Flags::empty(), expected, Some(&timeout)) {
            Err(Errno::TIMEDOUT) => Slept::TimedOut,
            Err(Errno::INTR) => Slept::Interrupted,
            Ok(()) | Err(_) => Slept::Woken,
        }
    }

    fn wake_all(&self) {
        const ALL: u32 = i32::MAX as u32;
        // The call fails only for an address that is not mapped.
        let _ = futex::wake(self.word(), futex::Flags::empty(), ALL);
    }
}

impl Drop for WakePage {
    fn drop(&mut self) {
        // SAFETY: the page was mapped with this length, and no reference to it is left.
        let _ = unsafe { munmap(self.address.as_ptr().cast(), PAGE_LEN) };
    }
}

fn link(domain: &Domain) -> PathBuf {
    domain.root().join(format!("{}wake", domain.prefix()))
}

/// Whether the page has not been created, or not completely.
fn is_missing(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::NotFound | ErrorKind::UnexpectedEof)
}

fn open(domain: &Domain) -> io::Result<WakePage> {
    let file = OpenOptions::new().read(true).write(true).open(link(domain))?;
    let metadata = file.metadata()?;
    if !metadata.is_file() || metadata.uid() != domain.uid() {
        return Err(io::Error::new(ErrorKind::NotFound, "the link leads to a foreign file"));
    }
    if metadata.len() < PAGE_LEN as u64 {
        return Err(ErrorKind::UnexpectedEof.into());
    }
    map(&file)
}

fn map(file: &File) -> io::Result<WakePage> {
    let (protection, flags) = (ProtFlags::READ | ProtFlags::WRITE, MapFlags::SHARED);
    // SAFETY: the kernel chooses the address, so no other mapping is affected.
    let address = unsafe { mmap(core::ptr::null_mut(), PAGE_LEN, protection, flags, file, 0) }?;
    let address = NonNull::new(address.cast()).ok_or_else(|| io::Error::other("the page was mapped at address 0"))?;
    Ok(WakePage { address })
}

/// Creates a file of zeros in shared memory. Writing them allocates the memory, so that a full file system is an error
/// here and not a signal later.
fn create_file(domain: &Domain) -> io::Result<PathBuf> {
    const MODE: u32 = 0o600;
    let mut number = [0; 8];
    getrandom(&mut number, GetRandomFlags::empty())?;
    let name = format!("{}{:016x}.wake", domain.prefix(), u64::from_ne_bytes(number));
    let path = Path::new(SHARED_MEMORY).join(name);
    let mut file = OpenOptions::new().write(true).create_new(true).mode(MODE).open(&path)?;
    let written = file.set_permissions(Permissions::from_mode(MODE)).and_then(|()| file.write_all(&[0; PAGE_LEN]));
    if written.is_err() {
        remove_if_there(&path)?;
    }
    written.map(|()| path)
}

fn remove_if_there(path: &Path) -> io::Result<()> {
    if_there(fs::remove_file(path)).map(drop)
}
