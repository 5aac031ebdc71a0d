//! The program's log on stderr: warnings and worse, or what `RUST_LOG` says.
//!
//! Of iceoryx2 and zenoh only errors are shown; `RUST_LOG` shows the rest. iceoryx2 warns of its housekeeping: each process
//! clears away what killed ones have left, and notes what another has cleared before it. What matters of that to people comes
//! back as an error of the call, and the program reports it itself. zenoh warns of what was not asked for. The lines are told
//! apart by their target, the module that logged them, and not by their text; those of iceoryx2 come without the dump of the
//! object that each has.

use std::io;

use iceoryx2::prelude::{LogLevel, set_log_level};
use tracing::Level;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt::format;
use tracing_subscriber::prelude::*;

use super::Stream;
use super::terminal_text::is_coloured;

/// What the targets of libraries begin with whose warnings are not shown. All of iceoryx2's lines have that of its logger.
const ERRORS_ONLY: [&str; 2] = ["iceoryx2", "zenoh"];

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

/// Warnings and worse, of some libraries errors alone.
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
    fn of_libraries_errors_are_shown_and_of_the_program_warnings_too() {
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
            tracing::warn!("Detected dead node 17: a warning of the program, whatever it begins with");
            tracing::info!("all is well");
        });
        let shown = String::from_utf8(shown.0.lock().expect("no writer panics").clone()).expect("UTF-8");
        let shown: Vec<&str> = shown.lines().collect();
        let [error, warning] = shown[..] else { panic!("{shown:#?}") };
        assert!(error.starts_with("ERROR") && error.contains("a corrupted system"), "{error}");
        assert!(warning.trim_start().starts_with("WARN") && warning.contains("whatever it begins with"), "{warning}");
    }
}
