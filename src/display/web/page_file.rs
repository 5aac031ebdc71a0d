//! The files of a page, which are embedded in the program.

use axum::Router;
use axum::http::header::CACHE_CONTROL;
use axum::http::{HeaderValue, StatusCode};
use axum::routing::get;
use include_dir::File;

use super::site::text;

/// Adds a file of the page to the router. Cargo embeds a new file only when an existing file changes, for example to import it.
pub(in crate::display) fn add_page_file<S: Clone + Send + Sync + 'static>(
    router: Router<S>,
    file: &'static File<'_>,
) -> Router<S> {
    let media_type = match file.path().extension().and_then(|extension| extension.to_str()) {
        Some("css") => "text/css; charset=utf-8",
        Some("html") => "text/html; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("svg") => "image/svg+xml",
        other => unreachable!("a page has no files of the kind {other:?}"),
    };
    let name = file.path().display().to_string();
    let path = if name == "index.html" { "/".to_owned() } else { format!("/{name}") };
    let page = async move || {
        let mut response = text(StatusCode::OK, media_type, file.contents());
        // Another version of the program has other files with the same names.
        response.headers_mut().insert(CACHE_CONTROL, HeaderValue::from_static("no-cache"));
        response
    };
    router.route(&path, get(page))
}
