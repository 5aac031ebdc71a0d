//! The server's messages of the protocol: JSON with an `op`, and binary messages with an opcode and little-endian numbers.

use axum::body::Bytes;
use axum::extract::ws::Message;
use serde_json::{Value, json};

use super::Bridge;

const MESSAGE_DATA: u8 = 1;
const TIME: u8 = 2;
const SERVICE_CALL_RESPONSE: u8 = 3;

/// How urgent a note to a viewer is.
#[derive(Clone, Copy, Debug)]
pub(super) enum NoteLevel {
    Warning = 1,
    Error = 2,
}

/// Encodes what the bridge offers. It is a viewer's first message.
pub(super) fn server_info(bridge: &Bridge, steers: bool) -> Message {
    let mut capabilities = vec!["time", "parameters", "parametersSubscribe"];
    if steers {
        capabilities.push("services");
    }
    json_message(&json!({
        "op": "serverInfo",
        "name": format!("bench-dragon {}", bridge.instance),
        "capabilities": capabilities,
        "supportedEncodings": ["json"],
        "metadata": { "version": env!("CARGO_PKG_VERSION"), "instance": bridge.instance },
        "sessionId": bridge.session,
    }))
}

/// Encodes a note that the viewer shows. A later one with the same id replaces it.
pub(super) fn note(level: NoteLevel, id: &str, text: &str) -> Message {
    json_message(&json!({ "op": "status", "level": level as u8, "id": id, "message": text }))
}

/// Encodes the values of parameters. `id`: that of the request.
pub(super) fn parameter_values(parameters: &[&Value], id: Option<&str>) -> Message {
    let mut message = json!({ "op": "parameterValues", "parameters": parameters });
    if let Some(id) = id {
        message["id"] = id.into();
    }
    json_message(&message)
}

/// Encodes the reason for which a call has no response.
pub(super) fn call_failure(service: u32, call: u32, reason: &str) -> Message {
    json_message(&json!({ "op": "serviceCallFailure", "serviceId": service, "callId": call, "message": reason }))
}

/// Encodes the response to a call, as JSON.
pub(super) fn call_response(service: u32, call: u32, response: &Value) -> Message {
    const ENCODING: &[u8] = b"json";
    let mut message = vec![SERVICE_CALL_RESPONSE];
    for number in [service, call, ENCODING.len() as u32] {
        message.extend(number.to_le_bytes());
    }
    message.extend(ENCODING);
    message.extend(response.to_string().as_bytes());
    Message::Binary(message.into())
}

/// Encodes a message of a channel.
pub(super) fn channel_message(subscription: u32, unix_ns: u64, payload: &[u8]) -> Message {
    let mut message = Vec::with_capacity(1 + size_of::<u32>() + size_of::<u64>() + payload.len());
    message.push(MESSAGE_DATA);
    message.extend(subscription.to_le_bytes());
    message.extend(unix_ns.to_le_bytes());
    message.extend(payload);
    Message::Binary(message.into())
}

/// Encodes the bridge's clock.
pub(super) fn time(unix_ns: u64) -> Message {
    let mut message = vec![TIME];
    message.extend(unix_ns.to_le_bytes());
    Message::Binary(Bytes::from(message))
}

pub(super) fn json_message(value: &Value) -> Message {
    Message::Text(value.to_string().into())
}
