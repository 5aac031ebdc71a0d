//! Open Sound Control: a message a bench, and one that says what they belong to.
//!
//! | address | arguments |
//! |---|---|
//! | `/dragon/show` | show time in seconds (f), state (s), time scale (f), tick (i), fresh (i: 1, or 0 where the server is silent) |
//! | `/dragon/bench/7` | x, y, z of the centre in metres, heading, speed in m/s of wall time (five f) |
//!
//! The show's message comes before the benches' of the same frame. The axes are the bus's own: x right, y away, z up; a
//! heading is counter-clockwise from +x, in degrees from −180 to 180 unless radians are asked for. The tick is its lowest 31
//! bits.
//!
//! A message is a packet of its own, which every receiver takes; or the messages go in bundles, as many in each as a
//! datagram holds, under the time at which the server sent the frame. Over TCP each packet is framed by SLIP with a double
//! END, as OSC 1.1 has it.
//!
//! Source: Open Sound Control 1.0 (2002) and 1.1 (2009), opensoundcontrol.org; SLIP: RFC 1055.

mod address;
mod bundle;
mod encoder;
mod slip;
mod slip_sender;

pub use address::{AddressError, AddressPattern, ShowAddress};
pub use encoder::{AngleUnit, OscEncoder, OscSettings};
pub use slip_sender::SlipSender;
