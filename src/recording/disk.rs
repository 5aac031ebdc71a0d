//! The disk of a recording: the operations that the writer and the repair need of files.
//!
//! [`SystemDisk`] is the operating system's. A test has a disk with faults.

use std::{
    fmt::Debug,
    fs::{self, File, TryLockError},
    io::{self, Read, Seek, SeekFrom, Write},
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use mcap::MAGIC;
use rustix::fs::{Advice, FallocateFlags, fadvise, fallocate};

use super::progress::DiskSpace;
use crate::system::whole_file::{create_nameless, give_name};

/// A disk on which recordings are written and repaired.
pub trait RecordingDisk: Debug + Send + Sync {
    /// Creates a file in a folder, without a name.
    ///
    /// # Errors
    /// The file cannot be created. Not every disk has files without a name.
    fn create_nameless(&self, folder: &Path) -> io::Result<Arc<dyn RecordingFile>>;

    /// Creates a file with a name.
    ///
    /// # Errors
    /// The file cannot be created, or exists.
    fn create_new(&self, path: &Path) -> io::Result<Arc<dyn RecordingFile>>;

    /// Whether a path is that of an ordinary file.
    ///
    /// # Errors
    /// There is nothing with this name.
    fn is_file(&self, path: &Path) -> io::Result<bool>;

    /// Opens a file to read it, and to write it if `to_write`.
    ///
    /// # Errors
    /// The file cannot be opened.
    fn open(&self, path: &Path, to_write: bool) -> io::Result<Arc<dyn RecordingFile>>;

    /// Removes a file.
    ///
    /// # Errors
    /// The file cannot be removed.
    fn remove(&self, path: &Path) -> io::Result<()>;
}

/// An open file.
#[expect(clippy::missing_errors_doc, reason = "each error is that of the system")]
pub trait RecordingFile: Debug + Send + Sync {
    /// Length in bytes.
    fn length(&self) -> io::Result<u64>;

    /// Cuts the file, or extends it with zeros. Releases the reserved room behind its end.
    fn set_length(&self, bytes: u64) -> io::Result<()>;

    /// Reads bytes from a position on. Returns their number; 0 at the end of the file.
    fn read_at(&self, buffer: &mut [u8], at: u64) -> io::Result<usize>;

    /// Writes bytes from a position on. Returns the number of those that were written.
    fn write_at(&self, bytes: &[u8], at: u64) -> io::Result<usize>;

    /// Reserves room on the disk, without changing the length of the file.
    fn reserve(&self, at: u64, bytes: u64) -> io::Result<()>;

    /// Waits until the bytes and the length of the file are on the disk.
    fn sync(&self) -> io::Result<()>;

    /// The space of the disk.
    fn space(&self) -> io::Result<DiskSpace>;

    /// Gives a nameless file its name.
    fn give_name(&self, path: &Path) -> io::Result<()>;

    /// Locks the file against all other openings of it. `Ok(false)`: another one has locked it.
    fn lock(&self) -> io::Result<bool>;

    /// Unlocks the file.
    fn unlock(&self);

    /// Prepares for reads at random positions.
    fn expect_random_reads(&self) {}
}

/// The disk of the operating system.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SystemDisk;

impl RecordingDisk for SystemDisk {
    fn create_nameless(&self, folder: &Path) -> io::Result<Arc<dyn RecordingFile>> {
        Ok(Arc::new(create_nameless(folder)?))
    }

    fn create_new(&self, path: &Path) -> io::Result<Arc<dyn RecordingFile>> {
        Ok(Arc::new(File::create_new(path)?))
    }

    fn is_file(&self, path: &Path) -> io::Result<bool> {
        Ok(fs::metadata(path)?.is_file())
    }

    fn open(&self, path: &Path, to_write: bool) -> io::Result<Arc<dyn RecordingFile>> {
        Ok(Arc::new(File::options().read(true).write(to_write).open(path)?))
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        fs::remove_file(path)
    }
}

impl RecordingFile for File {
    fn length(&self) -> io::Result<u64> {
        Ok(self.metadata()?.len())
    }

    fn set_length(&self, bytes: u64) -> io::Result<()> {
        self.set_len(bytes)
    }

    fn read_at(&self, buffer: &mut [u8], at: u64) -> io::Result<usize> {
        std::os::unix::fs::FileExt::read_at(self, buffer, at)
    }

    fn write_at(&self, bytes: &[u8], at: u64) -> io::Result<usize> {
        std::os::unix::fs::FileExt::write_at(self, bytes, at)
    }

    fn reserve(&self, at: u64, bytes: u64) -> io::Result<()> {
        Ok(fallocate(self, FallocateFlags::KEEP_SIZE, at, bytes)?)
    }

    fn sync(&self) -> io::Result<()> {
        self.sync_data()
    }

    fn space(&self) -> io::Result<DiskSpace> {
        DiskSpace::around(self)
    }

    fn give_name(&self, path: &Path) -> io::Result<()> {
        give_name(self, path)
    }

    fn lock(&self) -> io::Result<bool> {
        match self.try_lock() {
            Ok(()) => Ok(true),
            Err(TryLockError::WouldBlock) => Ok(false),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }

    fn unlock(&self) {
        // Fails only for a file that is not open.
        let _ = File::unlock(self);
    }

    fn expect_random_reads(&self) {
        // Without this advice the kernel reads ahead, into the contents of chunks. A failure costs only time.
        let _ = fadvise(self, 0, None, Advice::Random);
    }
}

impl dyn RecordingFile + '_ {
    /// Reads bytes from a position on, all of them.
    pub(super) fn read_exact_at(&self, mut buffer: &mut [u8], mut at: u64) -> io::Result<()> {
        while !buffer.is_empty() {
            match self.read_at(buffer, at)? {
                0 => return Err(io::ErrorKind::UnexpectedEof.into()),
                read => (buffer, at) = (&mut buffer[read..], at + read as u64),
            }
        }
        Ok(())
    }

    /// Writes bytes from a position on, all of them.
    pub(super) fn write_all_at(&self, mut bytes: &[u8], mut at: u64) -> io::Result<()> {
        while !bytes.is_empty() {
            match self.write_at(bytes, at)? {
                0 => return Err(io::ErrorKind::WriteZero.into()),
                written => (bytes, at) = (&bytes[written..], at + written as u64),
            }
        }
        Ok(())
    }
}

/// Reads a file from a position on.
#[derive(Debug)]
pub(super) struct FileReader<'a> {
    file: &'a dyn RecordingFile,
    at: u64,
}

