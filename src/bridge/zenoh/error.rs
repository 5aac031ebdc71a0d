//! Why a bridge could not go on.

use bench_dragon_ipc::BusError;

use super::link_error::LinkError;

/// Why a bridge could not go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BridgeError {
    /// The bus.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The way to other machines.
    #[error(transparent)]
    Link(#[from] LinkError),
}
