//! A frame that a client has lent.

#![allow(unsafe_code, reason = "frames are lent across threads")]

use core::ptr::NonNull;
use std::sync::Arc;

use super::shared::Shared;
use crate::client::{Continuity, Frame};
use crate::wire::{BenchState, FrameHeader, HandleState};

/// A frame that a [`Show`](super::Show) has lent, in place in shared memory. Nothing in it changes while it is held. Any
/// thread may read and release it, also after the client and the server have ended.
#[derive(Debug)]
pub struct LentFrame {
    header: NonNull<FrameHeader>,
    handles: NonNull<[HandleState]>,
    continuity: Continuity,
    /// Slot in which the client keeps the sample while this frame exists.
    slot: usize,
    shared: Arc<Shared>,
}

// SAFETY: the pointers are to memory that nothing changes, and `Shared` may be used by any thread.
unsafe impl Send for LentFrame {}
// SAFETY: as above.
unsafe impl Sync for LentFrame {}

impl LentFrame {
    pub(super) fn of(frame: &Frame, slot: usize, shared: Arc<Shared>) -> Self {
        let (header, handles) = (NonNull::from(frame.header()), NonNull::from(frame.handles()));
        Self { header, handles, continuity: frame.continuity(), slot, shared }
    }

    /// Values of the frame that concern the whole show, and its dragons.
    pub fn header(&self) -> &FrameHeader {
        // SAFETY: the pointer is into the sample, which the client keeps until `self` is dropped.
        unsafe { self.header.as_ref() }
    }

    /// The handles, dragon after dragon, each head first; for each dragon one more than its benches.
    pub fn handles(&self) -> &[HandleState] {
        // SAFETY: as in `header`.
        unsafe { self.handles.as_ref() }
    }

    /// The benches, dragon after dragon, each head first, calculated from the handles.
    pub fn benches(&self) -> impl ExactSizeIterator<Item = BenchState> + '_ {
        self.header().benches(self.handles())
    }

    /// Relation of the frame to the previously received one.
    pub fn continuity(&self) -> Continuity {
        self.continuity
    }
}

impl Drop for LentFrame {
    fn drop(&mut self) {
        self.shared.take_back(self.slot);
    }
}
