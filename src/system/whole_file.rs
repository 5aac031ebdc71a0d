//! Files that are either complete or absent.
//!
//! A file has no name until it is complete. So a killed process leaves no partial file. On a file system without unnamed files,
//! the file has a hidden name until it is complete. A file that replaces another one keeps its mode.

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

/// Writes a whole file, and replaces an existing one. On an error, the existing file is unchanged.
///
/// The bytes are on the disk before the file gets its name. A special file, such as a pipe or a terminal, is written directly.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let mut file = WholeFile::create(path)?;
    file.write_all(bytes).with_context(|| format!("cannot write {}", path.display()))?;
    file.finish()
}

/// Fails if a file cannot be written. Call it before a long computation.
pub(crate) fn check(path: &Path) -> anyhow::Result<()> {
    let create = |path: PathBuf| {
        if path.is_dir() {
            return Err(ErrorKind::IsADirectory.into());
        }
        // Opening and closing a pipe would end the input of its reader.
        if path.exists() && !path.is_file() { Ok(()) } else { WholeFile::begin(path).map(drop) }
    };
    behind_links(path).and_then(create).with_context(|| format!("cannot write {}", path.display()))
}

/// A file that is written in parts, and gets its name with [`WholeFile::finish`]. Dropping it earlier removes it.
#[derive(Debug)]
pub(crate) struct WholeFile {
    file: File,
    path: PathBuf,
    /// A hidden name in the same folder, which only this process uses; `None` for a special file.
    hidden: Option<TempPath>,
    /// Whether the file does not have the hidden name yet.
    is_nameless: bool,
}

impl WholeFile {
    /// Begins a file for a path.
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

    /// Gives the file its name, and replaces an existing file.
    pub(crate) fn finish(self) -> anyhow::Result<()> {
        let path = self.path.clone();
        self.finish_or_leave().with_context(|| format!("cannot write {}", path.display()))
    }

    fn begin(path: PathBuf) -> io::Result<Self> {
        let hidden = hidden_path(&path)?;
        // Removes the file of a killed process with the same process id.
        match fs::remove_file(&hidden) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let (file, is_nameless) = match create_nameless(folder_of(&path)) {
            Ok(file) => (file, true),
            Err(_) => (File::create_new(&hidden)?, false),
        };
        keep_mode(&path, &file)?;
        Ok(Self { file, path, hidden: Some(TempPath::try_from_path(hidden)?), is_nameless })
    }

    fn finish_or_leave(self) -> io::Result<()> {
        let Some(hidden) = self.hidden else { return Ok(()) };
        keep_mode(&self.path, &self.file)?;
        self.file.sync_all()?;
        if self.is_nameless {
            // Only a file with a name can replace another file.
            give_name(&self.file, &hidden)?;
        }
        hidden.persist(self.path).map_err(|failed| failed.error)
    }
}

/// Gives a file the mode of the file that it will replace, if there is one.
fn keep_mode(replaced: &Path, file: &File) -> io::Result<()> {
    match fs::metadata(replaced) {
        Ok(metadata) => file.set_permissions(metadata.permissions()),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error),
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

/// Creates an unnamed file in a folder.
///
/// # Errors
/// If the file cannot be created, or could not get a name later. Not every file system has unnamed files.
pub fn create_nameless(folder: &Path) -> io::Result<File> {
    let flags = OFlags::TMPFILE.bits() as i32;
    let file = OpenOptions::new().read(true).write(true).custom_flags(flags).open(folder)?;
    fs::symlink_metadata(open_file_path(&file))?;
    Ok(file)
}

/// Gives an unnamed file its name.
///
/// # Errors
/// If the name is taken, and the other errors of the operating system.
pub fn give_name(file: &File, path: &Path) -> io::Result<()> {
    Ok(linkat(CWD, open_file_path(file), CWD, path, AtFlags::SYMLINK_FOLLOW)?)
}

/// The folder of a file; `.` for a name without a folder.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Path of a file that this process has open.
fn open_file_path(file: &File) -> String {
    format!("/proc/self/fd/{}", file.as_raw_fd())
}

/// Resolves symbolic links, so that the target of a link is replaced and not the link.
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
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("the folder is ours");
        entries.map(|entry| entry.expect("a name").file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn file_is_absent_until_it_is_finished_and_a_dropped_file_stays_absent() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("dance.csv");
        let mut file = WholeFile::create(&path).expect("the folder is ours");
        file.write_all(b"whole").expect("there is room");
        assert_eq!(
            names(folder.path()).len(),
            usize::from(!file.is_nameless),
            "a hidden name only on a file system without unnamed files"
        );
        file.finish().expect("the file gets its name");
        assert_eq!(names(folder.path()), ["dance.csv"]);
        assert_eq!(fs::read(&path).expect("the file exists"), b"whole");
        drop(WholeFile::create(&path).expect("a file with this name may exist"));
        assert_eq!(fs::read(&path).expect("the file still exists"), b"whole");
        assert_eq!(names(folder.path()), ["dance.csv"]);
    }

    #[test]
    fn a_replaced_file_keeps_its_mode_and_a_new_file_has_the_usual_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let mode = |name: &str| {
            let metadata = fs::metadata(folder.path().join(name)).expect("the file exists");
            metadata.permissions().mode() & 0o7777
        };
        for kept in [0o600, 0o640, 0o666] {
            let path = folder.path().join("dance.csv");
            fs::write(&path, b"old").expect("the folder is ours");
            fs::set_permissions(&path, fs::Permissions::from_mode(kept)).expect("the file is ours");
            write(&path, b"new").expect("the folder is ours");
            assert_eq!((fs::read(&path).expect("the file exists"), mode("dance.csv")), (b"new".to_vec(), kept));
        }
        write(&folder.path().join("new.csv"), b"new").expect("the folder is ours");
        File::create(folder.path().join("usual")).expect("the folder is ours");
        assert_eq!(mode("new.csv"), mode("usual"));
    }

    #[test]
    fn remains_of_a_process_with_the_same_id_are_replaced() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("dance.csv");
        fs::write(folder.path().join(format!(".dance.csv.{}", process::id())), b"half").expect("the folder is ours");
        write(&path, b"whole").expect("the folder is ours");
        assert_eq!(names(folder.path()), ["dance.csv"]);
    }
}
