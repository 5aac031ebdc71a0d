//! What goes from the view to its page, and back: bytes and text, without sockets.
//!
//! To the page, binary: a frame ([`encode_frame`]). To the page, text: JSON with a `type` ([`RunMessage`], [`StatusMessage`],
//! [`AlertMessage`], [`PlanMessage`], [`CommandMessage`]). From the page: `{"ack":N}` for each frame, by its sequence number ([`read_ack`]).

mod ack;
mod alert;
mod command;
mod frame;
mod plan;
mod run;
mod status;

pub use ack::read_ack;
pub use alert::AlertMessage;
pub use command::CommandMessage;
pub use frame::{FRAME_HEADER_LEN, encode_frame};
pub use plan::PlanMessage;
pub use run::RunMessage;
pub use status::StatusMessage;
