//! Where a scraper asks.

use std::sync::Arc;

use axum::Router;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use axum::routing::get;
use tokio::sync::watch;

use super::{MEDIA_TYPE, exposition};
use crate::display::observe::Scene;
use crate::display::web::{refuse, text};
use crate::system::clock::monotonic_ns;

/// What answers with the metrics of the newest scene at `/metrics`, and points there at `/`.
pub fn router(scenes: watch::Receiver<Arc<Scene>>) -> Router {
    Router::new()
        .route("/", get(async || text(StatusCode::OK, "text/plain; charset=utf-8", "The metrics are at /metrics\n")))
        .route("/metrics", get(tell))
        .fallback(async || refuse(StatusCode::NOT_FOUND, "there is nothing but /metrics"))
        .method_not_allowed_fallback(async || refuse(StatusCode::METHOD_NOT_ALLOWED, "metrics are only read"))
        .with_state(scenes)
}

/// The metrics of a scene, now.
pub fn reply(scene: &Scene) -> Response {
    text(StatusCode::OK, MEDIA_TYPE, exposition(scene, monotonic_ns()))
}

async fn tell(State(scenes): State<watch::Receiver<Arc<Scene>>>) -> Response {
    let scene = Arc::clone(&scenes.borrow());
    reply(&scene)
}
