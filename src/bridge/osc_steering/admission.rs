//! Who may steer: networks of addresses, and a secret.

use std::fmt;
use std::net::IpAddr;
use std::str::FromStr;

use subtle::ConstantTimeEq as _;

/// Networks from which commands are accepted. Without any, no address is allowed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AllowedNetworks(pub Vec<Network>);

/// A network: the addresses that share their first bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Network {
    address: IpAddr,
    prefix_bits: u8,
}

/// Error for a text that is not a network.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// The text has another form.
    #[error("must be an address or a network, such as 10.0.0.7, 10.0.0.0/24 or fd00::/8")]
    Form,
    /// The address has bits behind the prefix, so it is unclear whether a machine or a network is meant.
    #[error("must be {network} for the network, or {machine} for the machine")]
    Bits {
        /// The network of the address.
        network: Network,
        /// The address.
        machine: IpAddr,
    },
}

impl AllowedNetworks {
    /// Whether one of the networks contains an address. An IPv4 address in the form of IPv6 counts as IPv4.
    pub fn contain(&self, address: IpAddr) -> bool {
        let address = address.to_canonical();
        self.0.iter().any(|network| network.contains(address))
    }
}

impl fmt::Display for AllowedNetworks {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<String> = self.0.iter().map(Network::to_string).collect();
        formatter.write_str(&names.join(", "))
    }
}

impl Network {
    fn contains(self, address: IpAddr) -> bool {
        match (self.address, address) {
            (IpAddr::V4(network), IpAddr::V4(address)) => {
                (network.to_bits() ^ address.to_bits()).leading_zeros() >= u32::from(self.prefix_bits)
            }
            (IpAddr::V6(network), IpAddr::V6(address)) => {
                (network.to_bits() ^ address.to_bits()).leading_zeros() >= u32::from(self.prefix_bits)
            }
            _ => false,
        }
    }

    /// The address with all bits behind the prefix 0.
    fn first_address(self) -> IpAddr {
        let bits = u32::from(self.prefix_bits);
        match self.address {
            IpAddr::V4(address) => {
                IpAddr::V4((address.to_bits() & u32::MAX.checked_shl(32 - bits).unwrap_or(0)).into())
            }
            IpAddr::V6(address) => {
                IpAddr::V6((address.to_bits() & u128::MAX.checked_shl(128 - bits).unwrap_or(0)).into())
            }
        }
    }
}

impl FromStr for Network {
    type Err = NetworkError;

    /// ```
    /// use bench_dragon::bridge::osc_steering::AllowedNetworks;
    ///
    /// let allowed = AllowedNetworks(vec!["10.0.0.0/24".parse()?, "::1".parse()?]);
    /// assert!(allowed.contain([10, 0, 0, 7].into()) && !allowed.contain([10, 0, 1, 7].into()));
    /// # Ok::<(), bench_dragon::bridge::osc_steering::NetworkError>(())
    /// ```
    fn from_str(text: &str) -> Result<Self, NetworkError> {
        let (address, prefix) = text.split_once('/').map_or((text, None), |(address, prefix)| (address, Some(prefix)));
        let address: IpAddr = address.parse().map_err(|_| NetworkError::Form)?;
        let most_bits = if address.is_ipv4() { 32 } else { 128 };
        let is_number = |prefix: &str| prefix.bytes().all(|byte| byte.is_ascii_digit());
        let prefix_bits = match prefix {
            None => most_bits,
            Some(prefix) => {
                let bits = prefix.parse().ok().filter(|bits| *bits <= most_bits && is_number(prefix));
                bits.ok_or(NetworkError::Form)?
            }
        };
        // Addresses of packets are compared as IPv4, so this network would contain none.
        if address.to_canonical() != address {
            return Err(NetworkError::Form);
        }
        let network = Self { address, prefix_bits };
        let first = network.first_address();
        if first == address {
            Ok(network)
        } else {
            Err(NetworkError::Bits { network: Self { address: first, prefix_bits }, machine: address })
        }
    }
}

