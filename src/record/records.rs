//! The records of an MCAP file in order, up to its end or to where it is damaged.

use std::{
    fmt,
    io::{self, Read},
};

use mcap::{
    McapError,
    records::Record,
    sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions},
};

/// A record or chunk that claims to be longer is taken for damage: ours are of about a megabyte.
const LONGEST_RECORD_BYTES: usize = 256 << 20;

/// How the records of a file end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    /// Behind the last record of the data.
    Whole,
    /// In the middle: the rest is missing, as a killed recorder leaves it.
    Cut,
    /// In the middle, and the file goes on: with something that cannot be read, and perhaps more that could.
    Damaged,
}

/// Reads records one by one; a chunk is checked as a whole before anything of it is given out.
///
/// Memory scales with the largest chunk, not with the file.
pub(super) struct Records<R> {
    source: R,
    reader: LinearReader,
    ending: Option<Ending>,
}

impl<R: Read> Records<R> {
    pub(super) fn new(source: R) -> Self {
        let options = LinearReaderOptions::default()
            .with_prevalidate_chunk_crcs(true)
            .with_skip_end_magic(true)
            .with_record_length_limit(LONGEST_RECORD_BYTES);
        Self { source, reader: LinearReader::new_with_options(options), ending: None }
    }

    /// How the file ended, once [`Records::next`] has returned `None`.
    pub(super) fn ending(&self) -> Option<Ending> {
        self.ending
    }

    /// The next record of the data, or `None` at its end; what follows the data (the summary) is not read.
    pub(super) fn next(&mut self) -> io::Result<Option<Record<'static>>> {
        if self.ending.is_some() {
            return Ok(None);
        }
        let record = self.read()?;
        self.ending = match record {
            Some(Record::DataEnd(_)) => Some(Ending::Whole),
            // Opcode 0 is no record: a file that lost its end in a power cut may go on with zeros.
            None | Some(Record::Unknown { opcode: 0, .. }) => Some(self.broken_ending()?),
            Some(_) => return Ok(record),
        };
        Ok(None)
    }

    fn broken_ending(&mut self) -> io::Result<Ending> {
        let goes_on = self.source.by_ref().take(1).read_to_end(&mut Vec::new())? > 0;
        Ok(if goes_on { Ending::Damaged } else { Ending::Cut })
    }

    /// `None` where the rest cannot be read.
    fn read(&mut self) -> io::Result<Option<Record<'static>>> {
        loop {
            match self.reader.next_event() {
                Some(Ok(LinearReadEvent::ReadRequest(bytes))) => {
                    let read = self.source.read(self.reader.insert(bytes));
                    match read {
                        Ok(bytes) => self.reader.notify_read(bytes),
                        Err(interrupted) if interrupted.kind() == io::ErrorKind::Interrupted => {}
                        Err(error) => return Err(error),
                    }
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    return Ok(mcap::parse_record(opcode, data).ok().map(Record::into_owned));
                }
                Some(Err(McapError::Io(error))) if error.raw_os_error().is_some() => return Err(error),
                Some(Err(_)) | None => return Ok(None),
            }
        }
    }
}

impl<R> fmt::Debug for Records<R> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Records").field("ending", &self.ending).finish_non_exhaustive()
    }
}
