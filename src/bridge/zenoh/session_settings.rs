//! Settings of a zenoh session. Listening and discovery are off unless the user enables them.
//!
//! By default zenoh listens on every interface and searches for peers by multicast. Here a session does neither, unless the
//! configuration file or the flags specify it. Without any endpoint, a sending bridge listens on loopback, and a receiving
//! bridge connects there.

use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::{Value, json};
use zenoh::config::EndPoint;

use super::session::{BridgeError, one_line};

/// Endpoint of a sending bridge if no file and no flag specifies one. A receiving bridge connects to it.
pub const DEFAULT_ENDPOINT: &str = "tcp/127.0.0.1:7447";

const NO_ENDPOINT: &str =
    "a client needs an endpoint to connect to: set --connect ENDPOINT, or connect.endpoints in the configuration file";
/// Longest configuration file in bytes.
const MAX_CONFIG_BYTES: u64 = 1 << 20;

/// Role of a session in the zenoh network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SessionMode {
    /// Connects to other sessions directly.
    Peer,
    /// Connects to one router or one peer, and reaches all others through it.
    Client,
    /// Connects to others, and also forwards messages between them.
    Router,
}

/// Direction of a bridge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// On the host of the source.
    Sending,
    /// On the host that receives the source's frames.
    Receiving,
}

/// Settings of a session.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SessionSettings {
    /// zenoh's own configuration file, JSON5.
    pub config: Option<PathBuf>,
    /// Overrides the mode in the file.
    pub mode: Option<SessionMode>,
    /// Endpoints to connect to. If there are any, they replace the file's.
    pub connect: Vec<String>,
    /// Endpoints to listen on. If there are any, they replace the file's.
    pub listen: Vec<String>,
}

impl SessionSettings {
    /// Returns the whole configuration: the defaults, overlaid by the file, overlaid by the flags.
    pub(super) fn document(&self, side: Side) -> Result<Value, BridgeError> {
        let mut document = defaults();
        if let Some(path) = &self.config {
            overlay(&mut document, read(path)?);
        }
        if let Some(mode) = self.mode {
            document["mode"] = json!(mode);
        }
        for (kind, endpoints) in [("connect", &self.connect), ("listen", &self.listen)] {
            if !endpoints.is_empty() {
                overlay(&mut document, json!({ kind: { "endpoints": endpoints } }));
            }
        }
        self.add_default_endpoint(&mut document, side)?;
        Ok(document)
    }

    /// Adds the default endpoint if neither a file nor an endpoint is given. A client without an endpoint to connect to is an
    /// error.
    fn add_default_endpoint(&self, document: &mut Value, side: Side) -> Result<(), BridgeError> {
        let is_given = self.config.is_some() || !self.connect.is_empty() || !self.listen.is_empty();
        let is_client = document["mode"] == "client";
        let scouts = document["scouting"]["multicast"]["enabled"] == true;
        if is_client && !scouts && endpoints(document, "connect").is_empty() && (is_given || side == Side::Sending) {
            return Err(BridgeError::Settings(NO_ENDPOINT.to_owned()));
        }
        if !is_given {
            let kind = if side == Side::Sending { "listen" } else { "connect" };
            overlay(document, json!({ kind: { "endpoints": [DEFAULT_ENDPOINT] } }));
        }
        Ok(())
    }
}

/// Returns an endpoint unchanged if it is a TCP or TLS endpoint with a port.
///
/// # Errors
/// A text that shows the form of an endpoint.
pub fn check_endpoint(text: &str) -> Result<String, String> {
    let address = ["tcp/", "tls/"].iter().find_map(|link| text.strip_prefix(link));
    let has_port = |address: &str| address.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok());
    let is_link = text.parse::<EndPoint>().is_ok() && address.is_some_and(has_port);
    if is_link {
        Ok(text.to_owned())
    } else {
        Err("must be an endpoint such as tcp/10.0.0.5:7447 or tls/stage.example:7447".to_owned())
    }
}

/// Returns the defaults: no listening and no discovery. Connections are retried without a limit. zenoh's shared memory is off,
/// because our own bus provides shared memory.
fn defaults() -> Value {
    json!({
        "mode": "peer",
        "connect": { "endpoints": [], "timeout_ms": -1, "exit_on_failure": false },
        "listen": { "endpoints": [] },
        "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
        "transport": {
            "shared_memory": { "enabled": false },
            // Batches of 64 KiB each, about a hundred frames of the paper's dragon. zenoh's default of two batches is full as
            // soon as a busy processor delays zenoh by a dozen milliseconds.
            "link": { "tx": { "queue": { "size": { "data": 16 } } } },
        },
    })
}

