//! Chunks: a header of 32 bits and what it announces, which is bytes or further chunks.
//!
//! The header, little-endian: 16 bits of id, 15 of length, 1 that says that chunks follow.

/// Bytes of a chunk's header.
pub(super) const HEADER_LEN: usize = 4;

const MAX_CHUNK_LEN: usize = (1 << 15) - 1;
const HAS_CHUNKS: u32 = 1 << 31;

/// Appends chunks to a packet.
#[derive(Debug)]
pub(super) struct ChunkWriter<'a>(&'a mut Vec<u8>);

impl<'a> ChunkWriter<'a> {
    pub(super) fn new(packet: &'a mut Vec<u8>) -> Self {
        Self(packet)
    }

    /// A chunk of bytes.
    pub(super) fn leaf(&mut self, id: u16, data: &[u8]) {
        self.0.extend_from_slice(&header(id, data.len(), 0));
        self.0.extend_from_slice(data);
    }

    /// A chunk of three numbers.
    pub(super) fn vector(&mut self, id: u16, [x, y, z]: [f32; 3]) {
        self.0.extend_from_slice(&header(id, 12, 0));
        for value in [x, y, z] {
            self.0.extend_from_slice(&value.to_le_bytes());
        }
    }

    /// A chunk of the chunks that `write` appends.
    pub(super) fn branch(&mut self, id: u16, write: impl FnOnce(&mut ChunkWriter<'_>)) {
        let start = self.0.len();
        self.0.extend_from_slice(&[0; HEADER_LEN]);
        write(&mut ChunkWriter(self.0));
        let data_len = self.0.len() - start - HEADER_LEN;
        self.0[start..start + HEADER_LEN].copy_from_slice(&header(id, data_len, HAS_CHUNKS));
    }
}

fn header(id: u16, len: usize, has_chunks: u32) -> [u8; HEADER_LEN] {
    assert!(len <= MAX_CHUNK_LEN, "a packet is shorter than a chunk may be");
    (u32::from(id) | (len as u32) << 16 | has_chunks).to_le_bytes()
}
