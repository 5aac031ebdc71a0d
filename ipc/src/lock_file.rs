//! Lock files: the kernel drops a lock with the process that holds it, however that ends.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::Path;

/// Opens the file at a path, making it where it is missing, and locks it with `lock`.
///
/// The holder of a lock may remove the file before it lets go, so after locking this makes sure that the file is still
/// the one at the path, and starts again where it is not.
pub(crate) fn lock_at<E: From<io::Error>>(path: &Path, lock: impl Fn(&mut File) -> Result<(), E>) -> Result<File, E> {
    loop {
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).mode(0o600).open(path)?;
        lock(&mut file)?;
        if is_at(&file, path)? {
            return Ok(file);
        }
    }
}

fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    match fs::metadata(path) {
        Ok(at_path) => Ok(at_path.ino() == file.metadata()?.ino()),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}
