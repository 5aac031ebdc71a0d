//! The program's log on stderr: warnings and worse, or what `RUST_LOG` says.
//!
//! iceoryx2's own are among them, without the dump of the object that each comes with, and without its housekeeping: whoever
//! leaves or joins a bus clears away what the others have left, and each process notes what another has cleared before it.
//! That is as it should be; with `RUST_LOG` it is told all the same. So are zenoh's warnings, which tell of what was not asked
//! for: what matters to a show the bridge says itself.

use std::fmt;
use std::io;

use iceoryx2::prelude::{LogLevel, set_log_level};
use tracing::field::{Field, Visit};
use tracing::{Event, Level, Metadata, Subscriber};
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt::format;
use tracing_subscriber::layer::{Context, Filter};
use tracing_subscriber::prelude::*;

use crate::command::colour::is_coloured;
use crate::held_stderr::HeldStderr;

/// How iceoryx2's notes on its housekeeping begin.
const HOUSEKEEPING: [&str; 6] = [
    "Detected dead node ",
    "Failed to check if the service ",
    "Found corrupted service ",
    "The static storage was already removed.",
    "Trying to remove node ",
    "Unable to remove node resources.",
];

/// Begins to log.
pub(crate) fn to_stderr() {
    let asked: Option<Targets> = std::env::var("RUST_LOG").ok().and_then(|filter| filter.parse().ok());
    set_log_level(if asked.is_some() { LogLevel::Trace } else { LogLevel::Warn });
    let fields = format::debug_fn(|writer, field, value| match field.name() {
        "message" => write!(writer, "{value:?}"),
        "origin" => Ok(()),
        name => write!(writer, "{name}={value:?}"),
    });
    let lines = tracing_subscriber::fmt::layer()
        .fmt_fields(fields)
        .with_target(false)
        .with_ansi(is_coloured(&io::stderr()))
        .with_writer(|| HeldStderr)
        .without_time();
    let registry = tracing_subscriber::registry();
    match asked {
        Some(asked) => registry.with(lines.with_filter(asked)).init(),
        None => registry.with(lines.with_filter(WithoutHousekeeping)).init(),
    }
}

/// Warnings and worse, but no housekeeping.
struct WithoutHousekeeping;

impl<S: Subscriber> Filter<S> for WithoutHousekeeping {
    fn enabled(&self, metadata: &Metadata<'_>, _: &Context<'_, S>) -> bool {
        let most = if metadata.target().starts_with("zenoh") { Level::ERROR } else { Level::WARN };
        *metadata.level() <= most
    }

    fn event_enabled(&self, event: &Event<'_>, _: &Context<'_, S>) -> bool {
        let mut message = Message(String::new());
        event.record(&mut message);
        !HOUSEKEEPING.iter().any(|beginning| message.0.starts_with(beginning))
    }
}

/// The message of an event.
struct Message(String);

impl Visit for Message {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        if field.name() == "message" {
            self.0 = format!("{value:?}");
        }
    }
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
    fn what_another_process_has_cleared_away_is_not_told_but_other_warnings_are() {
        let told = Lines::default();
        let writer = told.clone();
        let lines =
            tracing_subscriber::fmt::layer().without_time().with_ansi(false).with_writer(move || writer.clone());
        let log = tracing_subscriber::registry().with(lines.with_filter(WithoutHousekeeping));
        tracing::subscriber::with_default(log, || {
            let origin = "Storage { .. }";
            tracing::warn!(origin, "{}", format_args!("Detected dead node 17 in service 4. Trying to cleanup."));
            tracing::warn!(
                origin,
                "The static storage was already removed. This could be caused by a corrupted system."
            );
            tracing::warn!("starting with 1 of 2 readers");
            tracing::warn!(target: "zenoh::net::runtime", "Gossip is disabled");
            tracing::info!("all is well");
        });
        let told = String::from_utf8(told.0.lock().expect("no writer panics").clone()).expect("UTF-8");
        assert_eq!(told.lines().count(), 1, "{told}");
        assert!(told.ends_with("starting with 1 of 2 readers\n"), "{told}");
    }
}