impl fmt::Display for Network {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let most_bits = if self.address.is_ipv4() { 32 } else { 128 };
        match self.prefix_bits {
            bits if bits == most_bits => self.address.fmt(formatter),
            bits => write!(formatter, "{}/{bits}", self.address),
        }
    }
}

/// Allowed lengths of a secret.
const LENGTHS: std::ops::RangeInclusive<usize> = 8..=64;

/// A text that each message has as its first argument.
#[derive(Clone)]
pub struct Secret(String);

/// Error for a text that is not a valid secret.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be {} to {} letters, digits, - and _", LENGTHS.start(), LENGTHS.end())]
pub struct SecretError;

impl Secret {
    /// Whether a text equals this secret. The comparison takes the same time for every text of the same length.
    pub(super) fn is(&self, shown: &str) -> bool {
        self.0.as_bytes().ct_eq(shown.as_bytes()).into()
    }
}

impl FromStr for Secret {
    type Err = SecretError;

    fn from_str(text: &str) -> Result<Self, SecretError> {
        // Desks separate arguments by blanks, commas and quotes.
        let is_plain = text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_');
        if is_plain && LENGTHS.contains(&text.len()) { Ok(Self(text.to_owned())) } else { Err(SecretError) }
    }
}

impl fmt::Debug for Secret {
    /// Omits the secret.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Secret")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn allowed(networks: &str) -> AllowedNetworks {
        AllowedNetworks(networks.split(',').map(|network| network.parse().expect("a network")).collect())
    }

    #[test]
    fn a_network_contains_the_addresses_with_its_prefix() {
        for (networks, inside, outside) in [
            ("10.0.0.0/24", "10.0.0.255", "10.0.1.0"),
            ("10.0.0.7", "10.0.0.7", "10.0.0.6"),
            ("10.0.0.8/31", "10.0.0.9", "10.0.0.10"),
            ("0.0.0.0/0", "203.0.113.9", "::1"),
            ("fd00::/8", "fdff::1", "fe00::1"),
            ("::/0", "2001:db8::1", "10.0.0.1"),
            ("::1", "::1", "::2"),
            ("127.0.0.1,10.9.0.0/16", "::ffff:10.9.1.2", "10.8.1.2"),
        ] {
            let allowed = allowed(networks);
            assert!(allowed.contain(inside.parse().expect("an address")), "{networks} and {inside}");
            assert!(!allowed.contain(outside.parse().expect("an address")), "{networks} and {outside}");
        }
        assert!(!AllowedNetworks::default().contain([127, 0, 0, 1].into()), "loopback is listed as any other address");
    }

    #[test]
    fn a_text_that_is_no_network_is_refused() {
        for bad in [
            "",
            "10.0.0",
            "10.0.0.0/33",
            "10.0.0.0/",
            "10.0.0.0/+8",
            "::/129",
            "house",
            "::ffff:10.0.0.1",
            "10.0.0.0/8/8",
        ] {
            assert_eq!(bad.parse::<Network>(), Err(NetworkError::Form), "{bad}");
        }
        assert_eq!(allowed("10.0.0.7,10.0.0.0/24,::1/128").to_string(), "10.0.0.7, 10.0.0.0/24, ::1");
        let unclear = "10.0.0.7/24".parse::<Network>().expect_err("bits behind the prefix");
        assert_eq!(unclear.to_string(), "must be 10.0.0.0/24 for the network, or 10.0.0.7 for the machine");
    }

    #[test]
    fn a_secret_equals_only_itself_and_is_never_shown() {
        let secret: Secret = "night-of-the_dragon".parse().expect("a secret");
        assert!(secret.is("night-of-the_dragon") && !secret.is("night-of-the_dragoN") && !secret.is(""));
        assert_eq!(format!("{secret:?}"), "Secret");
        for bad in ["", "1234567", "with a blank", "comma,comma", &"a".repeat(65)] {
            assert_eq!(bad.parse::<Secret>().map(|_| ()), Err(SecretError), "{bad}");
        }
    }
}
