//! The planner's page: a configuration to look at and to drag.
//!
//! - *Questions* come over a WebSocket: a text, perhaps with an edit of it, and a number. The newest is answered, older ones are
//!   dropped (`newest`). An edit becomes a change of the text that keeps its comments (`toml_text`).
//! - *Answers* have the question's number: the drawing, the handles and the first contact at once (`plan`), all else in parts
//!   (`study`, `fix`).
//! - *Questions of `solve`* are processes of this program (`asker`, `child`), which a newer question cancels.
//! - *Files:* only the configuration's folder is read and written (`plan_folder`, `import`). A process of its own reads a large text
//!   first, within the limits of a command.
//! - *Access:* as for the view of a show. Saving needs the token; off loopback, everything does.
//!
//! The page's files are in `page/`. It shares camera, colours and boards with the page of a show.

mod answerer;
mod asker;
mod change;
mod child;
mod corner_run;
mod dragon_edit;
mod edit;
mod fix;
mod handing_over;
mod handle;
mod import;
mod newest;
mod page_desk;
mod page_question;
mod path_handles;
mod plan;
mod plan_folder;
mod route_edit;
mod spiral_handles;
mod stage_handles;
mod study;
mod toml_text;

#[cfg(test)]
mod tests;

use std::io;
use std::net::IpAddr;
use std::path::Path;
use std::sync::Arc;

use axum::Router;
use axum::body::to_bytes;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{FromRequestParts as _, Request, State};
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE};
use axum::http::{HeaderValue, StatusCode};
use axum::middleware;
use axum::response::Response;
use axum::routing::{any, get, post};
use include_dir::{Dir, include_dir};
use serde::Deserialize;
use serde_json::json;
use tokio::sync::{Semaphore, watch};

use self::plan_folder::{PlanFolder, Refusal};
use super::view;
use super::web::{Gate, Token, add_page_file, is_json, json_reply, judge_token, refuse};
use crate::config::MAX_CONFIG_BYTES;

/// The page's own files.
static PAGE: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/src/display/planner/page");
/// Files of the page of a show that this page has of its own. It shares all others.
const OWN: [&str; 2] = ["index.html", "main.js"];
/// The WebSocket protocol of the questions.
const PROTOCOL: &str = "bench-dragon.plan.v1";
/// Most open pages: each has two threads.
const MAX_PAGES: usize = 8;
/// Greatest length of a question, and of a request to save: a text, in JSON.
const MAX_MESSAGE_BYTES: usize = 6 * MAX_CONFIG_BYTES as usize + 4096;
/// The text without a file.
const PAPER: &str = include_str!("../../../examples/paper.toml");

/// A planner of one configuration.
#[derive(Clone, Debug)]
pub struct Planner(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    folder: Arc<PlanFolder>,
    gate: Arc<Gate>,
    closing: watch::Sender<bool>,
    places: Arc<Semaphore>,
    /// One file is made at a time.
    handing_over: Semaphore,
}

impl Planner {
    /// A planner of a configuration file, or of the paper's dragon.
    ///
    /// # Errors
    /// The file's folder cannot be read, or its name is not UTF-8.
    pub fn open(file: Option<&Path>, token: Token, address: IpAddr) -> io::Result<Self> {
        let folder = PlanFolder::of(file)?;
        Ok(Self(Arc::new(Inner {
            folder: Arc::new(folder),
            gate: Arc::new(Gate::new(token, false, address)),
            closing: watch::Sender::new(false),
            places: Arc::new(Semaphore::new(MAX_PAGES)),
            handing_over: Semaphore::new(1),
        })))
    }

    /// A flag that becomes true when the planner ends.
    pub fn closing(&self) -> &watch::Sender<bool> {
        &self.0.closing
    }

    /// The router of the planner's requests.
    pub fn router(&self) -> Router {
        let shared = view::PAGE.files().filter(|file| OWN.iter().all(|own| file.path() != Path::new(own)));
        let pages = PAGE.files().chain(shared).fold(Router::new(), add_page_file);
        pages
            .route("/access", get(report_access))
            .route("/text", get(report_text))
            .route("/stream", any(open_stream))
            .route("/save", post(save))
            .route("/hand-over", get(handing_over::list).post(handing_over::hand_over))
            .route("/import", post(import::import))
            .fallback(async || refuse(StatusCode::NOT_FOUND, "there is no such page"))
            .method_not_allowed_fallback(async || {
                refuse(StatusCode::METHOD_NOT_ALLOWED, "this method is not allowed here")
            })
            .with_state(self.clone())
            .layer(middleware::from_fn_with_state(Arc::clone(&self.0.gate), judge_token))
    }
}

