//! The page's files, in the program.

use include_dir::{Dir, include_dir};

static PAGE: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/src/display/view/page");

/// A file of the page.
#[derive(Debug)]
pub(super) struct Asset {
    /// Where it is asked for.
    pub(super) path: String,
    pub(super) media_type: &'static str,
    pub(super) bytes: &'static [u8],
}

/// All of them. A new file is found once a file that is here already imports it.
pub(super) fn assets() -> impl Iterator<Item = Asset> {
    PAGE.files().map(|file| {
        let path = file.path();
        let media_type = match path.extension().and_then(|extension| extension.to_str()) {
            Some("css") => "text/css; charset=utf-8",
            Some("html") => "text/html; charset=utf-8",
            Some("js") => "text/javascript; charset=utf-8",
            Some("svg") => "image/svg+xml",
            other => unreachable!("a page has no files of the kind {other:?}"),
        };
        let name = path.display().to_string();
        let path = if name == "index.html" { "/".to_owned() } else { format!("/{name}") };
        Asset { path, media_type, bytes: file.contents() }
    })
}
