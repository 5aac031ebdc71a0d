//! One server an instance: an advisory lock on a file in the domain's directory, which the kernel drops with the
//! process that holds it, however that ends.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use bench_dragon_ipc::Domain;
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;

/// Held for as long as a server runs.
#[derive(Debug)]
pub(super) struct ServerLock {
    path: PathBuf,
    // Closing the file drops the lock.
    _file: File,
}

/// Why there is no lock to be had.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Another server runs.
    #[error("a server already runs on instance {instance:?}, pid {pid}: stop it, or choose another --instance")]
    Taken {
        /// The instance.
        instance: String,
        /// The other server's process id, as it wrote it.
        pid: String,
    },
    /// The operating system refused.
    #[error("{path}: {error}")]
    Io {
        /// The lock file.
        path: PathBuf,
        /// The reason.
        error: io::Error,
    },
}

impl ServerLock {
    /// Takes the lock of a domain whose directory is there.
    ///
    /// # Errors
    /// [`LockError::Taken`] where another process holds it.
    pub(super) fn take(domain: &Domain) -> Result<Self, LockError> {
        let path = domain.root().join("server.lock");
        let failed = |error: io::Error| LockError::Io { path: path.clone(), error };
        loop {
            let mut file = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .mode(0o600)
                .open(&path)
                .map_err(failed)?;
            match flock(&file, FlockOperation::NonBlockingLockExclusive) {
                Ok(()) => {}
                Err(Errno::WOULDBLOCK) => return Err(taken(domain, &mut file)),
                Err(error) => return Err(failed(error.into())),
            }
            if is_still_at(&file, &path).map_err(failed)? {
                write_pid(&mut file).map_err(failed)?;
                return Ok(Self { path, _file: file });
            }
        }
    }
}

impl Drop for ServerLock {
    fn drop(&mut self) {
        // While the lock is held, so that nobody else's file is removed.
        if let Err(error) = fs::remove_file(&self.path) {
            tracing::warn!("cannot remove {}: {error}", self.path.display());
        }
        // The last one to leave the domain could not remove the directory while this file was in it.
        let _ = self.path.parent().map(fs::remove_dir);
    }
}

fn taken(domain: &Domain, file: &mut File) -> LockError {
    let mut pid = String::new();
    let read = file.read_to_string(&mut pid);
    let pid = if read.is_ok() && !pid.trim().is_empty() { pid.trim().to_owned() } else { "unknown".to_owned() };
    LockError::Taken { instance: domain.instance().to_string(), pid }
}

/// Whether the file that was locked is still the one at its path: its last holder may have removed it between our
/// opening and our locking.
fn is_still_at(file: &File, path: &Path) -> io::Result<bool> {
    match fs::metadata(path) {
        Ok(at_path) => Ok(at_path.ino() == file.metadata()?.ino()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

fn write_pid(file: &mut File) -> io::Result<()> {
    file.set_len(0)?;
    file.seek(SeekFrom::Start(0))?;
    writeln!(file, "{}", std::process::id())
}
