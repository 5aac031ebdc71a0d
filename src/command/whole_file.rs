//! Files that are there whole or not at all.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::process;

use anyhow::Context as _;

use crate::system::nameless_file::{self, folder_of};

/// Writes a file in one go, in place of one of that name. Where that fails, what was there before is left as it was.
///
/// The bytes go into a file without a name, which gets one when they are on the disk: a process that is killed before leaves
/// nothing. What is no ordinary file, such as a pipe or a terminal, is written to as it is.
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
    create_unfinished(&path).map(|(_file, unfinished)| drop(unfinished))
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
    /// What it is until then; nothing where the path is that of no ordinary file.
    unfinished: Option<Unfinished>,
}

/// A file that has not got its name yet.
#[derive(Debug)]
struct Unfinished {
    /// A hidden name in the same folder, of this process alone.
    hidden: PathBuf,
    /// Whether it has that one already, because this file system has no files without a name.
    is_named: bool,
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
        let (file, unfinished) = create_unfinished(&path)?;
        Ok(Self { file, path, unfinished: Some(unfinished) })
    }

    fn finish_or_leave(mut self) -> io::Result<()> {
        let Some(unfinished) = &mut self.unfinished else { return Ok(()) };
        self.file.sync_all()?;
        unfinished.give_name(&self.file)?;
        fs::rename(&unfinished.hidden, &self.path)?;
        unfinished.is_named = false;
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

impl Unfinished {
    /// Gives the file its hidden name, by which it can be moved onto another one.
    fn give_name(&mut self, file: &File) -> io::Result<()> {
        if !self.is_named {
            self.clear()?;
            nameless_file::give_name(file, &self.hidden)?;
            self.is_named = true;
        }
        Ok(())
    }

    /// Removes what a process of the same number left when it was killed.
    fn clear(&self) -> io::Result<()> {
        match fs::remove_file(&self.hidden) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if self.is_named {
            // What kept it from being finished is told already.
            let _ = fs::remove_file(&self.hidden);
        }
    }
}

/// Creates a file that is to be at a path: without a name where the file system has that, else under a hidden one.
fn create_unfinished(path: &Path) -> io::Result<(File, Unfinished)> {
    let name = path.file_name().ok_or(ErrorKind::IsADirectory)?;
    let mut hidden = std::ffi::OsString::from(".");
    hidden.push(name);
    hidden.push(format!(".{}", process::id()));
    let mut unfinished = Unfinished { hidden: path.with_file_name(hidden), is_named: false };
    if let Ok(file) = nameless_file::create(folder_of(path)) {
        return Ok((file, unfinished));
    }
    unfinished.clear()?;
    let file = File::create_new(&unfinished.hidden)?;
    unfinished.is_named = true;
    Ok((file, unfinished))
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
        let is_named = file.unfinished.as_ref().is_some_and(|unfinished| unfinished.is_named);
        assert_eq!(names(folder.path()).len(), usize::from(is_named), "a name only where files cannot be without");
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
