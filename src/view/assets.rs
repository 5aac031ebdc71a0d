//! The page's files, in the program.

/// A file of the page.
#[derive(Debug)]
pub(super) struct Asset {
    /// Where it is asked for.
    pub(super) path: &'static str,
    pub(super) media_type: &'static str,
    pub(super) bytes: &'static [u8],
}

/// Embeds files of the page.
macro_rules! assets {
    ($($path:literal, $file:literal, $media_type:ident;)*) => {
        [$(Asset { path: $path, media_type: $media_type, bytes: include_bytes!(concat!("page/", $file)) }),*]
    };
}

const HTML: &str = "text/html; charset=utf-8";

/// All of them.
pub(super) const ASSETS: &[Asset] = &assets! {
    "/", "index.html", HTML;
};
