//! `ctl cues`, and the names of cues.

use std::process::ExitCode;
use std::sync::atomic::Ordering;

use anyhow::{Context as _, bail};
use bench_dragon_geometry::number::{Fixed, Number};
use bench_dragon_ipc::Domain;
use bench_dragon_ipc::source::ShowLock;

use crate::cli::bus_readers::Descriptions;
use crate::cli::flags::{BadInput, Format};
use crate::cli::print::{print_bytes, print_json, print_line};
use crate::config::PlannedCues;
use crate::display::observe::{CueList, ListedCue, Members, Observer, Snapshot};
use crate::output::table::{Column, Table, text};
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

/// Snapshots per second.
const SNAPSHOTS_HZ: u32 = 20;
/// Longest wait for a show, in nanoseconds.
const NOBODY_NS: u64 = 500_000_000;
/// Longest wait for a frame of a show, with its description, in seconds. A busy machine may need some.
const LONGEST_S: u64 = 30;

/// Prints the cues of the running show.
pub(super) fn run(domain: &Domain, format: Format) -> anyhow::Result<ExitCode> {
    let (stop, began_ns) = (StopFlag::on_signals()?, monotonic_ns());
    let has_found_source = Members::of(domain).has_source;
    // A show is there without a source while it starts, and while it starts a killed server again.
    let is_there = |snapshot: &Snapshot| has_found_source || snapshot.has_source || ShowLock::holder(domain).is_some();
    let (mut newest, mut is_late) = (Snapshot::default(), false);
    Observer::new(domain.clone(), "ctl-cues", SNAPSHOTS_HZ).run(stop.as_atomic(), |snapshot| {
        let longest_ns = if is_there(&snapshot) { LONGEST_S * 1_000_000_000 } else { NOBODY_NS };
        is_late = snapshot.seen_ns.saturating_sub(began_ns) >= longest_ns;
        if has_plan(&snapshot) || is_late {
            stop.as_atomic().store(true, Ordering::Relaxed);
        }
        newest = snapshot;
    });
    if !has_plan(&newest) {
        let instance = domain.instance();
        if !is_late {
            // A signal has ended the wait.
            return Ok(ExitCode::FAILURE);
        }
        if is_there(&newest) {
            bail!("no frame and description of the show on instance {instance} within {LONGEST_S} s");
        }
        bail!("no show runs on instance {instance}");
    }
    let list = CueList::of(&newest).unwrap_or_default();
    match format {
        Format::Json => print_json(&list)?,
        Format::Text => print_list(&list)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// Whether a snapshot has a frame, and the description of its run.
fn has_plan(snapshot: &Snapshot) -> bool {
    snapshot.run.is_some() && snapshot.frame.is_some()
}

fn print_list(list: &CueList) -> anyhow::Result<()> {
    if list.cues.is_empty() {
        print_line("the show has no cues")?;
        return Ok(());
    }
    let number = Column::number("plan time, s", 3);
    let columns = [Column::text("cue"), number, Column::text("effect"), Column::text("state"), Column::text("note")];
    let mut table = Table::new("cues", columns.into());
    for cue in &list.cues {
        let note = cue.note.clone().unwrap_or_default();
        table.push(vec![
            cue.name.clone().into(),
            cue.at_s.into(),
            effect(cue).into(),
            cue.state.name().into(),
            note.into(),
        ]);
    }
    print_bytes(text(&[table]))?;
    if let (Some(next), Some(wait_s)) = (list.next_cue(), list.next_in_s) {
        print_line(format_args!("next: {} in {} s", next.name, Fixed::<1>(wait_s)))?;
    }
    Ok(())
}

/// What a cue changes, in words.
fn effect(cue: &ListedCue) -> String {
    let of = cue.dragon.as_ref().map_or_else(String::new, |dragon| format!("{dragon} "));
    let speed = cue.speed_mps.map(|speed_mps| format!("{of}{} m/s", Number(speed_mps)));
    let wait = cue.waits.then(|| "waits for GO".to_owned());
    wait.into_iter().chain(speed).collect::<Vec<_>>().join(", ")
}

/// Plan time of a cue of the running show, in seconds.
pub(super) fn time_of(domain: &Domain, name: &str, stop: &StopFlag) -> anyhow::Result<f64> {
    let descriptions = Descriptions::open(domain, "ctl-cues", stop)?;
    let description =
        descriptions.latest().with_context(|| format!("no show runs on instance {}", domain.instance()))?;
    let cues = PlannedCues::of_toml(&description.toml);
    let unknown = || BadInput(format!("--cue is \"{}\": {}", name.escape_debug(), cues.allowed_names()));
    Ok(cues.named(name).ok_or_else(unknown)?.at_s)
}
