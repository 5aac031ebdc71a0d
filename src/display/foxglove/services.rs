//! The services: one for each command, with its request and its response as JSON.

use axum::extract::ws::Message;
use bench_dragon_ipc::Request;
use serde_json::{Map, Value, json};

use super::messages::json_message;
use super::requests::ServiceCall;
use crate::command_queue::Outcome;
use crate::config::Cue;
use crate::display::view::{read_command, shown};

/// A value that a command needs: its key, and its type in JSON.
type Needs = Option<(&'static str, &'static str)>;

/// The commands. The number of a service is its place in this list.
const COMMANDS: [(&str, Needs); 10] = [
    ("hold", None),
    ("release", None),
    ("pause", None),
    ("resume", None),
    ("go", None),
    ("speed", Some(("value", "number"))),
    ("pace", Some(("value", "number"))),
    ("seek", Some(("value", "number"))),
    ("cue", Some(("name", "string"))),
    ("stop", None),
];

/// Encodes the list of services.
pub(super) fn advertise_services() -> Message {
    let services = COMMANDS.iter().enumerate().map(|(id, (name, needs))| {
        let properties = needs.map(|(key, kind)| (key.to_owned(), json!({ "type": kind })));
        let response = json!({
            "accepted": { "type": "boolean" },
            "tick": { "type": "integer" },
            "reason": { "type": "string" },
        });
        json!({
            "id": id,
            "name": format!("/dragon/{name}"),
            "type": format!("bench_dragon.{name}"),
            "request": form(&format!("bench_dragon.{name}.Request"), &Value::Object(properties.into_iter().collect())),
            "response": form("bench_dragon.Reply", &response),
        })
    });
    json_message(&json!({ "op": "advertiseServices", "services": services.collect::<Vec<_>>() }))
}

/// The form of a request or a response. Foxglove reads the schema as text.
fn form(name: &str, properties: &Value) -> Value {
    let schema = json!({ "type": "object", "title": name, "properties": properties });
    json!({ "encoding": "json", "schemaName": name, "schemaEncoding": "jsonschema", "schema": schema.to_string() })
}

/// Reads the command of a call, or returns the reason for which it is none. `cues` are those of the show.
pub(super) fn command_of(call: &ServiceCall<'_>, cues: &[Cue]) -> Result<Request, String> {
    let Some((name, needs)) = COMMANDS.get(call.service as usize) else {
        return Err(format!("there is no service with the number {}", call.service));
    };
    if call.encoding != b"json" {
        return Err(format!("the encoding is {:?}, must be json", String::from_utf8_lossy(call.encoding)));
    }
    let mut request: Map<String, Value> = serde_json::from_slice(call.request)
        .map_err(|error| format!("the request must be an object of JSON: {error}"))?;
    if !has_form(&request, needs) {
        let form = needs.map_or("{}".to_owned(), |(key, kind)| format!("{{{key:?}: {kind}}}"));
        return Err(format!("the request is {}, must be {form}", shown(call.request)));
    }
    request.insert("command".to_owned(), (*name).into());
    read_command(Value::Object(request).to_string().as_bytes(), cues)
}

/// Whether a request has what its command needs, and nothing else.
fn has_form(request: &Map<String, Value>, needs: &Needs) -> bool {
    let Some((key, kind)) = needs else { return request.is_empty() };
    let is_of_kind = |value: &Value| if *kind == "number" { value.is_number() } else { value.is_string() };
    request.len() == 1 && request.get(*key).is_some_and(is_of_kind)
}

/// The response to a command.
pub(super) fn response_to(request: Request, outcome: Outcome) -> Result<Value, String> {
    let reply = outcome.map_err(|error| error.to_string())?;
    let mut response = json!({ "accepted": reply.outcome().is_ok(), "tick": reply.tick });
    if let Err(refusal) = reply.outcome() {
        response["reason"] = refusal.explain(&request).into();
    }
    Ok(response)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(service: u32, encoding: &[u8], request: &str) -> Result<Request, String> {
        command_of(&ServiceCall { service, call: 1, encoding, request: request.as_bytes() }, &[])
    }

    #[test]
    fn each_service_is_a_command_and_bad_calls_are_refused_with_the_reason() {
        for (service, (name, needs)) in COMMANDS.iter().enumerate() {
            let request = if needs.is_some() { r#"{"value":1.5}"# } else { "{}" };
            let read = read(service as u32, b"json", request);
            assert_eq!(read.is_ok(), *name != "cue", "{name}: {read:?}");
        }
        assert_eq!(read(5, b"json", r#"{"value":1.5}"#), Ok(Request::Speed { speed_mps: 1.5 }));
        for (service, encoding, request, reason) in [
            (10, &b"json"[..], "{}", "there is no service with the number 10"),
            (0, b"cdr", "{}", "the encoding is \"cdr\", must be json"),
            (0, b"json", "[]", "the request must be an object of JSON: "),
            (5, b"json", "{}", r#"the request is {}, must be {"value": number}"#),
            (5, b"json", r#"{"value":"1"}"#, r#"the request is {"value":"1"}, must be {"value": number}"#),
            (8, b"json", r#"{"value":1}"#, r#"the request is {"value":1}, must be {"name": string}"#),
            (0, b"json", r#"{"value":1}"#, r#"the request is {"value":1}, must be {}"#),
        ] {
            let error = read(service, encoding, request).expect_err(reason);
            assert!(error.starts_with(reason), "{error}");
        }
    }
}
