//! The names by which this machine may be called.

use std::net::{IpAddr, SocketAddr};

/// Hosts that a request may name, without their port: one may come through a tunnel.
///
/// ```
/// use bench_dragon::display::web::Hosts;
///
/// let hosts = Hosts::new("127.0.0.1:8223".parse().unwrap(), Some("booth"), &["dragon.example".to_owned()]);
/// assert!(hosts.allow("127.0.0.1:8223") && hosts.allow("localhost:9000") && hosts.allow("[::1]:8223"));
/// assert!(hosts.allow("Dragon.Example"));
/// assert!(!hosts.allow("evil.example:8223") && !hosts.allow("10.0.0.5:8223") && !hosts.allow("booth:8223"));
/// ```
#[derive(Clone, Debug)]
pub struct Hosts {
    /// Lower-case.
    names: Vec<String>,
    is_loopback: bool,
}

impl Hosts {
    /// The hosts of a site that listens at an address: by name `localhost` and those that were allowed; on loopback its
    /// addresses, elsewhere every address, which no name service can bend, and the machine's own name.
    pub fn new(address: SocketAddr, machine: Option<&str>, allowed: &[String]) -> Self {
        let is_loopback = address.ip().is_loopback();
        let mut names = vec!["localhost".to_owned()];
        names.extend(allowed.iter().map(|name| name.to_ascii_lowercase()));
        if let Some(machine) = machine.filter(|_| !is_loopback) {
            let machine = machine.to_ascii_lowercase();
            names.extend([format!("{machine}.local"), machine]);
        }
        Self { names, is_loopback }
    }

    /// Whether a host, with or without a port, is this site.
    pub fn allow(&self, host: &str) -> bool {
        let Some(name) = without_port(host) else { return false };
        match name.parse::<IpAddr>() {
            Ok(address) => !self.is_loopback || address.is_loopback(),
            Err(_) => self.names.iter().any(|known| known.eq_ignore_ascii_case(name)),
        }
    }
}

/// The host without its port, an IPv6 address without its brackets.
fn without_port(host: &str) -> Option<&str> {
    let (name, port) = match host.strip_prefix('[') {
        Some(rest) => {
            let (address, port) = rest.split_once(']')?;
            (address, port.strip_prefix(':').or(port.is_empty().then_some("0"))?)
        }
        None => host.split_once(':').unwrap_or((host, "0")),
    };
    (!name.is_empty() && port.parse::<u16>().is_ok()).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn off_loopback_every_address_and_the_own_name_are_this_site_but_no_other_name_is() {
        let hosts = Hosts::new("0.0.0.0:8223".parse().expect("an address"), Some("Booth"), &[]);
        for host in ["10.0.0.5:8223", "[fe80::1]:8223", "booth", "BOOTH.local:8223", "localhost"] {
            assert!(hosts.allow(host), "{host}");
        }
        for host in ["evil.example", "booth.evil.example:8223", "10.0.0.5.evil.example", "0x7f000001"] {
            assert!(!hosts.allow(host), "{host}");
        }
    }

    #[test]
    fn what_is_no_host_is_refused() {
        let hosts = Hosts::new("127.0.0.1:8223".parse().expect("an address"), None, &[]);
        for host in [
            "",
            ":8223",
            "localhost:",
            "localhost:x",
            "localhost:99999",
            "[::1",
            "[::1]x",
            "user@localhost",
            "localhost/",
        ] {
            assert!(!hosts.allow(host), "{host}");
        }
    }
}
