//! The messages of a viewer: JSON with an `op`, and calls of services in binary. Everything else is answered by a note.

use serde::Deserialize;

/// Opcode of a call.
const SERVICE_CALL_REQUEST: u8 = 2;

/// A message of a viewer.
#[derive(Debug, PartialEq, Eq, Deserialize)]
#[serde(tag = "op", rename_all = "camelCase")]
pub(super) enum ViewerRequest {
    Subscribe {
        subscriptions: Vec<Subscription>,
    },
    #[serde(rename_all = "camelCase")]
    Unsubscribe {
        subscription_ids: Vec<u32>,
    },
    #[serde(rename_all = "camelCase")]
    GetParameters {
        #[serde(default)]
        parameter_names: Vec<String>,
        id: Option<String>,
    },
    SetParameters {
        id: Option<String>,
    },
    #[serde(rename_all = "camelCase")]
    SubscribeParameterUpdates {
        #[serde(default)]
        parameter_names: Vec<String>,
    },
    #[serde(rename_all = "camelCase")]
    UnsubscribeParameterUpdates {
        #[serde(default)]
        parameter_names: Vec<String>,
    },
}

/// A subscription, whose number the viewer chooses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Subscription {
    pub(super) id: u32,
    pub(super) channel_id: u32,
}

/// A call of a service.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct ServiceCall<'a> {
    pub(super) service: u32,
    pub(super) call: u32,
    pub(super) encoding: &'a [u8],
    pub(super) request: &'a [u8],
}

/// Reads a message. The error is the reason for which it is none that the bridge supports.
pub(super) fn read_request(text: &str) -> Result<ViewerRequest, String> {
    serde_json::from_str(text).map_err(|error| format!("this message is not supported: {error}"))
}

/// Reads a call; `None` for any other binary message.
pub(super) fn read_call(message: &[u8]) -> Option<ServiceCall<'_>> {
    let (&SERVICE_CALL_REQUEST, rest) = message.split_first()? else { return None };
    let (service, rest) = number(rest)?;
    let (call, rest) = number(rest)?;
    let (length, rest) = number(rest)?;
    let (encoding, request) = rest.split_at_checked(length as usize)?;
    Some(ServiceCall { service, call, encoding, request })
}

fn number(bytes: &[u8]) -> Option<(u32, &[u8])> {
    let (number, rest) = bytes.split_first_chunk()?;
    Some((u32::from_le_bytes(*number), rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_read_and_any_other_message_is_named() {
        let subscribe = r#"{"op":"subscribe","subscriptions":[{"id":0,"channelId":3}]}"#;
        let subscriptions = vec![Subscription { id: 0, channel_id: 3 }];
        assert_eq!(read_request(subscribe), Ok(ViewerRequest::Subscribe { subscriptions }));
        let names = ViewerRequest::GetParameters { parameter_names: Vec::new(), id: None };
        assert_eq!(read_request(r#"{"op":"getParameters"}"#), Ok(names));
        for bad in
            ["", "[]", "{}", r#"{"op":"dance"}"#, r#"{"op":"subscribe","subscriptions":[{"id":-1,"channelId":3}]}"#]
        {
            let reason = read_request(bad).expect_err(bad);
            assert!(reason.starts_with("this message is not supported: "), "{reason}");
        }
    }

    #[test]
    fn a_call_is_read_and_a_shorter_one_is_not() {
        let message = [&[2, 7, 0, 0, 0, 9, 0, 0, 0, 4, 0, 0, 0][..], b"json{}"].concat();
        let call = ServiceCall { service: 7, call: 9, encoding: b"json", request: b"{}" };
        assert_eq!(read_call(&message), Some(call));
        assert!((0..message.len() - 2).all(|length| read_call(&message[..length]).is_none()));
        assert_eq!(read_call(&[1, 0, 0, 0, 0, 1]), None);
        assert_eq!(read_call(&[2, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255]), None);
    }
}
