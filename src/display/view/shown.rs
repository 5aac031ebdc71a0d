//! A scene as it is handed to all streams: encoded once, and only if somebody looks.

use std::sync::{Arc, OnceLock};

use axum::body::Bytes;

use super::wire::encode_frame;
use crate::display::observe::Scene;

/// A scene and its number.
#[derive(Debug, Default)]
pub(super) struct Shown {
    /// Grows from scene to scene; from the largest it goes on at 0.
    pub(super) sequence: u32,
    pub(super) scene: Scene,
    frame: OnceLock<Bytes>,
}

impl Shown {
    pub(super) fn new(sequence: u32, scene: Scene) -> Arc<Self> {
        Arc::new(Self { sequence, scene, frame: OnceLock::new() })
    }

    /// The scene's frame as a message, where there is one.
    pub(super) fn frame(&self) -> Option<Bytes> {
        let still = self.scene.frame.as_ref()?;
        let encode = || encode_frame(self.sequence, still, self.scene.nearest).into();
        Some(self.frame.get_or_init(encode).clone())
    }
}
