//! The files of a recording: their names, and the removal of the oldest files when the recording exceeds its size limit.

use std::{collections::VecDeque, ffi::OsStr, fs, io, path::PathBuf};

use crate::system::whole_file::folder_of;

/// The names of a recording's files: `show.mcap`, `show-0002.mcap`, `show-0003.mcap`, …
#[derive(Clone, Debug)]
pub(super) struct FileNames {
    first: PathBuf,
}

impl FileNames {
    /// Names that begin with `first` itself.
    pub(super) fn new(first: PathBuf) -> Self {
        Self { first }
    }

    /// Path of the file with a number, counted from 1.
    pub(super) fn path(&self, number: u64) -> PathBuf {
        if number <= 1 {
            return self.first.clone();
        }
        let mut name = self.stem().to_os_string();
        name.push(format!("-{number:04}"));
        if let Some(extension) = self.first.extension() {
            name.push(".");
            name.push(extension);
        }
        self.first.with_file_name(name)
    }

    /// Finds an existing file with one of these names.
    pub(super) fn taken(&self) -> io::Result<Option<PathBuf>> {
        for entry in fs::read_dir(folder_of(&self.first))? {
            let name = entry?.file_name();
            if self.includes(&name) {
                return Ok(Some(self.first.with_file_name(name)));
            }
        }
        Ok(None)
    }

    fn stem(&self) -> &OsStr {
        self.first.file_stem().unwrap_or_default()
    }

    fn includes(&self, name: &OsStr) -> bool {
        let number = || -> Option<u64> {
            let rest = name.to_str()?.strip_prefix(self.stem().to_str()?)?.strip_prefix('-')?;
            let digits = rest.trim_end_matches(|character: char| !character.is_ascii_digit());
            rest.get(..digits.len())?.parse().ok()
        };
        let same = |number| self.path(number).file_name() == Some(name);
        same(1) || number().is_some_and(same)
    }
}

/// Finished files of a recording, the oldest first.
#[derive(Clone, Debug, Default)]
pub(super) struct FinishedFiles {
    files: VecDeque<(PathBuf, u64)>,
    /// Size of all finished files in bytes.
    pub(super) bytes: u64,
}

impl FinishedFiles {
    pub(super) fn push(&mut self, path: PathBuf, bytes: u64) {
        self.bytes += bytes;
        self.files.push_back((path, bytes));
    }

    /// Removes the oldest file from the list and returns its path, if these files and a current file of `current_bytes`
    /// together exceed `limit_bytes`.
    pub(super) fn take_oldest_over(&mut self, limit_bytes: u64, current_bytes: u64) -> Option<PathBuf> {
        if self.bytes + current_bytes <= limit_bytes {
            return None;
        }
        let (path, bytes) = self.files.pop_front()?;
        self.bytes -= bytes;
        Some(path)
    }

    pub(super) fn into_paths(self) -> Vec<PathBuf> {
        self.files.into_iter().map(|(path, _)| path).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn first_file_has_the_given_name_and_later_files_a_number() {
        let names = FileNames::new("shows/may.day.mcap".into());
        assert_eq!(names.path(1), Path::new("shows/may.day.mcap"));
        assert_eq!(names.path(2), Path::new("shows/may.day-0002.mcap"));
        assert_eq!(names.path(12_345), Path::new("shows/may.day-12345.mcap"));
        assert_eq!(FileNames::new("take".into()).path(3), Path::new("take-0003"));
    }

    #[test]
    fn only_names_that_the_recording_would_give_belong_to_it() {
        let names = FileNames::new("show.mcap".into());
        for name in ["show.mcap", "show-0002.mcap", "show-12345.mcap"] {
            assert!(names.includes(OsStr::new(name)), "{name}");
        }
        for name in ["show-2.mcap", "show-0002.txt", "show-a.mcap", "show-0002-0003.mcap", "other.mcap", "show-"] {
            assert!(!names.includes(OsStr::new(name)), "{name}");
        }
    }

    #[test]
    fn oldest_files_are_removed_until_the_rest_fits() {
        let mut files = FinishedFiles::default();
        for number in 1..=4 {
            files.push(format!("{number}").into(), 100);
        }
        assert_eq!(files.take_oldest_over(350, 100), Some("1".into()));
        assert_eq!(files.take_oldest_over(350, 100), Some("2".into()));
        assert_eq!(files.take_oldest_over(350, 100), None);
        assert_eq!(files.bytes, 200);
    }

    #[test]
    fn current_file_is_never_removed() {
        assert_eq!(FinishedFiles::default().take_oldest_over(10, 100), None);
    }
}
