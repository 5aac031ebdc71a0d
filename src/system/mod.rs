//! The operating system: clocks, processors, signals, limits, the machine, input files, whole files.

pub mod clock;
pub(crate) mod input_file;
pub(crate) mod limits;
pub(crate) mod machine;
pub mod processors;
pub mod stop;
pub mod unix_offset;
pub mod whole_file;
