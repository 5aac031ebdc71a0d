//! A random number that only this user knows.
//!
//! Every user may create files in `/dev/shm`. A file of another user in the place of a segment would keep every node from
//! starting. iceoryx2 names all segments but one at random. The name of that one, the state of its unique numbers, would follow
//! from user and instance alone. So it contains this number.
//!
//! The number is in a file beside the directories of the instances, and stays there when the last process leaves: a stock
//! client's copy of the configuration remains true. A client with another number, or without one, finds the bus too. It then has
//! a state of its own, which is sound: the unique numbers of two processes differ by their process ids.
//!
//! Another user sees the number in `/dev/shm` while a show runs, and can occupy the name for later. So a process that finds the
//! name occupied takes a new number.

use std::fs::{self, OpenOptions};
use std::io::{self, ErrorKind, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;

use rustix::rand::{GetRandomFlags, getrandom};

/// Digits of a number, in base 16.
const DIGITS: usize = 32;

/// Returns the number in the file at a path; `None` where there is no complete one.
pub(crate) fn read(path: &Path) -> Option<String> {
    let text = fs::read_to_string(path).ok()?;
    let number = text.trim_end();
    let is_whole = number.len() == DIGITS && number.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_whole.then(|| number.to_owned())
}

/// Creates the file at a path with a new number, unless it has one. The file appears whole, and only its user may read it.
pub(crate) fn ensure(path: &Path) -> io::Result<()> {
    if read(path).is_some() {
        return Ok(());
    }
    create(path, put)
}

/// Replaces the number in the file at a path by a new one. A running process keeps the old one, which does no harm.
pub(crate) fn renew(path: &Path) -> io::Result<()> {
    create(path, |draft, path| fs::rename(draft, path))
}

fn create(path: &Path, put: fn(&Path, &Path) -> io::Result<()>) -> io::Result<()> {
    let number = random_number()?;
    let draft = path.with_extension(format!("{number}.draft"));
    let drafted = write(&draft, &number).and_then(|()| put(&draft, path));
    // After a rename there is no draft any more.
    match fs::remove_file(&draft) {
        Err(error) if error.kind() != ErrorKind::NotFound => drafted.and(Err(error)),
        _ => drafted,
    }
}

/// Gives the draft its name. A number that another process has put there meanwhile stays, a damaged file does not.
fn put(draft: &Path, path: &Path) -> io::Result<()> {
    match fs::hard_link(draft, path) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists && read(path).is_some() => Ok(()),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => fs::rename(draft, path),
        outcome => outcome,
    }
}

fn write(path: &Path, number: &str) -> io::Result<()> {
    let mut file = OpenOptions::new().write(true).create_new(true).mode(0o600).open(path)?;
    writeln!(file, "{number}")
}

fn random_number() -> io::Result<String> {
    let mut bytes = [0; DIGITS / 2];
    getrandom(&mut bytes, GetRandomFlags::empty())?;
    Ok(format!("{:0DIGITS$x}", u128::from_ne_bytes(bytes)))
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    #[test]
    fn a_number_stays_and_a_damaged_one_is_replaced() {
        let folder = std::env::temp_dir().join(format!("bd-secret-{}", std::process::id()));
        fs::create_dir(&folder).expect("a folder");
        let path = folder.join("secret");
        assert_eq!(read(&path), None);
        ensure(&path).expect("a file");
        let first = read(&path).expect("a number");
        ensure(&path).expect("a file");
        assert_eq!(read(&path).as_ref(), Some(&first));
        assert_eq!(fs::metadata(&path).expect("a file").permissions().mode() & 0o777, 0o600);
        fs::write(&path, &first[..7]).expect("a file");
        assert_eq!(read(&path), None);
        ensure(&path).expect("a file");
        let second = read(&path).expect("a number");
        assert_ne!(first, second);
        let names: Vec<_> = fs::read_dir(&folder).expect("a folder").flatten().map(|entry| entry.file_name()).collect();
        fs::remove_dir_all(&folder).expect("a folder");
        assert_eq!(names, ["secret"], "no draft remains");
    }
}
