//! `ctl status`: looks at the bus for a moment and reports how the show does.

use std::process::ExitCode;
use std::sync::atomic::Ordering;

use bench_dragon_ipc::Domain;
use jiff::Zoned;

use crate::cli::Format;
use crate::command::output::{print_json, print_line};
use crate::display::observe::{Link, Observer, Scene};
use crate::output::report::SceneReport;
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

/// Scenes a second.
const SCENES_HZ: u32 = 20;
/// So long the bus is read, in nanoseconds: each reader reports in it, and a monitor that has not is missing.
const LOOK_NS: u64 = 2_050_000_000;
/// So long a bus is waited for, in nanoseconds.
const NO_SERVER_NS: u64 = 500_000_000;
/// The longest that all of it takes, in nanoseconds.
const LONGEST_NS: u64 = 4_000_000_000;

/// Prints the status; the exit status is 0 where all is well, and 1 where a lamp is red or no frames come.
pub(super) fn run(domain: Domain, format: Format) -> anyhow::Result<ExitCode> {
    let (stop, began_ns) = (StopFlag::on_signals()?, monotonic_ns());
    let mut newest = Scene::of_nothing(began_ns);
    Observer::new(domain, "ctl-status", SCENES_HZ).run(stop.as_atomic(), |scene| {
        if has_seen_enough(&scene, began_ns) {
            stop.as_atomic().store(true, Ordering::Relaxed);
        }
        newest = scene;
    });
    let report = SceneReport::new(&newest, monotonic_ns(), &Zoned::now());
    match format {
        Format::Json => print_json(&report)?,
        Format::Text => report.lines().into_iter().try_for_each(print_line)?,
    }
    Ok(if report.well { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn has_seen_enough(scene: &Scene, began_ns: u64) -> bool {
    let waited_ns = scene.seen_ns.saturating_sub(began_ns);
    let has_nobody = scene.link == Link::Waiting && !scene.has_source && waited_ns >= NO_SERVER_NS;
    let has_read = scene.reading_since_ns.is_some_and(|since_ns| scene.seen_ns.saturating_sub(since_ns) >= LOOK_NS);
    has_nobody || waited_ns >= LONGEST_NS || has_read && scene.frame.is_some() && scene.status.is_some()
}