fn refuse_refusal(refusal: Refusal) -> Response {
    match refusal {
        Refusal::Bad(reason) => refuse(StatusCode::BAD_REQUEST, &reason),
        Refusal::Conflict(reason) => refuse(StatusCode::CONFLICT, &reason),
    }
}

async fn report_access(State(Planner(planner)): State<Planner>, request: Request) -> Response {
    let rights = planner.gate.rights(request.headers());
    json_reply(
        StatusCode::OK,
        &json!({
            "version": env!("CARGO_PKG_VERSION"),
            "may_view": rights.may_view,
            "may_save": rights.may_control,
        }),
    )
}

fn refuse_look() -> Response {
    refuse(StatusCode::UNAUTHORIZED, "this planner needs the token that `bench-dragon plan` printed")
}

/// The opened file as it is on the disk now.
async fn report_text(State(Planner(planner)): State<Planner>, request: Request) -> Response {
    if !planner.gate.rights(request.headers()).may_view {
        return refuse_look();
    }
    // A page that has saved under another name stays with that file.
    let wanted = import::name_of(request.uri());
    let Some(name) = wanted.as_ref().or(planner.folder.name.as_ref()) else {
        return unkept(json_reply(StatusCode::OK, &json!({ "name": null, "text": PAPER, "mark": null })));
    };
    match planner.folder.open(name) {
        Ok(saved) => {
            unkept(json_reply(StatusCode::OK, &json!({ "name": name, "text": saved.text, "mark": saved.mark })))
        }
        Err(reason) => refuse(StatusCode::NOT_FOUND, &reason),
    }
}

/// A reply that no browser keeps.
fn unkept(mut response: Response) -> Response {
    response.headers_mut().insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
    response
}

async fn open_stream(State(planner): State<Planner>, request: Request) -> Response {
    if !planner.0.gate.rights(request.headers()).may_view {
        return refuse_look();
    }
    let (mut parts, _) = request.into_parts();
    let Ok(upgrade) = WebSocketUpgrade::from_request_parts(&mut parts, &planner).await else {
        return refuse(StatusCode::UPGRADE_REQUIRED, "the stream is a WebSocket: the request must be an upgrade");
    };
    let Planner(planner) = planner;
    let Ok(place) = Arc::clone(&planner.places).try_acquire_owned() else {
        return refuse(StatusCode::SERVICE_UNAVAILABLE, "8 pages are open already, which is the limit");
    };
    let upgrade = upgrade.protocols([PROTOCOL]).max_message_size(MAX_MESSAGE_BYTES).max_frame_size(MAX_MESSAGE_BYTES);
    let (folder, closing) = (Arc::clone(&planner.folder), planner.closing.subscribe());
    upgrade.on_upgrade(move |socket| page_desk::serve(socket, folder, closing, place))
}

/// A request to save a text.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Saving {
    name: String,
    text: String,
    /// The mark of the file that the page knows; null for a new file.
    known: Option<String>,
}

async fn save(State(Planner(planner)): State<Planner>, request: Request) -> Response {
    if !planner.gate.rights(request.headers()).may_control {
        return refuse(StatusCode::UNAUTHORIZED, "saving needs the token that `bench-dragon plan` printed");
    }
    if !request.headers().get(CONTENT_TYPE).is_some_and(is_json) {
        return refuse(StatusCode::UNSUPPORTED_MEDIA_TYPE, "the request must have the Content-Type application/json");
    }
    let Ok(body) = to_bytes(request.into_body(), MAX_MESSAGE_BYTES).await else {
        return refuse(StatusCode::PAYLOAD_TOO_LARGE, "the request is too long, or did not arrive");
    };
    let Ok(Saving { name, text, known }) = serde_json::from_slice(&body) else {
        return refuse(StatusCode::BAD_REQUEST, "the request must have a name, a text and the known mark");
    };
    // Checking and writing take a while, in which other pages get their answers.
    let folder = Arc::clone(&planner.folder);
    let saved = tokio::task::spawn_blocking(move || folder.save(&name, &text, known.as_deref())).await;
    match saved {
        Ok(Ok(mark)) => json_reply(StatusCode::OK, &json!({ "mark": mark })),
        Ok(Err(refusal)) => refuse_refusal(refusal),
        Err(_) => refuse(StatusCode::INTERNAL_SERVER_ERROR, "saving has failed"),
    }
}
