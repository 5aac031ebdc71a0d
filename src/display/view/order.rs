//! A command as a page sends it.

use bench_dragon_ipc::Request;
use serde::Deserialize;

/// The body of a request.
#[derive(Debug, Deserialize)]
#[serde(tag = "command", rename_all = "snake_case", deny_unknown_fields)]
enum Order {
    Pause,
    Resume,
    Hold,
    Release,
    Speed { value: f64 },
    Seek { value: f64 },
}

/// The request in a body, or what is wrong with it.
pub(super) fn read_order(body: &[u8]) -> Result<Request, String> {
    let order = serde_json::from_slice(body).map_err(|error| {
        format!(
            r#"a command is {{"command":"pause"}}, resume, hold, release, or speed or seek with a "value": {error}"#
        )
    })?;
    Ok(match order {
        Order::Pause => Request::Pause,
        Order::Resume => Request::Resume,
        Order::Hold => Request::Hold,
        Order::Release => Request::Release,
        Order::Speed { value } => Request::Speed { speed_mps: value },
        Order::Seek { value } => Request::Seek { sim_time_s: value },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_can_give_six_commands() {
        for (body, request) in [
            (r#"{"command":"pause"}"#, Request::Pause),
            (r#"{"command":"resume"}"#, Request::Resume),
            (r#"{"command":"hold"}"#, Request::Hold),
            (r#"{"command":"release"}"#, Request::Release),
            (r#"{"command":"speed","value":0.8}"#, Request::Speed { speed_mps: 0.8 }),
            (r#"{"command":"seek","value":-30}"#, Request::Seek { sim_time_s: -30.0 }),
        ] {
            assert_eq!(read_order(body.as_bytes()), Ok(request), "{body}");
        }
    }

    #[test]
    fn anything_else_is_none() {
        for body in [
            "",
            "null",
            "[]",
            r#"{"command":"stop"}"#,
            r#"{"command":"grant","value":1}"#,
            r#"{"command":"speed"}"#,
            r#"{"command":"speed","value":"1"}"#,
            r#"{"command":"speed","value":1e999}"#,
            r#"{"command":"seek","value":1,"more":2}"#,
            "\u{0}\u{1}",
        ] {
            assert!(read_order(body.as_bytes()).is_err(), "{body}");
        }
    }
}