fn read(path: &Path) -> Result<Value, BridgeError> {
    let failed = |error| BridgeError::Settings(format!("cannot read {}: {error}", path.display()));
    let mut text = String::new();
    fs::File::open(path).map_err(failed)?.take(MAX_CONFIG_BYTES).read_to_string(&mut text).map_err(failed)?;
    let document: Result<Value, String> = json5::from_str(&text).map_err(one_line);
    match document {
        Ok(document) if document.is_object() => Ok(document),
        Ok(_) => Err(BridgeError::file(path, "must be an object with keys")),
        Err(reason) => Err(BridgeError::file(path, reason)),
    }
}

/// Overlays one document with another, key by key. A null changes nothing.
fn overlay(under: &mut Value, over: Value) {
    match (under, over) {
        (_, Value::Null) => {}
        (Value::Object(under), Value::Object(over)) => {
            for (key, value) in over {
                overlay(under.entry(key).or_insert(Value::Null), value);
            }
        }
        (under, over) => *under = over,
    }
}

/// Returns all endpoints of one kind, in any of the forms that zenoh accepts.
pub(super) fn endpoints(document: &Value, kind: &str) -> Vec<String> {
    fn collect(value: &Value, into: &mut Vec<String>) {
        match value {
            Value::String(endpoint) => into.push(endpoint.clone()),
            Value::Array(values) => values.iter().for_each(|value| collect(value, into)),
            Value::Object(values) => values.values().for_each(|value| collect(value, into)),
            _ => {}
        }
    }
    let mut found = Vec::new();
    collect(&document[kind]["endpoints"], &mut found);
    found
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::*;

    fn with(text: &str) -> (tempfile::NamedTempFile, SessionSettings) {
        let mut file = tempfile::NamedTempFile::new().expect("a file");
        file.write_all(text.as_bytes()).expect("a file");
        let settings = SessionSettings { config: Some(file.path().to_owned()), ..SessionSettings::default() };
        (file, settings)
    }

    #[test]
    fn listening_and_discovery_are_off_by_default() {
        for side in [Side::Sending, Side::Receiving] {
            let document = SessionSettings::default().document(side).expect("empty settings are valid");
            assert_eq!(document["scouting"]["multicast"]["enabled"], false);
            assert_eq!(document["scouting"]["gossip"]["enabled"], false);
            let (listens, connects) = (endpoints(&document, "listen"), endpoints(&document, "connect"));
            let here = vec![DEFAULT_ENDPOINT.to_owned()];
            assert_eq!((listens, connects), if side == Side::Sending { (here, vec![]) } else { (vec![], here) });
        }
        let (_file, settings) = with("{ transport: { link: { tx: { lease: 5000 } } } }");
        let document = settings.document(Side::Sending).expect("a configuration");
        assert_eq!(endpoints(&document, "listen"), Vec::<String>::new(), "a file without endpoints adds none");
        assert_eq!(document["scouting"]["multicast"]["enabled"], false);
        let (_file, settings) = with("{ scouting: null, listen: { endpoints: null } }");
        let document = settings.document(Side::Sending).expect("a configuration");
        assert_eq!(document["scouting"]["multicast"]["enabled"], false, "null enables nothing");
        assert_eq!(endpoints(&document, "listen"), Vec::<String>::new());
        assert!(document["listen"]["endpoints"].is_array());
    }

    #[test]
    fn a_file_overrides_the_defaults_and_flags_override_the_file() {
        let (_file, settings) = with(
            "{ mode: 'router', listen: { endpoints: { router: ['tcp/10.0.0.1:1'] } }, // a comment\n
               scouting: { multicast: { enabled: true } } }",
        );
        let document = settings.document(Side::Receiving).expect("a configuration");
        assert_eq!(document["mode"], "router");
        assert_eq!(endpoints(&document, "listen"), ["tcp/10.0.0.1:1"]);
        assert_eq!(document["scouting"]["multicast"]["enabled"], true);
        let flags =
            SessionSettings { mode: Some(SessionMode::Peer), listen: vec!["tcp/127.0.0.1:2".to_owned()], ..settings };
        let document = flags.document(Side::Receiving).expect("a configuration");
        assert_eq!(
            (&document["mode"], endpoints(&document, "listen")),
            (&json!("peer"), vec!["tcp/127.0.0.1:2".to_owned()])
        );
    }

    #[test]
    fn a_client_needs_an_endpoint() {
        let client = SessionSettings { mode: Some(SessionMode::Client), ..SessionSettings::default() };
        let lacks_endpoint =
            |document: Result<Value, BridgeError>| document.is_err_and(|error| error.to_string() == NO_ENDPOINT);
        assert!(lacks_endpoint(client.document(Side::Sending)));
        assert!(client.document(Side::Receiving).is_ok(), "a receiving client connects to loopback");
        let (_file, settings) = with("{ mode: 'client' }");
        assert!(lacks_endpoint(settings.document(Side::Receiving)));
    }
}
