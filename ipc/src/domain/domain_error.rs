//! Errors of an instance's name and directory.

use core::fmt;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::shortage::{SHARED_MEMORY, is_out_of_files};

/// Greatest length of an instance's name, in characters.
pub(crate) const MAX_INSTANCE_LEN: usize = 24;
/// Exclusive limit of the root path's length, in bytes. The path plus iceoryx2's suffixes must fit into a socket address.
pub const MAX_ROOT_PATH_LEN: usize = 60;

/// Reason for which an instance has no usable domain.
#[derive(Debug)]
#[non_exhaustive]
pub enum DomainError {
    /// The name is not 1 to 24 characters of a–z, 0–9 and -.
    InvalidInstance {
        /// The name.
        name: String,
    },
    /// The root path is relative or too long, or has characters that iceoryx2 does not allow.
    RootPath {
        /// The path.
        root: PathBuf,
    },
    /// The parent of the bus directory cannot be used.
    RuntimeDirectory {
        /// The path.
        path: PathBuf,
        /// The reason.
        error: io::Error,
    },
    /// The directory does not exist.
    Missing {
        /// The path.
        path: PathBuf,
    },
    /// The path is not a directory, or is a link.
    NotADirectory {
        /// The path.
        path: PathBuf,
    },
    /// The directory belongs to another user.
    ForeignOwner {
        /// The path.
        path: PathBuf,
        /// Its owner.
        owner: u32,
        /// The user of this process.
        user: u32,
    },
    /// Other users may write into the directory.
    WritableByOthers {
        /// The path.
        path: PathBuf,
        /// Its mode.
        mode: u32,
    },
    /// This user may not enter the directory.
    PermissionDenied {
        /// The path.
        path: PathBuf,
    },
    /// Another process holds the lock of the bus directory and does not continue.
    Held {
        /// The lock file.
        path: PathBuf,
        /// Id of that process, if known.
        pid: Option<u32>,
    },
    /// The operating system reported an error.
    Io {
        /// The path.
        path: PathBuf,
        /// Its reason.
        error: io::Error,
    },
}

impl DomainError {
    /// Converts the operating system's error of reading a path.
    pub(crate) fn of(path: PathBuf, error: io::Error) -> Self {
        match error.kind() {
            ErrorKind::NotFound => Self::Missing { path },
            ErrorKind::PermissionDenied => Self::PermissionDenied { path },
            _ => Self::Io { path, error },
        }
    }
}

/// Returns the remedy for an error of the operating system, or an empty text where none is known.
fn remedy(path: &Path, error: &io::Error) -> &'static str {
    match error.kind() {
        _ if is_out_of_files(error) => ": raise the limit, `ulimit -n 1024`",
        ErrorKind::NotFound if path == Path::new(SHARED_MEMORY) => {
            ": mount it, `mount -t tmpfs -o mode=1777 tmpfs /dev/shm`"
        }
        ErrorKind::PermissionDenied => ": run as the user whom the directory belongs to, or chmod 0700 the directory",
        ErrorKind::ReadOnlyFilesystem => ": set XDG_RUNTIME_DIR to a directory that can be written",
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            ": free some space there, or set XDG_RUNTIME_DIR to a directory with more"
        }
        _ => "",
    }
}

/// Returns a path as text, with control characters replaced.
fn printable(path: &Path) -> String {
    path.to_string_lossy().replace(char::is_control, "\u{fffd}")
}

impl fmt::Display for DomainError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InvalidInstance { name } => {
                write!(formatter, "instance is {name:?}, must be 1 to {MAX_INSTANCE_LEN} of a-z, 0-9 and -")
            }
            Self::RootPath { root } => write!(
                formatter,
                "the bus directory is {}, must be absolute, under {MAX_ROOT_PATH_LEN} bytes and of printable ASCII characters \
                 but <>\"|?*: set XDG_RUNTIME_DIR to another path or unset it",
                printable(root)
            ),
            Self::RuntimeDirectory { path, error } => {
                write!(formatter, "XDG_RUNTIME_DIR is {}, must be an existing directory: {error}", path.display())
            }
            Self::Missing { path } => write!(formatter, "the bus directory {} does not exist", path.display()),
            Self::NotADirectory { path } => write!(formatter, "{} is not a directory: remove it", path.display()),
            Self::ForeignOwner { path, owner, user } => write!(
                formatter,
                "the bus directory {} belongs to user {owner}, must belong to user {user}: remove it, run as its owner, or \
                 set XDG_RUNTIME_DIR to a folder of your own for every program",
                path.display()
            ),
            Self::WritableByOthers { path, mode } => write!(
                formatter,
                "the bus directory {} has mode {mode:04o}, must not be writable by others: chmod 0700 it",
                path.display()
            ),
            Self::PermissionDenied { path } => write!(
                formatter,
                "permission denied on the bus directory {}: run as the user who runs the server",
                path.display()
            ),
            Self::Held { path, pid } => {
                let pid =
                    pid.map_or_else(|| "a process that is not listed here".to_owned(), |pid| format!("pid {pid}"));
                write!(
                    formatter,
                    "{} is held by {pid}, which is clearing the bus and makes no progress: resume or kill it",
                    path.display()
                )
            }
            Self::Io { path, error } => write!(formatter, "{}: {error}{}", path.display(), remedy(path, error)),
        }
    }
}

// The text contains the operating system's reason, so `source` returns none.
impl core::error::Error for DomainError {}
