//! Files that get their name when something is in them: a process that is killed before leaves nothing.

use std::fs::{self, File};
use std::io;
use std::os::fd::AsRawFd as _;
use std::path::Path;

use rustix::fs::{AtFlags, CWD, Mode, OFlags, linkat, openat};

/// A file without a name, in a folder.
///
/// # Errors
/// Where that cannot be made, or could not be named: not every file system has it.
pub fn create(folder: &Path) -> io::Result<File> {
    let file = openat(CWD, folder, OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC, Mode::from_raw_mode(0o666))?;
    let file = File::from(file);
    fs::symlink_metadata(open_file_path(&file))?;
    Ok(file)
}

/// Gives a nameless file its name.
///
/// # Errors
/// Where the name is taken, and the operating system's others.
pub fn give_name(file: &File, path: &Path) -> io::Result<()> {
    Ok(linkat(CWD, open_file_path(file), CWD, path, AtFlags::SYMLINK_FOLLOW)?)
}

/// The folder in which a file lies; `.` for a bare name.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The path by which this process finds a file that it has open.
fn open_file_path(file: &File) -> String {
    format!("/proc/self/fd/{}", file.as_raw_fd())
}
