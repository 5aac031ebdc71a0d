//! The machine: clocks, processors, signals, limits, and checks of what stands in the way of a show.

pub mod clock;
pub mod doctor;
pub(crate) mod limits;
pub(crate) mod log;
pub mod processors;
pub mod stop;
pub mod whole_file;
