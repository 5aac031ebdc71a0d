//! A Unix stream socket: one connection for each reader; each gets the whole frame. A slow reader makes the publisher wait.

use std::io::{ErrorKind, Read as _, Write as _};
use std::os::unix::net::{UnixListener, UnixStream};

use bench_dragon_ipc::{FrameHeader, HandleState};
use tempfile::TempDir;

use crate::arrival::Arrival;
use crate::frame_bytes::{self, Encoder, FRAME_BYTES};
use crate::publishing::{Sender, announce};
use crate::reading::Receiver;
use crate::setting::{Mode, Setting};

pub(crate) struct UnixSender {
    encoder: Encoder,
    bytes: Vec<u8>,
    readers: Vec<UnixStream>,
    _folder: TempDir,
}

impl UnixSender {
    /// Opens a socket and waits for all readers.
    pub(crate) fn open(setting: Setting) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("frames");
        let listener = UnixListener::bind(&path).expect("the folder belongs to this bench");
        announce(path.to_str().expect("temporary folders have plain names"));
        let accept = || listener.accept().expect("a reader connects").0;
        let readers = (0..setting.readers).map(|_| accept()).collect();
        Self { encoder: Encoder::new(), bytes: vec![0; FRAME_BYTES], readers, _folder: folder }
    }
}

impl Sender for UnixSender {
    fn send(&mut self, fill: impl FnOnce(&mut [HandleState]) -> FrameHeader) {
        self.encoder.encode(fill, &mut self.bytes);
        // Drops readers that have ended after their turn.
        self.readers.retain_mut(|reader| reader.write_all(&self.bytes).is_ok());
    }
}

pub(crate) struct UnixReceiver {
    stream: UnixStream,
    bytes: Vec<u8>,
    /// Bytes of the next frame that have been read.
    filled: usize,
}

impl UnixReceiver {
    pub(crate) fn open(setting: Setting, place: &str) -> Self {
        let stream = UnixStream::connect(place).expect("the publisher listens");
        stream.set_nonblocking(setting.mode == Mode::Polling).expect("the socket supports both modes");
        Self { stream, bytes: vec![0; FRAME_BYTES], filled: 0 }
    }
}

impl Receiver for UnixReceiver {
    fn receive(&mut self) -> Option<Arrival> {
        while self.filled < FRAME_BYTES {
            match self.stream.read(&mut self.bytes[self.filled..]) {
                Ok(0) => panic!("the publisher closed the connection"),
                Ok(length) => self.filled += length,
                Err(error) if error.kind() == ErrorKind::WouldBlock => return None,
                Err(error) => panic!("the socket failed: {error}"),
            }
        }
        self.filled = 0;
        Some(frame_bytes::read(&self.bytes))
    }
}
