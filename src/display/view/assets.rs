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
const PICTURE: &str = "image/svg+xml";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";

/// All of them.
pub(super) const ASSETS: &[Asset] = &assets! {
    "/", "index.html", HTML;
    "/alert_filter.js", "alert_filter.js", SCRIPT;
    "/alerts.js", "alerts.js", SCRIPT;
    "/announcer.js", "announcer.js", SCRIPT;
    "/boards.js", "boards.js", SCRIPT;
    "/camera.js", "camera.js", SCRIPT;
    "/canvas.js", "canvas.js", SCRIPT;
    "/command.js", "command.js", SCRIPT;
    "/commands.js", "commands.js", SCRIPT;
    "/connection.js", "connection.js", SCRIPT;
    "/contact_notice.js", "contact_notice.js", SCRIPT;
    "/contacts.js", "contacts.js", SCRIPT;
    "/controls.js", "controls.js", SCRIPT;
    "/details.js", "details.js", SCRIPT;
    "/dragon_paths.js", "dragon_paths.js", SCRIPT;
    "/element.js", "element.js", SCRIPT;
    "/figures.js", "figures.js", SCRIPT;
    "/flags.js", "flags.js", SCRIPT;
    "/format.js", "format.js", SCRIPT;
    "/frame.js", "frame.js", SCRIPT;
    "/gap.js", "gap.js", SCRIPT;
    "/icon.svg", "icon.svg", PICTURE;
    "/keys.js", "keys.js", SCRIPT;
    "/lamps.js", "lamps.js", SCRIPT;
    "/levels.js", "levels.js", SCRIPT;
    "/main.js", "main.js", SCRIPT;
    "/nearest_mark.js", "nearest_mark.js", SCRIPT;
    "/outlook_words.js", "outlook_words.js", SCRIPT;
    "/overlap.js", "overlap.js", SCRIPT;
    "/pace.js", "pace.js", SCRIPT;
    "/palette.js", "palette.js", SCRIPT;
    "/plan.js", "plan.js", SCRIPT;
    "/plan_times.js", "plan_times.js", SCRIPT;
    "/pointer.js", "pointer.js", SCRIPT;
    "/route_layer.js", "route_layer.js", SCRIPT;
    "/scale_bar.js", "scale_bar.js", SCRIPT;
    "/show.js", "show.js", SCRIPT;
    "/standing.js", "standing.js", SCRIPT;
    "/storage.js", "storage.js", SCRIPT;
    "/strip.js", "strip.js", SCRIPT;
    "/style.css", "style.css", STYLE;
    "/tabs.js", "tabs.js", SCRIPT;
    "/theme.js", "theme.js", SCRIPT;
    "/timeline.js", "timeline.js", SCRIPT;
    "/timeline_axis.js", "timeline_axis.js", SCRIPT;
    "/timeline_curves.js", "timeline_curves.js", SCRIPT;
    "/token.js", "token.js", SCRIPT;
};
