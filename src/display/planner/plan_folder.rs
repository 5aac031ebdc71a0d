//! The configuration's folder: the only place from which the page's text reads files, and to which it is saved.

use std::collections::HashSet;
use std::ffi::OsStr;
use std::fs::{self, OpenOptions};
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use toml_edit::{DocumentMut, Item, TableLike, Value};

use super::child;
use crate::config::{Config, ConfigError, MAX_CONFIG_BYTES, PlanDocument, read_document};
use crate::system::whole_file;

/// Tables and keys that name files.
const FILE_KEYS: [(&str, &str); 2] = [("route", "file"), ("ground", "heights")];

/// The folder, and the name of the file that was opened.
#[derive(Debug)]
pub(super) struct PlanFolder {
    folder: PathBuf,
    /// The opened file; `None` for the paper's dragon.
    pub(super) name: Option<String>,
    /// Hashes of the large texts and files that were read within the limits of a command.
    checked: Mutex<HashSet<u64>>,
}

/// Length of a text, and number of benches, from which on a process of its own reads it first.
const LARGE_TEXT: usize = 64 << 10;
const MANY_BENCHES: i64 = 2_000;
/// Most hashes that are kept.
const MAX_CHECKED: usize = 256;
/// Keys of a table with a file that say where it lies, not what is read.
const PLACE_KEYS: [&str; 5] = ["start_x_m", "start_y_m", "start_heading_deg", "start_s", "end_s"];
/// Longest name of a file, in bytes.
const MAX_NAME: usize = 100;
/// Most files of one name.
const MAX_NAMESAKES: usize = 99;

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
            name => Ok(Self { folder, name: name.flatten(), checked: Mutex::default() }),
        }
    }

    /// The text of the file that the user has named, or of one that a page has saved beside it.
    ///
    /// # Errors
    /// The name is not allowed, or the file cannot be read, in words.
    pub(super) fn open(&self, name: &str) -> Result<Saved, String> {
        if self.name.as_deref() != Some(name) {
            let is_file = fs::symlink_metadata(self.folder.join(name)).is_ok_and(|there| there.is_file());
            if !is_plain(name) || !is_file {
                return Err(format!("{name} is no configuration in this folder"));
            }
        }
        self.read(name).map_err(|error| format!("{name} {error}"))
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
        self.require_bounded(text)?;
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
            for (name, key) in FILE_KEYS {
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

    /// Fails for a large text, or one with files, that needs more time or memory than a command may use. A process of its own finds
    /// out, since a thread cannot be stopped. While a hand drags, the same files are not read again.
    fn require_bounded(&self, text: &str) -> Result<(), String> {
        let Some(load) = self.load(text) else { return Ok(()) };
        let checked = || self.checked.lock().unwrap_or_else(PoisonError::into_inner);
        if checked().contains(&load) {
            return Ok(());
        }
        self.check(text)?;
        let mut checked = checked();
        if checked.len() >= MAX_CHECKED {
            checked.clear();
        }
        checked.insert(load);
        Ok(())
    }

    /// Reads a text in a process of its own, as every command does.
    ///
    /// # Errors
    /// The reason, in one line.
    pub(super) fn check(&self, text: &str) -> Result<(), String> {
        child::check(&self.with_whole_paths(text)).map_err(|reason| self.in_short(&reason))
    }

    /// Words with the folder's files by their names alone.
    pub(super) fn in_short(&self, words: &str) -> String {
        words.replace(&format!("{}/", self.folder.display()), "")
    }

    /// A hash of all that makes reading a text long; `None` for a short text without files.
    fn load(&self, text: &str) -> Option<u64> {
        let document = text.parse::<DocumentMut>().ok()?;
        let entries = document.get("dragons").map(tables).unwrap_or_default();
        let all = || std::iter::once(document.as_table() as &dyn TableLike).chain(entries.iter().copied());
        let benches =
            all().flat_map(|table| [table.get("benches"), table.get("dragon").and_then(|own| own.get("benches"))]);
        let benches = benches.flatten().filter_map(Item::as_integer).fold(0, i64::saturating_add);
        let mut hasher = DefaultHasher::new();
        let is_large = text.len() > LARGE_TEXT || benches > MANY_BENCHES;
        if is_large {
            text.hash(&mut hasher);
        }
        let mut has_file = false;
        for (table, (name, key)) in all().flat_map(|table| FILE_KEYS.map(|keys| (table, keys))) {
            let Some(table) = table.get(name).and_then(Item::as_table_like) else { continue };
            let Some(file) = table.get(key).and_then(Item::as_str) else { continue };
            has_file = true;
            let there = fs::metadata(self.folder.join(file)).ok();
            there.map(|there| (there.len(), there.modified().ok())).hash(&mut hasher);
            let read = table.iter().filter(|(key, _)| !PLACE_KEYS.contains(key));
            read.for_each(|(key, item)| (key, item.to_string()).hash(&mut hasher));
        }
        (is_large || has_file).then(|| hasher.finish())
    }

    /// Puts a file into the folder, under its name or, if that is taken, under the name with a number. Returns the name.
    ///
    /// # Errors
    /// The name is not that of a drawing, or the file cannot be written.
    pub(super) fn put(&self, name: &str, bytes: &[u8], endings: &[&str]) -> Result<String, Refusal> {
        let path = Path::new(name);
        let ending = path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
        let stem = path.file_stem().and_then(OsStr::to_str).unwrap_or_default();
        let refused = |must: &str| {
            let begin: String = name.chars().take(60).collect();
            let rest = if begin.len() < name.len() { " …" } else { "" };
            Refusal::Bad(format!("the name is {begin:?}{rest}, must {must}"))
        };
        let Some(ending) = ending.filter(|ending| endings.contains(&&**ending)) else {
            return Err(refused(&format!("end in .{}", endings.join(", ."))));
        };
        if !is_alone(name) {
            return Err(refused(&format!(
                "be that of a file without its folder, not hidden, of at most {MAX_NAME} bytes"
            )));
        }
        let numbered = (2..=MAX_NAMESAKES).map(|number| format!("{stem}-{number}.{ending}"));
        for name in std::iter::once(name.to_owned()).chain(numbered) {
            let path = self.folder.join(&name);
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(mut file) => {
                    let written = file.write_all(bytes);
                    return written.map(|()| name).map_err(|error| {
                        // What is written in part is of no use; the error has the reason.
                        let _ = fs::remove_file(&path);
                        Refusal::Bad(format!("the file cannot be written: {error}"))
                    });
                }
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => return Err(Refusal::Bad(format!("the file cannot be written: {error}"))),
            }
        }
        Err(Refusal::Conflict(format!("{name} exists already, and {MAX_NAMESAKES} others of its name")))
    }

    /// Takes back a file that was put here and that nothing uses.
    pub(super) fn take_back(&self, name: &str) {
        // It is in nobody's way if it stays.
        let _ = fs::remove_file(self.folder.join(name));
    }

    /// The same text with its files by their whole paths, so that another folder may hold it.
    pub(super) fn with_whole_paths(&self, text: &str) -> String {
        let Ok(mut document) = text.parse::<DocumentMut>() else { return text.to_owned() };
        let whole = |table: &mut dyn TableLike| {
            for (name, key) in FILE_KEYS {
                let table = table.get_mut(name).and_then(Item::as_table_like_mut);
                let Some(Item::Value(value)) = table.and_then(|table| table.get_mut(key)) else { continue };
                if let Some(path) = value.as_str().and_then(|file| self.folder.join(file).to_str().map(str::to_owned)) {
                    *value = path.into();
                }
            }
        };
        whole(document.as_table_mut());
        match document.get_mut("dragons") {
            Some(Item::ArrayOfTables(tables)) => tables.iter_mut().for_each(|table| whole(table)),
            Some(Item::Value(Value::Array(values))) => {
                values.iter_mut().filter_map(Value::as_inline_table_mut).for_each(|table| whole(table));
            }
            _ => {}
        }
        document.to_string()
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
                "the name is {name:?}, must be such as \"street.toml\", in the same folder, of at most {MAX_NAME} bytes"
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
    is_alone(name) && Path::new(name).extension() == Some(OsStr::new("toml"))
}

/// Whether a name is that of a file in the folder itself, and not hidden.
fn is_alone(name: &str) -> bool {
    let is_alone = Path::new(name).file_name() == Some(OsStr::new(name)) && !name.contains(['/', '\\', '\0']);
    is_alone && !name.starts_with('.') && name.len() <= MAX_NAME
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
    fn a_file_is_put_only_in_the_folder_and_never_over_another_one() {
        let (outer, folder) = folder();
        for name in ["../b.svg", "/tmp/b.svg", ".b.svg", "b", "b.toml", "b.sh", "", "c/b.svg"] {
            assert!(matches!(folder.put(name, b"x", &["svg"]), Err(Refusal::Bad(_))), "{name}");
        }
        let long = format!("{}.svg", "a".repeat(200));
        for (name, reason) in
            [("b.sh", "must end in .svg"), ("../b.svg", "without its folder"), (&*long, "at most 100 bytes")]
        {
            assert!(
                matches!(folder.put(name, b"x", &["svg"]), Err(Refusal::Bad(words)) if words.contains(reason)),
                "{name}"
            );
        }
        std::os::unix::fs::symlink(outer.path().join("new.svg"), outer.path().join("plans/b.svg")).expect("a link");
        assert_eq!(folder.put("b.svg", b"one", &["svg"]), Ok("b-2.svg".to_owned()));
        assert_eq!(folder.put("b.svg", b"two", &["svg"]), Ok("b-3.svg".to_owned()));
        assert!(!outer.path().join("new.svg").exists(), "a link is not followed");
        assert_eq!(fs::read(outer.path().join("plans/b-2.svg")).expect("the file"), b"one");
        folder.take_back("b-2.svg");
        assert!(!outer.path().join("plans/b-2.svg").exists());
    }

    #[test]
    fn a_large_text_and_a_text_with_files_are_known_again_and_where_a_drawing_lies_does_not_matter() {
        let (_outer, folder) = folder();
        assert_eq!(folder.load("[dragon]\nbenches = 5\n"), None);
        assert!(folder.load("[dragon]\nbenches = 50_000\n").is_some());
        assert!(folder.load(&"#".repeat(LARGE_TEXT + 1)).is_some());
        let drawing = |rest: &str| folder.load(&format!("[route]\nkind = \"drawing\"\nfile = \"a.svg\"\n{rest}"));
        assert!(drawing("").is_some());
        assert_eq!(drawing(""), drawing("start_x_m = 5\n"));
        assert_ne!(drawing(""), drawing("tolerance_m = 0.1\n"));
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
