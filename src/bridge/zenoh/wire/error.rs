//! Why a payload is not taken.

/// What is wrong with a payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// It is not as long as its kind is, or as its header says.
    #[error("{got} bytes where {expected} are expected")]
    Length {
        /// Bytes that have come.
        got: usize,
        /// Bytes that are right; the least number where several are.
        expected: usize,
    },
    /// A dragon has at least one bench and not more than a configuration may have.
    #[error("a dragon of {0} benches")]
    BenchCount(u32),
    /// A number of a run is under 2^53.
    #[error("run {0}, which no source has")]
    RunId(u64),
    /// A number of a state or kind that this version does not know.
    #[error("{0} is no number of a state or kind")]
    Unknown(u32),
    /// A place, a speed or a clearance that is no number.
    #[error("a value that is not finite")]
    NotFinite,
    /// Two benches are named, the lower one first, or none.
    #[error("benches {0} and {1} are no pair")]
    Pair(u32, u32),
    /// A text that is none, or a step between frames or a rate that no source has.
    #[error("a description that is none")]
    Description,
}
