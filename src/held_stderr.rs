//! Stderr, which waits while something else is drawn on the terminal that it leads to.

use std::io::{self, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// So many bytes wait at most; what comes after them is left out.
const ROOM: usize = 64 * 1024;

/// What waits, while it is held back.
static WAITING: Mutex<Option<Vec<u8>>> = Mutex::new(None);

/// Holds back, from now on, what is written to [`HeldStderr`].
pub(crate) fn hold_back() {
    waiting().get_or_insert_default();
}

/// Writes what has waited, and holds nothing back any more.
pub(crate) fn let_go() {
    let lines = waiting().take().unwrap_or_default();
    // Where stderr is gone, there is nobody left to tell.
    let _ = io::stderr().lock().write_all(&lines);
}

/// Writes to stderr, or to what waits for it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HeldStderr;

impl Write for HeldStderr {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut waiting = waiting();
        match waiting.as_mut() {
            Some(lines) => {
                if lines.len() + bytes.len() <= ROOM {
                    lines.extend_from_slice(bytes);
                }
                Ok(bytes.len())
            }
            None => {
                drop(waiting);
                io::stderr().write(bytes)
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// A thread that panicked while it wrote has left whole bytes all the same.
fn waiting() -> MutexGuard<'static, Option<Vec<u8>>> {
    WAITING.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_held_back_waits_in_its_order_and_no_more_of_it_than_there_is_room_for() {
        hold_back();
        write!(HeldStderr, "one\ntwo\n").expect("memory takes it");
        hold_back();
        HeldStderr.write_all(&[b'x'; ROOM]).expect("what is too much is left out");
        HeldStderr.write_all(b"three\n").expect("memory takes it");
        assert_eq!(waiting().take().as_deref(), Some("one\ntwo\nthree\n".as_bytes()));
    }
}
