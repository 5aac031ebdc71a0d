//! Sixteen readers that start and end.

use crate::program::Program;

const READERS: usize = 16;

/// Sixteen readers. When one ends, another one starts.
#[derive(Debug)]
pub(crate) struct Crowd<'a> {
    server: &'a Program,
    readers: Vec<Program>,
    came: usize,
}

impl<'a> Crowd<'a> {
    pub(crate) fn at(server: &'a Program) -> Self {
        Self { server, readers: Vec::new(), came: 0 }
    }

    /// Removes readers that have ended, and starts one reader if fewer than sixteen run.
    pub(crate) fn refill(&mut self) {
        self.readers.retain_mut(|reader| !reader.has_ended());
        if self.readers.len() < READERS {
            self.readers.push(Program::read_a_while(self.server));
            self.came += 1;
        }
    }

    /// Number of readers started so far.
    pub(crate) fn came(&self) -> usize {
        self.came
    }
}
