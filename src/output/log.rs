//! Log of the program on stderr: warnings and errors, or the filter in `RUST_LOG`.
//!
//! From iceoryx2, simplecss, usvg and zenoh, the log shows only errors by default; `RUST_LOG` shows the rest. iceoryx2 warns about its
//! housekeeping: each process removes the remains of killed processes, and logs remains that another process has removed first.
//! If such an event matters to people, a call returns it as an error, and the program reports that error. usvg and simplecss warn about
//! wrong data of drawings, which the program refuses. zenoh warns about features that are off. The filter compares the target of
//! a line, which is the module that logged it, and not its text. The log omits the object dump in the lines of iceoryx2.

use std::io;

use iceoryx2::prelude::{LogLevel, set_log_level};
use tracing::Level;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt::format;
use tracing_subscriber::prelude::*;

use super::Stream;
use super::terminal_text::is_coloured;

/// Prefixes of the targets of libraries whose warnings are hidden. All lines of iceoryx2 have the target of its logger.
const ERRORS_ONLY: [&str; 4] = ["iceoryx2", "simplecss", "usvg", "zenoh"];

pub(crate) fn to_stderr() {
    let asked: Option<Targets> = std::env::var("RUST_LOG").ok().and_then(|filter| filter.parse().ok());
    set_log_level(if asked.is_some() { LogLevel::Trace } else { LogLevel::Error });
    let fields = format::debug_fn(|writer, field, value| match field.name() {
        "message" => write!(writer, "{value:?}"),
        "origin" => Ok(()),
        name => write!(writer, "{name}={value:?}"),
    });
    let lines = tracing_subscriber::fmt::layer()
        .fmt_fields(fields)
        .with_target(false)
        .with_ansi(is_coloured(&io::stderr()))
        .with_writer(|| Stream::Stderr)
        .without_time();
    tracing_subscriber::registry().with(lines.with_filter(asked.unwrap_or_else(usual))).init();
}

/// The default filter: warnings and errors, but only errors from the libraries in [`ERRORS_ONLY`].
fn usual() -> Targets {
    let errors_only = ERRORS_ONLY.map(|target| (target, Level::ERROR));
    Targets::new().with_default(Level::WARN).with_targets(errors_only)
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;

    #[derive(Clone, Default)]
    struct Lines(Arc<Mutex<Vec<u8>>>);

    impl io::Write for Lines {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().expect("no writer panics").write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn log_shows_errors_of_libraries_and_warnings_of_the_program() {
        let shown = Lines::default();
        let writer = shown.clone();
        let lines =
            tracing_subscriber::fmt::layer().without_time().with_ansi(false).with_writer(move || writer.clone());
        let log = tracing_subscriber::registry().with(lines.with_filter(usual()));
        tracing::subscriber::with_default(log, || {
            let origin = "Storage { .. }";
            tracing::warn!(target: "iceoryx2_bb_loggers::tracing", origin, "any text");
            tracing::error!(target: "iceoryx2_bb_loggers::tracing", origin, "a corrupted system");
            tracing::warn!(target: "zenoh::net::runtime", "Gossip is disabled");
            tracing::warn!("Detected dead node 17: a warning of the program with the text of a library");
            tracing::info!("all is well");
        });
        let shown = String::from_utf8(shown.0.lock().expect("no writer panics").clone()).expect("UTF-8");
        let shown: Vec<&str> = shown.lines().collect();
        let [error, warning] = shown[..] else { panic!("{shown:#?}") };
        assert!(error.starts_with("ERROR") && error.contains("a corrupted system"), "{error}");
        assert!(
            warning.trim_start().starts_with("WARN") && warning.contains("with the text of a library"),
            "{warning}"
        );
    }
}
