//! Sixteen readers that come and go.

use crate::program::Program;

const READERS: usize = 16;

/// Sixteen readers, each followed by another one when it has gone.
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

    /// Lets one come for each that has gone.
    pub(crate) fn refill(&mut self) {
        self.readers.retain_mut(|reader| !reader.has_ended());
        if self.readers.len() < READERS {
            self.readers.push(Program::read_a_while(self.server));
            self.came += 1;
        }
    }

    /// Readers that have come so far.
    pub(crate) fn came(&self) -> usize {
        self.came
    }
}
