//! Several files of a recording, read one behind the other.

use std::path::{Path, PathBuf};

use bench_dragon_ipc::FrameHeader;

use super::FlawedFile;
use crate::recording::{Configuration, Flaws, FrameReader, ReadError, Recorded};

/// What the files hold, in their order.
pub(super) struct Recordings<'a> {
    files: std::slice::Iter<'a, PathBuf>,
    reader: Option<(&'a Path, FrameReader)>,
    configuration: Option<Configuration>,
    /// Bytes of the files that were read to their ends.
    bytes_before: u64,
    flawed: Vec<FlawedFile>,
}

impl<'a> Recordings<'a> {
    pub(super) fn new(files: &'a [PathBuf]) -> Self {
        Self { files: files.iter(), reader: None, configuration: None, bytes_before: 0, flawed: Vec::new() }
    }

    /// As [`FrameReader::next_wanted`], over all files.
    pub(super) fn next(
        &mut self,
        mut is_wanted: impl FnMut(&FrameHeader) -> bool,
    ) -> Result<Option<Recorded>, ReadError> {
        loop {
            let (file, mut reader) = match self.reader.take() {
                Some(reading) => reading,
                None => match self.files.next() {
                    Some(file) => (file.as_path(), FrameReader::open(file)?),
                    None => return Ok(None),
                },
            };
            if let Some(recorded) = reader.next_wanted(&mut is_wanted)? {
                self.reader = Some((file, reader));
                return Ok(Some(recorded));
            }
            self.end_file(file, &reader);
        }
    }

    /// The configuration of the frame that was read last.
    pub(super) fn configuration(&self) -> Option<&Configuration> {
        self.reader.as_ref().and_then(|(_, reader)| reader.configuration()).or(self.configuration.as_ref())
    }

    /// Bytes read so far.
    pub(super) fn bytes_read(&self) -> u64 {
        self.bytes_before + self.reader.as_ref().map_or(0, |(_, reader)| reader.position())
    }

    /// The files that could not be read whole.
    pub(super) fn into_flawed(mut self) -> Vec<FlawedFile> {
        if let Some((file, reader)) = self.reader.take() {
            self.end_file(file, &reader);
        }
        self.flawed
    }

    fn end_file(&mut self, file: &Path, reader: &FrameReader) {
        let flaws = reader.flaws();
        if flaws != Flaws::default() {
            self.flawed.push(FlawedFile { file: file.to_owned(), flaws });
        }
        self.configuration = reader.configuration().cloned().or(self.configuration.take());
        self.bytes_before += std::fs::metadata(file).map_or(0, |metadata| metadata.len());
    }
}
