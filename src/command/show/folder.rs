//! The folder of a show's files.

use std::fs::{self, File, TryLockError};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use bench_dragon::config::Config;

use crate::command::BadInput;
use crate::command::record::repair_around;

/// How the name of a show's folder begins that was not given one.
const FOLDER_PREFIX: &str = "show-";

/// Finishes what killed shows left in the current folder. The show's own folder is its recorder's affair.
pub(super) fn repair_earlier_shows() {
    let Ok(entries) = fs::read_dir(".") else { return };
    for folder in entries.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()) {
        if folder.file_name().is_some_and(|name| name.to_string_lossy().starts_with(FOLDER_PREFIX)) {
            repair_around(&folder.join("recording.mcap"));
        }
    }
}

/// The folder of the show's files: made where it is missing.
pub(super) fn make_folder(out: Option<&Path>) -> anyhow::Result<PathBuf> {
    let folder = out.map_or_else(
        || PathBuf::from(format!("{FOLDER_PREFIX}{}", jiff::Zoned::now().strftime("%Y%m%d-%H%M%S"))),
        Path::to_owned,
    );
    fs::create_dir_all(&folder).map_err(|error| {
        BadInput(format!("--out is {}, must be a folder that can be made: {error}", folder.display()))
    })?;
    Ok(folder)
}

/// Writes the configuration that the server reads, also after a restart, and locks it for as long as the result is held:
/// a second show in the same folder is refused.
pub(super) fn write_config(folder: &Path, config: &Config) -> anyhow::Result<File> {
    let path = folder.join("config.toml");
    let cannot_write = || format!("cannot write {}", path.display());
    let mut file = File::options().write(true).create(true).truncate(false).open(&path).with_context(cannot_write)?;
    if let Err(TryLockError::WouldBlock) = file.try_lock() {
        return Err(BadInput(format!("--out is {}, which another show is using", folder.display())).into());
    }
    file.set_len(0).and_then(|()| file.write_all(config.to_toml().as_bytes())).with_context(cannot_write)?;
    Ok(file)
}

/// Removes the folder of a show that never began, unless there is more in it than its configuration.
pub(super) fn remove_unused(folder: &Path) {
    // What keeps it there is no fault of the show's, whose own is told.
    let _ = fs::remove_file(folder.join("config.toml"));
    let _ = fs::remove_dir(folder);
}

/// A name for a recording that is not taken: `recording.mcap`, `recording-2.mcap` and so on.
pub(super) fn free_recording(folder: &Path) -> PathBuf {
    let name = |number: u32| match number {
        1 => folder.join("recording.mcap"),
        number => folder.join(format!("recording-{number}.mcap")),
    };
    (1..=u32::MAX).map(name).find(|path| !path.exists()).expect("a folder holds fewer files than that")
}
