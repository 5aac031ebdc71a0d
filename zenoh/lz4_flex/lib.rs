//! zenoh 1.10 requires `lz4_flex` 0.10, in which decompression can disclose memory (RUSTSEC-2026-0041) and which gets no fix. This crate
//! takes its place with the same functions of a fixed version.

/// The block format, the only one that zenoh uses.
pub mod block {
    pub use published::block::{compress_into, decompress_into, get_maximum_output_size};
}
