//! zenoh 1.10 requires `lockfree` 0.5 for shared memory. That crate is unsound (RUSTSEC-2026-0284), as is its dependency `owned-alloc`
//! (RUSTSEC-2026-0291), and neither gets a fix. This crate takes its place with a queue of crossbeam.

/// The only type that zenoh uses.
pub mod queue {
    pub use crossbeam::queue::SegQueue as Queue;
}