impl<'a> FileReader<'a> {
    pub(super) fn new(file: &'a dyn RecordingFile, at: u64) -> Self {
        Self { file, at }
    }
}

impl Read for FileReader<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.file.read_at(buffer, self.at)?;
        self.at += read as u64;
        Ok(read)
    }
}

impl Seek for FileReader<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let target = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::Current(ahead) => self.at.checked_add_signed(ahead),
            SeekFrom::End(ahead) => self.file.length()?.checked_add_signed(ahead),
        };
        self.at = target.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.at)
    }
}

/// Writes a file from its beginning on, but for its last bytes.
///
/// The magic bytes at the end of a recording state that the file is whole. So [`FileSync`](super::disk_sync::FileSync) writes them,
/// after all other bytes are on the disk.
#[derive(Debug)]
pub(super) struct FileAppender {
    file: Arc<dyn RecordingFile>,
    at: u64,
    /// Whether the end of the file is being written.
    is_ending: Arc<AtomicBool>,
    /// The last bytes so far of an ending, at most [`MAGIC`]'s length of them.
    held: Vec<u8>,
}

impl FileAppender {
    /// Writes all bytes until `is_ending`. From then on, it holds the last ones back.
    pub(super) fn new(file: Arc<dyn RecordingFile>, is_ending: Arc<AtomicBool>) -> Self {
        Self { file, at: 0, is_ending, held: Vec::new() }
    }

    /// Writes the bytes, behind those held, but for the last ones.
    fn write_ending(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.held.extend(bytes);
        let written = self.held.len().saturating_sub(MAGIC.len());
        self.file.write_all_at(&self.held[..written], self.at)?;
        self.at += written as u64;
        self.held.drain(..written);
        Ok(())
    }
}

impl Write for FileAppender {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.is_ending.load(Ordering::Relaxed) {
            return self.write_ending(bytes).map(|()| bytes.len());
        }
        let written = self.file.write_at(bytes, self.at)?;
        self.at += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
