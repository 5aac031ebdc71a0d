//! What a session of zenoh's is opened with: quiet unless it was asked to be heard.
//!
//! By default zenoh listens on every interface and looks for others by multicast. Here a session does neither: what is not in
//! the configuration file or in the flags is off. With no endpoint at all, a sending bridge listens on loopback, where a
//! receiving one looks for it.

use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::{Value, json};
use zenoh::config::EndPoint;

use super::session::{BridgeError, one_line};

/// Where a sending bridge listens, and a receiving one looks for it, unless the flags say otherwise.
pub const DEFAULT_ENDPOINT: &str = "tcp/127.0.0.1:7447";

const NOWHERE: &str =
    "a client needs somebody to connect to: --connect ENDPOINT, or connect.endpoints in the configuration";
/// Longest configuration file in bytes.
const MAX_CONFIG_BYTES: u64 = 1 << 20;

/// The part that a session plays among zenoh's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SessionMode {
    /// Talks to others directly.
    Peer,
    /// Has one router, or one peer, do so for it.
    Client,
    /// Hands on what others say as well.
    Router,
}

/// On which side of the way a bridge stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Where the source is.
    Sending,
    /// Where it is to be.
    Receiving,
}

/// What a session is opened with.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SessionSettings {
    /// zenoh's own configuration file, JSON5.
    pub config: Option<PathBuf>,
    /// Over what the file says of it.
    pub mode: Option<SessionMode>,
    /// Endpoints to connect to, instead of the file's where there are any.
    pub connect: Vec<String>,
    /// Endpoints to listen on, instead of the file's where there are any.
    pub listen: Vec<String>,
}

impl SessionSettings {
    /// The whole configuration: what is quiet, over it the file, over that the flags.
    pub(super) fn document(&self, side: Side) -> Result<Value, BridgeError> {
        let mut document = quiet();
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
        self.settle(&mut document, side)?;
        Ok(document)
    }

    /// Says where to go where nobody has.
    fn settle(&self, document: &mut Value, side: Side) -> Result<(), BridgeError> {
        let is_given = self.config.is_some() || !self.connect.is_empty() || !self.listen.is_empty();
        let is_client = document["mode"] == "client";
        let scouts = document["scouting"]["multicast"]["enabled"] == true;
        if is_client && !scouts && endpoints(document, "connect").is_empty() && (is_given || side == Side::Sending) {
            return Err(BridgeError::Settings(NOWHERE.to_owned()));
        }
        if !is_given {
            let kind = if side == Side::Sending { "listen" } else { "connect" };
            overlay(document, json!({ kind: { "endpoints": [DEFAULT_ENDPOINT] } }));
        }
        Ok(())
    }
}

/// Whether zenoh could make something of an endpoint.
///
/// # Errors
/// What an endpoint looks like.
pub fn check_endpoint(text: &str) -> Result<String, String> {
    let address = ["tcp/", "tls/"].iter().find_map(|link| text.strip_prefix(link));
    let has_port = |address: &str| address.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok());
    let is_link = text.parse::<EndPoint>().is_ok() && address.is_some_and(has_port);
    if is_link { Ok(text.to_owned()) } else { Err("must be as tcp/10.0.0.5:7447 or tls/stage.example:7447".to_owned()) }
}

/// Nothing listens, nobody is looked for, and whoever is away is tried again for as long as it takes. Shared memory is
/// what our own bus is for.
fn quiet() -> Value {
    json!({
        "mode": "peer",
        "connect": { "endpoints": [], "timeout_ms": -1, "exit_on_failure": false },
        "listen": { "endpoints": [] },
        "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
        "transport": {
            "shared_memory": { "enabled": false },
            // Of 64 KiB each, so some hundred frames of the paper's dragon: zenoh's two are full as soon as a processor that
            // has much else to do leaves it waiting for a dozen milliseconds.
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
        Ok(_) => Err(BridgeError::file(path, "it has no keys")),
        Err(reason) => Err(BridgeError::file(path, reason)),
    }
}

/// Puts what one document says over another, key by key; nothing is said by null.
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

/// All endpoints of one kind, of whichever of the forms that zenoh takes.
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
    fn what_nobody_asked_for_is_off() {
        for side in [Side::Sending, Side::Receiving] {
            let document = SessionSettings::default().document(side).expect("no settings are settings");
            assert_eq!(document["scouting"]["multicast"]["enabled"], false);
            assert_eq!(document["scouting"]["gossip"]["enabled"], false);
            let (listens, connects) = (endpoints(&document, "listen"), endpoints(&document, "connect"));
            let here = vec![DEFAULT_ENDPOINT.to_owned()];
            assert_eq!((listens, connects), if side == Side::Sending { (here, vec![]) } else { (vec![], here) });
        }
        let (_file, settings) = with("{ transport: { link: { tx: { lease: 5000 } } } }");
        let document = settings.document(Side::Sending).expect("a configuration");
        assert_eq!(endpoints(&document, "listen"), Vec::<String>::new(), "a file without endpoints asks for none");
        assert_eq!(document["scouting"]["multicast"]["enabled"], false);
        let (_file, settings) = with("{ scouting: null, listen: { endpoints: null } }");
        let document = settings.document(Side::Sending).expect("a configuration");
        assert_eq!(document["scouting"]["multicast"]["enabled"], false, "nothing is asked for by null");
        assert_eq!(endpoints(&document, "listen"), Vec::<String>::new());
        assert!(document["listen"]["endpoints"].is_array());
    }

    #[test]
    fn a_file_is_obeyed_and_flags_stand_over_it() {
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
        let is_nowhere =
            |document: Result<Value, BridgeError>| document.is_err_and(|error| error.to_string() == NOWHERE);
        assert!(is_nowhere(client.document(Side::Sending)));
        assert!(client.document(Side::Receiving).is_ok(), "it looks on loopback");
        let (_file, settings) = with("{ mode: 'client' }");
        assert!(is_nowhere(settings.document(Side::Receiving)));
    }
}
