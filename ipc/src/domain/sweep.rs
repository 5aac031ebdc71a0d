//! Removes files without an owner. The caller holds the exclusive lock of the domain's members.

use std::fs::{self, DirEntry};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use super::domain_error::DomainError;
use super::lock_file::if_there;
use super::place::Domain;
use super::shortage::SHARED_MEMORY;
use super::show_lock::{GuardLock, ShowLock};
use super::source_lock::SourceLock;

/// Directories that iceoryx2 creates in a domain's root path.
const DIRECTORIES: [&str; 2] = ["nodes", "services"];

/// Removes all files of iceoryx2 from a domain without processes.
///
/// Files of other users in shared memory are kept, whatever their names. They do no harm, because the names there
/// cannot be guessed. Files there that cannot be removed are kept too. In the domain's own directory everything must be
/// removable.
pub(crate) fn sweep(domain: &Domain) -> Result<(), DomainError> {
    for entry in named_as_ours(Path::new(SHARED_MEMORY), domain)? {
        if foreign_owner(&entry.path(), domain).is_none() {
            let _ = remove(&entry);
        }
    }
    for entry in named_as_ours(domain.root(), domain)? {
        remove(&entry).map_err(|error| DomainError::Io { path: entry.path(), error })?;
    }
    for directory in DIRECTORIES {
        let path = domain.root().join(directory);
        if_there(fs::remove_dir_all(&path)).map_err(|error| DomainError::Io { path, error })?;
    }
    Ok(())
}

/// Removes the whole domain. The members' lock file is removed after everything that it protects.
pub(crate) fn dissolve(domain: &Domain, members_lock: &Path) -> Result<(), DomainError> {
    sweep(domain)?;
    let failed = |path: PathBuf| |error| DomainError::Io { path, error };
    let root = domain.root().to_owned();
    SourceLock::clear_abandoned(domain).map_err(failed(root.clone()))?;
    GuardLock::clear_abandoned(domain).map_err(failed(root.clone()))?;
    // The lock of a living supervisor stays, and with it the directory.
    ShowLock::clear_abandoned(domain).map_err(failed(root.clone()))?;
    // A process that fails before it has a node leaves before it writes the file.
    if_there(fs::remove_file(domain.iceoryx2_toml_path())).map_err(failed(domain.iceoryx2_toml_path()))?;
    fs::remove_file(members_lock).map_err(failed(members_lock.to_owned()))?;
    fs::remove_dir(&root).map_err(failed(root))
}

/// Returns the owner of a path, if it is another user than the domain's.
pub(crate) fn foreign_owner(path: &Path, domain: &Domain) -> Option<u32> {
    fs::symlink_metadata(path).ok().map(|metadata| metadata.uid()).filter(|&uid| uid != domain.uid())
}

/// Returns the entries of a folder whose names begin with the domain's prefix.
pub(crate) fn named_as_ours(folder: &Path, domain: &Domain) -> Result<Vec<DirEntry>, DomainError> {
    let prefix = domain.prefix();
    let entries: io::Result<Vec<DirEntry>> = fs::read_dir(folder).and_then(Iterator::collect);
    let mut entries = entries.map_err(|error| DomainError::Io { path: folder.to_owned(), error })?;
    entries.retain(|entry| entry.file_name().to_str().is_some_and(|name| name.starts_with(&prefix)));
    Ok(entries)
}

/// Removes a file, a link or a directory, if it exists. The target of a link is not touched.
fn remove(entry: &DirEntry) -> io::Result<()> {
    let is_directory = entry.file_type().is_ok_and(|kind| kind.is_dir());
    let path = entry.path();
    if_there(if is_directory { fs::remove_dir_all(path) } else { fs::remove_file(path) }).map(drop)
}
