//! Files that are there whole or not at all.
//!
//! A file has no name while it is written, and gets one when it is complete: a process that is killed before leaves nothing.
//! Where the file system has no files without a name, it has a hidden one until then.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write as _};
use std::os::fd::AsRawFd as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::process;

use anyhow::Context as _;
use rustix::fs::{AtFlags, CWD, OFlags, linkat};
use tempfile::TempPath;

/// Writes a file in one go, in place of one of that name. Where that fails, what was there before is left as it was.
///
/// The bytes are on the disk before the file gets its name. What is no ordinary file, such as a pipe or a terminal, is
/// written to as it is.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let mut file = WholeFile::create(path)?;
    file.write_all(bytes).with_context(|| format!("cannot write {}", path.display()))?;
    file.finish()
}

/// Fails where a file could not be written: for what takes long to find out.
pub(crate) fn check(path: &Path) -> anyhow::Result<()> {
    let create = |path: PathBuf| {
        if path.is_dir() {
            return Err(ErrorKind::IsADirectory.into());
        }
        // To open and close a pipe would be its end to whoever reads it.
        if path.exists() && !path.is_file() { Ok(()) } else { WholeFile::begin(path).map(drop) }
    };
    behind_links(path).and_then(create).with_context(|| format!("cannot write {}", path.display()))
}

/// A file that is written little by little, and takes its place with [`WholeFile::finish`]. One that is dropped before is gone.
#[derive(Debug)]
pub(crate) struct WholeFile {
    file: File,
    path: PathBuf,
    /// A hidden name in the same folder, of this process alone; none where the path is that of no ordinary file.
    hidden: Option<TempPath>,
    /// Whether it has not even that name yet.
    is_nameless: bool,
}

impl WholeFile {
    /// Begins a file that is to be at a path.
    pub(crate) fn create(path: &Path) -> anyhow::Result<Self> {
        let create = |path: PathBuf| {
            if path.exists() && !path.is_file() {
                let file = OpenOptions::new().write(true).open(&path)?;
                return Ok(Self { file, path, hidden: None, is_nameless: false });
            }
            Self::begin(path)
        };
        behind_links(path).and_then(create).with_context(|| format!("cannot write {}", path.display()))
    }

    /// Puts the file in its place.
    pub(crate) fn finish(self) -> anyhow::Result<()> {
        let path = self.path.clone();
        self.finish_or_leave().with_context(|| format!("cannot write {}", path.display()))
    }

    fn begin(path: PathBuf) -> io::Result<Self> {
        let hidden = hidden_path(&path)?;
        // What a killed process of the same number left.
        match fs::remove_file(&hidden) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let (file, is_nameless) = match create_nameless(folder_of(&path)) {
            Ok(file) => (file, true),
            Err(_) => (File::create_new(&hidden)?, false),
        };
        Ok(Self { file, path, hidden: Some(TempPath::try_from_path(hidden)?), is_nameless })
    }

    fn finish_or_leave(self) -> io::Result<()> {
        let Some(hidden) = self.hidden else { return Ok(()) };
        self.file.sync_all()?;
        if self.is_nameless {
            // By that name it can be moved onto another file.
            give_name(&self.file, &hidden)?;
        }
        hidden.persist(self.path).map_err(|failed| failed.error)
    }
}

impl io::Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Creates a file without a name, in a folder.
///
/// # Errors
/// Where that cannot be made, or could not be named: not every file system has it.
pub fn create_nameless(folder: &Path) -> io::Result<File> {
    let flags = OFlags::TMPFILE.bits() as i32;
    let file = OpenOptions::new().read(true).write(true).custom_flags(flags).open(folder)?;
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

/// Behind a symbolic link it is the file linked to that is replaced.
fn behind_links(path: &Path) -> io::Result<PathBuf> {
    match fs::canonicalize(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(path.to_owned()),
        found => found,
    }
}

fn hidden_path(path: &Path) -> io::Result<PathBuf> {
    let mut name = OsString::from(".");
    name.push(path.file_name().ok_or(ErrorKind::IsADirectory)?);
    name.push(format!(".{}", process::id()));
    Ok(path.with_file_name(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("the folder is ours");
        entries.map(|entry| entry.expect("a name").file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_file_that_is_being_written_is_not_there_and_one_that_is_dropped_never_was() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("dance.csv");
        let mut file = WholeFile::create(&path).expect("the folder is ours");
        file.write_all(b"whole").expect("there is room");
        assert_eq!(
            names(folder.path()).len(),
            usize::from(!file.is_nameless),
            "a name only where files cannot be without"
        );
        file.finish().expect("it takes its place");
        assert_eq!(names(folder.path()), ["dance.csv"]);
        assert_eq!(fs::read(&path).expect("it is there"), b"whole");
        drop(WholeFile::create(&path).expect("there may be one already"));
        assert_eq!(fs::read(&path).expect("it is still there"), b"whole");
        assert_eq!(names(folder.path()), ["dance.csv"]);
    }

    #[test]
    fn what_a_process_of_the_same_number_left_is_in_nobodys_way() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("dance.csv");
        fs::write(folder.path().join(format!(".dance.csv.{}", process::id())), b"half").expect("the folder is ours");
        write(&path, b"whole").expect("it is written");
        assert_eq!(names(folder.path()), ["dance.csv"]);
    }
}
