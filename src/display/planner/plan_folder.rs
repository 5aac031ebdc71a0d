//! The configuration's folder: the only place from which the page's text reads files, and to which it is saved.

use std::ffi::OsStr;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use toml_edit::{DocumentMut, Item, TableLike, Value};

use crate::config::{Config, ConfigError, MAX_CONFIG_BYTES, PlanDocument, read_document};
use crate::system::whole_file;

/// The folder, and the name of the file that was opened.
#[derive(Debug)]
pub(super) struct PlanFolder {
    folder: PathBuf,
    /// The opened file; `None` for the paper's dragon.
    pub(super) name: Option<String>,
}

/// A text on the disk.
#[derive(Clone, Debug)]
pub(super) struct Saved {
    pub(super) text: String,
    pub(super) mark: String,
}

/// Why a text is not saved.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// The request is wrong, in words.
    Bad(String),
    /// The file on the disk is not the one that the page knows.
    Conflict(String),
}

impl PlanFolder {
    /// The folder of a file, or the working folder.
    ///
    /// # Errors
    /// The folder cannot be read, or the file's name is not UTF-8.
    pub(super) fn of(file: Option<&Path>) -> io::Result<Self> {
        let parent = file.and_then(Path::parent).filter(|parent| !parent.as_os_str().is_empty());
        let folder = fs::canonicalize(parent.unwrap_or(Path::new(".")))?;
        let name = file.and_then(Path::file_name).map(|name| name.to_str().map(str::to_owned));
        match name {
            Some(None) => Err(io::Error::other("its name is not UTF-8")),
            name => Ok(Self { folder, name: name.flatten() }),
        }
    }

    /// The text of a file in the folder.
    ///
    /// # Errors
    /// As of [`read_document`].
    pub(super) fn read(&self, name: &str) -> Result<Saved, ConfigError> {
        let text = read_document(&self.folder.join(name))?;
        Ok(Saved { mark: mark(&text), text })
    }

    /// The configuration of a text.
    ///
    /// # Errors
    /// The reason, in one line.
    pub(super) fn config(&self, text: &str) -> Result<Config, String> {
        if text.len() as u64 > MAX_CONFIG_BYTES {
            return Err(format!("the text is longer than {MAX_CONFIG_BYTES} bytes, the most that is allowed"));
        }
        self.require_inside(text)?;
        let config = PlanDocument::of_file_text(text, &self.folder).and_then(PlanDocument::build);
        config.map_err(|error: ConfigError| error.to_string())
    }

    /// Fails for a text that names a file outside the folder.
    fn require_inside(&self, text: &str) -> Result<(), String> {
        // A text that is no TOML reads no file.
        let Ok(document) = text.parse::<DocumentMut>() else { return Ok(()) };
        let entries = document.get("dragons").map(tables).unwrap_or_default();
        let all = std::iter::once(document.as_table() as &dyn TableLike).chain(entries);
        for table in all {
            for (name, key) in [("route", "file"), ("ground", "heights")] {
                let value = table.get(name).and_then(Item::as_table_like).and_then(|table| table.get(key));
                let Some(file) = value.and_then(Item::as_str) else { continue };
                // A file that is not there is the reader's error.
                let Ok(path) = fs::canonicalize(self.folder.join(file)) else { continue };
                if !path.starts_with(&self.folder) {
                    return Err(format!("[{name}] {key} is {file:?}, must be in the folder of the configuration"));
                }
            }
        }
        Ok(())
    }

    /// Saves a text as a file of the folder. `known`: the mark of the file that the page knows; `None` for a new file. Returns the
    /// mark of the saved text.
    ///
    /// # Errors
    /// The name is not allowed, the text is not valid, the file on the disk is another one, or it cannot be written.
    pub(super) fn save(&self, name: &str, text: &str, known: Option<&str>) -> Result<String, Refusal> {
        let is_opened = self.name.as_deref() == Some(name);
        if !is_opened && !is_plain(name) {
            return Err(Refusal::Bad(format!(
                "the name is {name:?}, must be such as \"street.toml\", in the same folder"
            )));
        }
        self.config(text).map_err(|reason| Refusal::Bad(format!("a text with an error is not saved: {reason}")))?;
        let path = self.folder.join(name);
        self.require_known(&path, name, known, is_opened)?;
        whole_file::write(&path, text.as_bytes()).map_err(|error| Refusal::Bad(format!("{error:#}")))?;
        Ok(mark(text))
    }

    fn require_known(&self, path: &Path, name: &str, known: Option<&str>, is_opened: bool) -> Result<(), Refusal> {
        let there = fs::symlink_metadata(path).ok();
        match (there, known) {
            (None, None) => Ok(()),
            (None, Some(_)) => Err(Refusal::Conflict(format!("{name} is no longer there: save it under another name"))),
            (Some(_), None) => Err(Refusal::Conflict(format!("{name} exists already: choose another name"))),
            // Only the user may name a link, when the program starts.
            (Some(there), Some(_)) if there.is_symlink() && !is_opened => {
                Err(Refusal::Bad(format!("{name} is a link: choose another name")))
            }
            (Some(_), Some(known)) => {
                let is_same = self.read(name).is_ok_and(|saved| saved.mark == known);
                let other = "has changed on the disk since this page read it: save under another name, or reload";
                if is_same { Ok(()) } else { Err(Refusal::Conflict(format!("{name} {other}"))) }
            }
        }
    }
}

