//! Files that are there whole or not at all.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::process;

use anyhow::Context as _;

/// Writes a file in one go, in place of one of that name. Where that fails, what was there before is left as it was.
///
/// The bytes go into a file beside it, which takes its name when they are on the disk. What is no ordinary file, such as
/// a pipe or a terminal, is written to as it is.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    write_or_leave(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

/// Fails where a file could not be written: for what takes long to find out.
pub(crate) fn check(path: &Path) -> anyhow::Result<()> {
    create_beside(path).with_context(|| format!("cannot write {}", path.display()))
}

fn create_beside(path: &Path) -> io::Result<()> {
    let path = behind_links(path)?;
    if path.is_dir() {
        return Err(ErrorKind::IsADirectory.into());
    }
    if path.exists() && !path.is_file() {
        // To open and close a pipe would be its end to whoever reads it.
        return Ok(());
    }
    let unfinished = unfinished(&path)?;
    File::create_new(&unfinished)?;
    fs::remove_file(&unfinished)
}

/// Behind a symbolic link it is the file linked to that is replaced.
fn behind_links(path: &Path) -> io::Result<PathBuf> {
    match fs::canonicalize(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(path.to_owned()),
        found => found,
    }
}

fn write_or_leave(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = WholeFile::open(path)?;
    file.write_all(bytes)?;
    file.finish_or_leave()
}

/// A file that is written little by little, and takes its place with [`WholeFile::finish`]. One that is dropped before is gone.
#[derive(Debug)]
pub(crate) struct WholeFile {
    file: File,
    path: PathBuf,
    /// Where the bytes are meanwhile; nowhere else where the path is that of no ordinary file.
    unfinished: Option<PathBuf>,
}

impl WholeFile {
    /// Begins a file that is to be at a path.
    pub(crate) fn create(path: &Path) -> anyhow::Result<Self> {
        Self::open(path).with_context(|| format!("cannot write {}", path.display()))
    }

    /// Puts the file in its place.
    pub(crate) fn finish(self) -> anyhow::Result<()> {
        let path = self.path.clone();
        self.finish_or_leave().with_context(|| format!("cannot write {}", path.display()))
    }

    fn open(path: &Path) -> io::Result<Self> {
        let path = behind_links(path)?;
        if path.exists() && !path.is_file() {
            let file = fs::OpenOptions::new().write(true).open(&path)?;
            return Ok(Self { file, path, unfinished: None });
        }
        let unfinished = unfinished(&path)?;
        Ok(Self { file: File::create_new(&unfinished)?, path, unfinished: Some(unfinished) })
    }

    fn finish_or_leave(mut self) -> io::Result<()> {
        let Some(unfinished) = &self.unfinished else { return Ok(()) };
        self.file.sync_all()?;
        fs::rename(unfinished, &self.path)?;
        self.unfinished = None;
        Ok(())
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

impl Drop for WholeFile {
    fn drop(&mut self) {
        if let Some(unfinished) = &self.unfinished {
            // What kept it from being finished is told already.
            let _ = fs::remove_file(unfinished);
        }
    }
}

/// A hidden name in the same folder, of this process alone.
fn unfinished(path: &Path) -> io::Result<PathBuf> {
    let name = path.file_name().ok_or(ErrorKind::IsADirectory)?;
    let mut hidden = std::ffi::OsString::from(".");
    hidden.push(name);
    hidden.push(format!(".{}", process::id()));
    Ok(path.with_file_name(hidden))
}
