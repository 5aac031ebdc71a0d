//! The check that a request names this machine, and comes from a page of this site or from no page.

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::header::{HOST, ORIGIN};
use axum::http::uri::Authority;
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode};
use axum::middleware::Next;
use axum::response::Response;

use super::access::take_token_of_query;
use super::site::refuse;

/// Hosts that a request may name. Ports are ignored, since a tunnel may change them.
///
/// ```
/// use bench_dragon::display::web::Hosts;
///
/// let hosts = Hosts::new("127.0.0.1:8223".parse().unwrap(), Some("booth"), &["dragon.example".to_owned()]);
/// assert!(hosts.allows("127.0.0.1:8223") && hosts.allows("localhost:9000") && hosts.allows("[::1]:8223"));
/// assert!(hosts.allows("Dragon.Example"));
/// assert!(!hosts.allows("evil.example:8223") && !hosts.allows("10.0.0.5:8223") && !hosts.allows("booth:8223"));
/// ```
#[derive(Clone, Debug)]
pub struct Hosts {
    /// Lower-case.
    names: Vec<String>,
    is_loopback: bool,
}

impl Hosts {
    /// Returns the hosts of a site that listens at an address. Allowed names are `localhost` and `allowed`. On loopback,
    /// loopback addresses are allowed too. Elsewhere, every address is allowed, since DNS cannot redirect an address, and the
    /// machine's name.
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

    /// Whether a host, with or without a port, names this site.
    pub fn allows(&self, host: &str) -> bool {
        let Some(name) = without_port(host) else { return false };
        match name.parse::<IpAddr>() {
            Ok(address) => !self.is_loopback || address.is_loopback(),
            Err(_) => self.names.iter().any(|known| known.eq_ignore_ascii_case(name)),
        }
    }
}

/// Returns the host without its port, and an IPv6 address without its brackets.
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

/// Security headers of every reply: no content from other sites, no embedding in a frame, no guessing of the media type.
const HEADERS: [(HeaderName, &str); 6] = [
    (
        HeaderName::from_static("content-security-policy"),
        "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; \
         manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    (HeaderName::from_static("x-content-type-options"), "nosniff"),
    (HeaderName::from_static("x-frame-options"), "DENY"),
    (HeaderName::from_static("referrer-policy"), "no-referrer"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
];
const FETCH_SITE: &str = "sec-fetch-site";
const FETCH_MODE: &str = "sec-fetch-mode";

/// The requests that a site admits.
#[derive(Clone, Debug)]
pub(super) struct Admission {
    pub(super) hosts: Hosts,
    /// Whether the router judges pages of other sites, and tokens in queries.
    pub(super) passes_foreign_pages: bool,
}

/// Marks a request of a page of another site, for a router that judges these.
#[derive(Clone, Copy, Debug)]
pub(in crate::display) struct ForeignPage;

/// Passes on a request that is allowed here, and refuses every other one.
pub(super) async fn admit(State(admission): State<Arc<Admission>>, mut request: Request, next: Next) -> Response {
    let Admission { hosts, passes_foreign_pages } = &*admission;
    if *passes_foreign_pages {
        take_token_of_query(&mut request);
    }
    let checked = check_host(hosts, &request).and_then(|host| match check_origin(host, &request) {
        Err(_) if *passes_foreign_pages => Ok(true),
        checked => checked.map(|()| false),
    });
    let mut response = match checked {
        Ok(is_foreign) => {
            if is_foreign {
                request.extensions_mut().insert(ForeignPage);
            }
            next.run(request).await
        }
        Err(reason) => refuse(StatusCode::FORBIDDEN, reason),
    };
    for (name, value) in HEADERS {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

/// Returns the host that a request names, if it is allowed.
fn check_host<'a>(hosts: &Hosts, request: &'a Request) -> Result<&'a str, &'static str> {
    let headers = request.headers();
    let host = only(headers, HOST.as_str()).ok_or("a request must have exactly one Host header")?;
    let named = request.uri().authority().map(Authority::as_str);
    if !hosts.allows(host) || named.is_some_and(|named| !named.eq_ignore_ascii_case(host)) {
        return Err("this Host is not allowed: use the machine's address, or start with --allow-host NAME");
    }
    Ok(host)
}

/// Refuses requests of pages of another site. `host` is the one that the request names.
fn check_origin(host: &str, request: &Request) -> Result<(), &'static str> {
    let headers = request.headers();
    if headers.contains_key(ORIGIN) {
        let origin = only(headers, ORIGIN.as_str()).ok_or("a request must have at most one Origin header")?;
        let from = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"));
        if !from.is_some_and(|from| from.eq_ignore_ascii_case(host)) {
            return Err("requests from pages of another origin are refused");
        }
    }
    let is_foreign = headers.get(FETCH_SITE).is_some_and(|site| site != "same-origin" && site != "none");
    // A link on another site may lead here.
    let is_visit = request.method() == Method::GET && headers.get(FETCH_MODE).is_some_and(|mode| mode == "navigate");
    if is_foreign && !is_visit {
        return Err("requests from pages of another site are refused");
    }
    Ok(())
}

/// Returns the value of a header as text, if the header occurs exactly once.
fn only<'a>(headers: &'a HeaderMap, name: &str) -> Option<&'a str> {
    let mut values = headers.get_all(name).iter();
    let value = values.next()?.to_str().ok()?;
    values.next().is_none().then_some(value)
}