/// The tables of an array of tables, or of an array of inline tables.
fn tables(item: &Item) -> Vec<&dyn TableLike> {
    match item {
        Item::ArrayOfTables(tables) => tables.iter().map(|table| table as &dyn TableLike).collect(),
        Item::Value(Value::Array(values)) => {
            values.iter().filter_map(Value::as_inline_table).map(|table| table as _).collect()
        }
        _ => Vec::new(),
    }
}

/// Tells two texts apart.
fn mark(text: &str) -> String {
    format!("{:08x}-{}", crc32fast::hash(text.as_bytes()), text.len())
}

/// Whether a name is that of a configuration in the folder itself, and not hidden.
fn is_plain(name: &str) -> bool {
    let path = Path::new(name);
    let is_alone = path.file_name() == Some(OsStr::new(name)) && !name.contains(['/', '\\', '\0']);
    is_alone && !name.starts_with('.') && name.len() <= 100 && path.extension() == Some(OsStr::new("toml"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> (tempfile::TempDir, PlanFolder) {
        let outer = tempfile::tempdir().expect("a folder");
        let inner = outer.path().join("plans");
        fs::create_dir(&inner).expect("a folder");
        fs::write(inner.join("a.toml"), "[dragon]\nbenches = 5\n").expect("a file");
        fs::write(outer.path().join("secret.csv"), "x,y\n0,0\n9,9\n").expect("a file");
        let folder = PlanFolder::of(Some(&inner.join("a.toml"))).expect("the folder");
        (outer, folder)
    }

    #[test]
    fn a_file_that_has_changed_on_the_disk_is_not_overwritten() {
        let (outer, folder) = folder();
        let opened = folder.read("a.toml").expect("the file");
        let mark = folder.save("a.toml", "[dragon]\nbenches = 6\n", Some(&opened.mark)).expect("saved");
        assert!(matches!(folder.save("a.toml", "", Some(&opened.mark)), Err(Refusal::Conflict(_))), "an older page");
        fs::write(outer.path().join("plans/a.toml"), "# mine\n").expect("a file");
        assert!(matches!(folder.save("a.toml", "", Some(&mark)), Err(Refusal::Conflict(_))));
        assert_eq!(folder.read("a.toml").expect("the file").text, "# mine\n");
    }

    #[test]
    fn a_file_that_has_become_too_long_is_neither_read_in_part_nor_overwritten() {
        let (outer, folder) = folder();
        let long = outer.path().join("plans/a.toml");
        fs::write(&long, "#".repeat(MAX_CONFIG_BYTES as usize + 1)).expect("a file");
        assert!(folder.read("a.toml").expect_err("too long").to_string().starts_with("is longer than "));
        let part = mark(&"#".repeat(MAX_CONFIG_BYTES as usize));
        assert!(matches!(folder.save("a.toml", "", Some(&part)), Err(Refusal::Conflict(_))));
        assert_eq!(fs::metadata(&long).expect("the file").len(), MAX_CONFIG_BYTES + 1);
    }

    #[test]
    fn a_text_is_saved_only_in_the_folder_only_under_a_free_name_and_only_if_it_is_valid() {
        let (outer, folder) = folder();
        for name in ["../b.toml", "/tmp/b.toml", ".b.toml", "b", "b.txt", "", "..", "c/b.toml"] {
            assert!(matches!(folder.save(name, "", None), Err(Refusal::Bad(_))), "{name}");
        }
        assert!(matches!(folder.save("a.toml", "", None), Err(Refusal::Conflict(_))));
        assert!(matches!(folder.save("b.toml", "[dragon]\nbenches = 0\n", None), Err(Refusal::Bad(_))));
        folder.save("b.toml", "", None).expect("saved");
        std::os::unix::fs::symlink(outer.path().join("secret.csv"), outer.path().join("plans/link.toml"))
            .expect("a link");
        assert!(matches!(folder.save("link.toml", "", Some("0")), Err(Refusal::Bad(_))));
    }

    #[test]
    fn files_outside_the_folder_are_not_read() {
        let (outer, folder) = folder();
        let secret = outer.path().join("secret.csv");
        std::os::unix::fs::symlink(&secret, outer.path().join("plans/link.csv")).expect("a link");
        for file in ["../secret.csv", "link.csv", &secret.display().to_string()] {
            let drawing = format!("kind = \"drawing\"\nfile = {file:?}\n");
            for text in
                [format!("[route]\n{drawing}"), format!("[[dragons]]\nname = \"a\"\n[dragons.route]\n{drawing}")]
            {
                let error = folder.config(&text).expect_err("it is outside");
                assert!(error.contains("must be in the folder of the configuration"), "{error}");
            }
        }
    }
}
