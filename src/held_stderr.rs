//! Stderr, which waits while something else is drawn on the terminal that it leads to.

use std::io::{self, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// So many bytes wait at most; the lines that come after them are left out and counted.
const ROOM: usize = 64 * 1024;

/// What waits, while it is held back.
static WAITING: Mutex<Option<Waiting>> = Mutex::new(None);

#[derive(Debug, Default)]
struct Waiting {
    bytes: Vec<u8>,
    lines_left_out: usize,
}

/// Holds back, from now on, what is written to [`HeldStderr`].
pub(crate) fn hold_back() {
    waiting().get_or_insert_default();
}

/// Writes what has waited, and how much more there was, and holds nothing back any more.
pub(crate) fn let_go() {
    let lines = waiting().take().unwrap_or_default().told();
    // Where stderr is gone, there is nobody left to tell.
    let _ = io::stderr().lock().write_all(&lines);
}

impl Waiting {
    /// Takes what there is room for. Once something is left out, all that follows is: the lines are those of a time.
    fn push(&mut self, bytes: &[u8]) {
        if self.lines_left_out == 0 && self.bytes.len() + bytes.len() <= ROOM {
            self.bytes.extend_from_slice(bytes);
        } else {
            self.lines_left_out += bytes.split_inclusive(|byte| *byte == b'\n').count();
        }
    }

    fn told(mut self) -> Vec<u8> {
        match self.lines_left_out {
            0 => {}
            1 => self.bytes.extend_from_slice(b"1 more line was left out\n"),
            count => self.bytes.extend_from_slice(format!("{count} more lines were left out\n").as_bytes()),
        }
        self.bytes
    }
}

/// Writes to stderr, or to what waits for it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HeldStderr;

impl Write for HeldStderr {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut waiting = waiting();
        let Some(waiting) = waiting.as_mut() else {
            drop(waiting);
            return io::stderr().write(bytes);
        };
        waiting.push(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// A thread that panicked while it wrote has left whole bytes all the same.
fn waiting() -> MutexGuard<'static, Option<Waiting>> {
    WAITING.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_held_back_waits_in_its_order_and_what_there_is_no_room_for_is_counted() {
        hold_back();
        write!(HeldStderr, "one\ntwo\n").expect("memory takes it");
        hold_back();
        HeldStderr.write_all(&vec![b'x'; ROOM]).expect("what is too much is left out");
        HeldStderr.write_all(b"three\nfour\n").expect("what comes after it is left out as well");
        let told = waiting().take().expect("it is held back").told();
        assert_eq!(String::from_utf8_lossy(&told), "one\ntwo\n3 more lines were left out\n");
    }
}
