//! The operating system: clocks, processors, signals, limits, input files, whole files.

pub mod clock;
pub(crate) mod input_file;
pub(crate) mod limits;
pub mod processors;
pub mod stop;
pub mod unix_offset;
pub mod whole_file;
