//! The files that are handed over, computed from the text of a page as it is drawn.

use axum::body::to_bytes;
use axum::extract::{Request, State};
use axum::http::header::{CONTENT_DISPOSITION, CONTENT_TYPE};
use axum::http::{HeaderValue, StatusCode};
use axum::response::{IntoResponse as _, Response};
use bench_dragon_geometry::dragon::Meter;
use serde::Deserialize;
use serde_json::json;

use super::plan_folder::PlanFolder;
use super::{MAX_MESSAGE_BYTES, Planner, refuse_look, unkept};
use crate::display::web::{is_json, json_reply, refuse};
use crate::hand_over::{FILES, File, HandOver, Settings};
use crate::output::figure::Paper;

/// Most work for each answer in a file, in steps of the meter: a few seconds.
const WORK: u64 = 200_000_000;

/// A request for a file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    file: String,
    text: String,
}

/// The names of the files, and what they are.
pub(super) async fn list() -> Response {
    json_reply(StatusCode::OK, &json!({ "files": FILES }))
}

/// A file of the plan in a text.
pub(super) async fn hand_over(State(planner): State<Planner>, request: Request) -> Response {
    let Planner(planner) = planner;
    if !planner.gate.rights(request.headers()).may_view {
        return refuse_look();
    }
    if !request.headers().get(CONTENT_TYPE).is_some_and(is_json) {
        return refuse(StatusCode::UNSUPPORTED_MEDIA_TYPE, "the request must have the Content-Type application/json");
    }
    let Ok(_place) = planner.handing_over.try_acquire() else {
        return refuse(StatusCode::SERVICE_UNAVAILABLE, "another file is being made: try again when it is there");
    };
    let Ok(body) = to_bytes(request.into_body(), MAX_MESSAGE_BYTES).await else {
        return refuse(StatusCode::PAYLOAD_TOO_LARGE, "the request is too long, or did not arrive");
    };
    let Ok(Asked { file, text }) = serde_json::from_slice(&body) else {
        return refuse(StatusCode::BAD_REQUEST, "the request must have a file and a text");
    };
    let Some(file) = FILES.into_iter().find(|known| known.name == file) else {
        return refuse(StatusCode::NOT_FOUND, "there is no such file");
    };
    let folder = planner.folder.clone();
    let made = tokio::task::spawn_blocking(move || make(&folder, &text, file)).await;
    match made {
        Ok(Ok(bytes)) => attached(bytes),
        Ok(Err(reason)) => refuse(StatusCode::UNPROCESSABLE_ENTITY, &format!("{} is left out: {reason}", file.name)),
        Err(_) => refuse(StatusCode::INTERNAL_SERVER_ERROR, "the file could not be made"),
    }
}

fn make(folder: &PlanFolder, text: &str, file: File) -> Result<Vec<u8>, String> {
    let config = folder.config(text)?;
    let name = folder.name.as_deref().unwrap_or("Bench dragon");
    let settings = Settings {
        title: name.strip_suffix(".toml").unwrap_or(name).to_owned(),
        paper: Paper::A3,
        at_s: &[],
        step_s: 1.0,
        meter: Meter::of(WORK),
    };
    HandOver::of(&config, settings)?.make(file)
}

fn attached(bytes: Vec<u8>) -> Response {
    let mut response = unkept(bytes.into_response());
    response.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static("application/octet-stream"));
    response.headers_mut().insert(CONTENT_DISPOSITION, HeaderValue::from_static("attachment"));
    response
}
