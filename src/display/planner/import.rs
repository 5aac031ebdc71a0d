//! Drawings and tracks that are dropped on the page: they are put into the configuration's folder, and become a route.

use std::sync::Arc;

use axum::body::to_bytes;
use axum::extract::{Request, State};
use axum::http::{StatusCode, Uri};
use axum::response::Response;
use percent_encoding::percent_decode_str;
use serde_json::{Value, json};

use super::plan_folder::{PlanFolder, Refusal};
use super::{Planner, refuse_refusal};
use crate::display::web::{json_reply, refuse};

/// Endings of files that may be a route.
const ENDINGS: [&str; 7] = ["svg", "dxf", "csv", "gpx", "kml", "geojson", "json"];
/// Longest file, as for every command.
const MAX_BYTES: usize = 64 << 20;

/// A way in which a file may become a route, and what the user should know of it.
struct Way {
    keys: &'static [(&'static str, f64)],
    note: Option<&'static str>,
}

const FIRST: &str = "The file has several paths: this is the first one. Change number in the text to take another one.";
const ROUNDED: &str = "Its sharp corners are rounded with 2 m: change corner_radius_m in the text.";
const WAYS: [Way; 6] = [
    Way { keys: &[], note: None },
    Way { keys: &[("corner_radius_m", 2.0)], note: Some(ROUNDED) },
    // Far from any origin, as in coordinates of a survey.
    Way { keys: &[("start_x_m", 0.0), ("start_y_m", 0.0)], note: None },
    Way { keys: &[("number", 1.0)], note: Some(FIRST) },
    Way { keys: &[("number", 1.0), ("corner_radius_m", 2.0)], note: Some(FIRST) },
    Way { keys: &[("number", 1.0), ("start_x_m", 0.0), ("start_y_m", 0.0)], note: Some(FIRST) },
];

/// The name of a file in an address that ends in `?name=NAME`.
pub(super) fn name_of(address: &Uri) -> Option<String> {
    let name = address.query()?.strip_prefix("name=")?;
    Some(percent_decode_str(name).decode_utf8().ok()?.into_owned())
}

/// Answers a request to import a file: the keys of `[route]` that follow it.
pub(super) async fn import(State(Planner(planner)): State<Planner>, request: Request) -> Response {
    if !planner.gate.rights(request.headers()).may_control {
        return refuse(StatusCode::UNAUTHORIZED, "importing needs the token that `bench-dragon plan` printed");
    }
    let Some(name) = name_of(request.uri()) else {
        return refuse(StatusCode::BAD_REQUEST, "the request must have the name of the file");
    };
    let Ok(bytes) = to_bytes(request.into_body(), MAX_BYTES).await else {
        return refuse(StatusCode::PAYLOAD_TOO_LARGE, "the file is longer than 64 MiB, or did not arrive");
    };
    let folder = Arc::clone(&planner.folder);
    match tokio::task::spawn_blocking(move || route_of(&folder, &name, &bytes)).await {
        Ok(Ok(route)) => json_reply(StatusCode::OK, &route),
        Ok(Err(refusal)) => refuse_refusal(refusal),
        Err(_) => refuse(StatusCode::INTERNAL_SERVER_ERROR, "importing has failed"),
    }
}

/// Puts a file into the folder, and finds a route that follows it. A file that has none is taken back.
fn route_of(folder: &PlanFolder, name: &str, bytes: &[u8]) -> Result<Value, Refusal> {
    let file = folder.put(name, bytes, &ENDINGS)?;
    let mut first_reason = None;
    for Way { keys, note } in WAYS {
        let mut route = json!({ "kind": "drawing", "file": file });
        for &(key, value) in keys {
            route[key] = if key == "number" { 1.into() } else { value.into() };
        }
        // A small dragon: whether a longer one walks it is seen in the drawing.
        let document = toml::to_string(&json!({ "dragon": { "benches": 1 }, "route": route }));
        let text = document.map_err(|error| Refusal::Bad(error.to_string()))?;
        match folder.check(&text) {
            Ok(()) => return Ok(json!({ "route": route, "note": note })),
            Err(reason) if reason.contains("the most that is allowed") => {
                first_reason = Some(reason);
                break;
            }
            Err(reason) => first_reason = first_reason.or(Some(reason)),
        }
    }
    folder.take_back(&file);
    Err(Refusal::Bad(first_reason.unwrap_or_default()))
}
