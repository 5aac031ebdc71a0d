//! Source of timecode in text form: protocol, address and port.

use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::str::FromStr;

use bench_dragon_ipc::TimecodeKind;
use rosc::address::verify_address;

use super::{FrameRate, Malformed, Position, art_net, osc};

/// Address of the OSC messages if the text contains none.
const DEFAULT_ADDRESS: &str = "/timecode";
/// The allowed forms, for error messages.
const FORMS: &str =
    "must be osc:[ADDRESS:]PORT[/MESSAGE], MESSAGE without blanks and #*,?[]{}, or artnet[:ADDRESS[:PORT]]";
/// Address to listen on if the text contains none: accepts packets of this machine only.
const LOOPBACK: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);

/// Protocol and address to listen on: `osc:[ADDRESS:]PORT[/MESSAGE]` or `artnet[:ADDRESS[:PORT]]`.
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
pub struct TimecodeSource {
    /// Address to listen on.
    pub listen: SocketAddr,
    /// Address of the OSC messages; `None` for Art-Net.
    osc_address: Option<String>,
}

impl TimecodeSource {
    /// Returns the same source at another address.
    #[must_use]
    pub fn at(self, listen: SocketAddr) -> Self {
        Self { listen, ..self }
    }

    /// Returns the position in a packet; `None` for a packet of other content. `rate` applies to OSC frames without a
    /// rate.
    ///
    /// # Errors
    /// [`Malformed`] for a packet that should contain a timecode and does not.
    pub fn position(&self, packet: &[u8], rate: FrameRate) -> Result<Option<Position>, Malformed> {
        match &self.osc_address {
            Some(address) => osc::position(packet, address, rate),
            None => art_net::position(packet),
        }
    }

    /// Protocol of the timecode, for the status.
    pub fn kind(&self) -> TimecodeKind {
        if self.osc_address.is_some() { TimecodeKind::Osc } else { TimecodeKind::ArtNet }
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
            listen.filter(|_| is_address).map(|listen| Self { listen, osc_address: Some(address.to_owned()) })
        } else {
            let rest = text.strip_prefix("artnet").ok_or_else(forms)?;
            let listen = match rest.strip_prefix(':') {
                None => rest.is_empty().then(|| SocketAddr::new(LOOPBACK, art_net::PORT)),
                Some(rest) => {
                    let address = || Some(SocketAddr::new(rest.parse().ok()?, art_net::PORT));
                    rest.parse().ok().or_else(address)
                }
            };
            listen.map(|listen| Self { listen, osc_address: None })
        };
        source.ok_or_else(forms)
    }
}

impl fmt::Display for TimecodeSource {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.osc_address {
            Some(address) => write!(formatter, "osc:{}{address}", self.listen),
            None => write!(formatter, "artnet:{}", self.listen),
        }
    }
}