#[cfg(test)]
mod tests {
    use axum::body::Body;

    use super::*;

    #[test]
    fn off_loopback_every_address_and_only_the_machines_own_names_are_allowed() {
        let hosts = Hosts::new("0.0.0.0:8223".parse().expect("an address"), Some("Booth"), &[]);
        for host in ["10.0.0.5:8223", "[fe80::1]:8223", "booth", "BOOTH.local:8223", "localhost"] {
            assert!(hosts.allows(host), "{host}");
        }
        for host in ["evil.example", "booth.evil.example:8223", "10.0.0.5.evil.example", "0x7f000001"] {
            assert!(!hosts.allows(host), "{host}");
        }
    }

    #[test]
    fn an_invalid_host_is_refused() {
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
            assert!(!hosts.allows(host), "{host}");
        }
    }

    fn outcome(headers: &[(&str, &str)]) -> Result<(), &'static str> {
        let hosts = Hosts::new("127.0.0.1:8223".parse().expect("an address"), None, &[]);
        let builder =
            headers.iter().fold(Request::builder().uri("/"), |builder, (name, value)| builder.header(*name, *value));
        let request = builder.body(Body::empty()).expect("a request");
        check_host(&hosts, &request).and_then(|host| check_origin(host, &request))
    }

    #[test]
    fn pages_of_this_site_and_programs_are_admitted() {
        let here = ("host", "localhost:8223");
        assert_eq!(outcome(&[here]), Ok(()));
        assert_eq!(outcome(&[here, ("origin", "http://localhost:8223"), ("sec-fetch-site", "same-origin")]), Ok(()));
        assert_eq!(outcome(&[here, ("sec-fetch-site", "none")]), Ok(()));
        assert_eq!(outcome(&[here, ("sec-fetch-site", "cross-site"), ("sec-fetch-mode", "navigate")]), Ok(()));
    }

    #[test]
    fn every_request_of_another_sites_page_is_refused() {
        let here = ("host", "localhost:8223");
        for foreign in [
            vec![("host", "evil.example")],
            vec![],
            vec![here, here],
            vec![here, ("origin", "http://evil.example")],
            vec![here, ("origin", "http://localhost:9999")],
            vec![here, ("origin", "null")],
            vec![here, ("origin", "http://localhost:8223"), ("origin", "http://evil.example")],
            vec![here, ("sec-fetch-site", "cross-site")],
            vec![here, ("sec-fetch-site", "same-site"), ("sec-fetch-mode", "no-cors")],
        ] {
            assert!(outcome(&foreign).is_err(), "{foreign:?}");
        }
    }
}
