//! Where timecode comes from, as people write it.

use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::str::FromStr;

use bench_dragon_ipc::TimecodeKind;
use rosc::address::verify_address;

use super::{FrameRate, Malformed, Position, art_net, osc};

/// Address of the OSC messages where no other is given.
const DEFAULT_ADDRESS: &str = "/timecode";
/// What is allowed.
const FORMS: &str =
    "must be osc:[ADDRESS:]PORT[/MESSAGE], MESSAGE without blanks and #*,?[]{}, or artnet[:ADDRESS[:PORT]]";
/// Who may send where nothing is given: this machine alone.
const LOOPBACK: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);

/// Where to listen, and for what: `osc:[ADDRESS:]PORT[/MESSAGE]` or `artnet[:ADDRESS[:PORT]]`.
///
/// ```
/// use bench_dragon::source::timecode::TimecodeSource;
///
/// let source: TimecodeSource = "osc:0.0.0.0:7000/frames/str".parse()?;
/// assert_eq!(source.to_string(), "osc:0.0.0.0:7000/frames/str");
/// let source: TimecodeSource = "artnet".parse()?;
/// assert_eq!(source.to_string(), "artnet:127.0.0.1:6454");
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TimecodeSource {
    /// OSC messages of an address, over UDP.
    Osc {
        /// Where to listen.
        listen: SocketAddr,
        /// Address of the messages.
        address: String,
    },
    /// Art-Net timecode packets.
    ArtNet {
        /// Where to listen.
        listen: SocketAddr,
    },
}

impl TimecodeSource {
    /// Where to listen.
    pub fn listen(&self) -> SocketAddr {
        match self {
            Self::Osc { listen, .. } | Self::ArtNet { listen } => *listen,
        }
    }

    /// The same source, listened for elsewhere.
    #[must_use]
    pub fn at(self, listen: SocketAddr) -> Self {
        match self {
            Self::Osc { address, .. } => Self::Osc { listen, address },
            Self::ArtNet { .. } => Self::ArtNet { listen },
        }
    }

    /// The position in a packet; `None` where it is about something else. Frames whose number a second a
    /// packet does not tell are of `rate`.
    ///
    /// # Errors
    /// [`Malformed`].
    pub fn position(&self, packet: &[u8], rate: FrameRate) -> Result<Option<Position>, Malformed> {
        match self {
            Self::Osc { address, .. } => osc::position(packet, address, rate),
            Self::ArtNet { .. } => art_net::position(packet),
        }
    }
}

impl FromStr for TimecodeSource {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let forms = || FORMS.to_owned();
        let source = if let Some(rest) = text.strip_prefix("osc:") {
            let (listen, address) = rest.split_at(rest.find('/').unwrap_or(rest.len()));
            let port = || Some(SocketAddr::new(LOOPBACK, listen.parse().ok()?));
            let listen = listen.parse().ok().or_else(port);
            let address = if address.is_empty() { DEFAULT_ADDRESS } else { address };
            let is_address = verify_address(address).is_ok();
            listen.filter(|_| is_address).map(|listen| Self::Osc { listen, address: address.to_owned() })
        } else {
            let rest = text.strip_prefix("artnet").ok_or_else(forms)?;
            let listen = match rest.strip_prefix(':') {
                None => rest.is_empty().then(|| SocketAddr::new(LOOPBACK, art_net::PORT)),
                Some(rest) => {
                    let address = || Some(SocketAddr::new(rest.parse().ok()?, art_net::PORT));
                    rest.parse().ok().or_else(address)
                }
            };
            listen.map(|listen| Self::ArtNet { listen })
        };
        source.ok_or_else(forms)
    }
}

impl TimecodeSource {
    /// The protocol, as the status reports it.
    pub fn kind(&self) -> TimecodeKind {
        match self {
            Self::Osc { .. } => TimecodeKind::Osc,
            Self::ArtNet { .. } => TimecodeKind::ArtNet,
        }
    }
}

impl fmt::Display for TimecodeSource {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Osc { listen, address } => write!(formatter, "osc:{listen}{address}"),
            Self::ArtNet { listen } => write!(formatter, "artnet:{listen}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_out_is_this_machine_and_the_usual_port() {
        for (text, whole) in [
            ("osc:7000", "osc:127.0.0.1:7000/timecode"),
            ("osc:0", "osc:127.0.0.1:0/timecode"),
            ("osc:10.0.0.2:7000/time", "osc:10.0.0.2:7000/time"),
            ("osc:[::1]:7000", "osc:[::1]:7000/timecode"),
            ("artnet", "artnet:127.0.0.1:6454"),
            ("artnet:2.0.0.10", "artnet:2.0.0.10:6454"),
            ("artnet:0.0.0.0:6455", "artnet:0.0.0.0:6455"),
        ] {
            assert_eq!(text.parse::<TimecodeSource>().expect(text).to_string(), whole);
        }
    }

    #[test]
    fn anything_else_is_refused() {
        let of_osc = ["osc", "osc:", "osc:70000", "osc:host:7000", "osc:7000/", "osc:7000/a b", "osc:7000/*"];
        let others = ["", "artnet:", "artnet6454", "artnet:x", "midi:1"];
        for text in of_osc.into_iter().chain(others) {
            assert_eq!(text.parse::<TimecodeSource>().expect_err(text), FORMS);
        }
    }
}
