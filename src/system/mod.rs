//! The operating system: clocks, processors, signals, limits, whole files.

pub mod clock;
pub(crate) mod limits;
pub mod processors;
pub mod stop;
pub mod whole_file;
