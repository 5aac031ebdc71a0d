//! The summary of a show as it is printed at its end.

use super::files::Folder;
use super::summary::{RestartReport, Restarts, ShowSummary};
use crate::cli::flags::Format;
use crate::cli::print::{behind, print_json, print_line};
use crate::output::histogram::Percentiles;
use crate::output::terminal_text::Printable;
use bench_dragon_geometry::number::Fixed;

pub(super) fn print_summary(format: Format, summary: &ShowSummary, folder: &Folder) -> anyhow::Result<()> {
    if format == Format::Json {
        return print_json(summary);
    }
    let frames = &summary.frames;
    match &summary.contact {
        Some(contact) => {
            print_line(format_args!("first contact   {} s, {}", Fixed::<6>(contact.time_s), contact.who()))?;
        }
        None => print_line("first contact   none")?,
    }
    if let Some(guard) = &summary.guard {
        print_line(format_args!("held by guard   {} s{}", Fixed::<6>(guard.held_at_s), guard.details()))?;
    }
    if let Some(outcome) = &summary.outcome {
        print_line(format_args!("outcome         {}", outcome.text))?;
    }
    print_line(format_args!(
        "frames          {} published, {} monitored ({} missed), {} recorded ({} missed)",
        frames.published, frames.monitored, frames.missed_by_monitor, frames.recorded, frames.missed_by_recorder
    ))?;
    print_line(format_args!("lateness        {}", percentiles(&summary.lateness_us)))?;
    print_line(format_args!("latency         {}, from due to read by the monitor", percentiles(&summary.latency_us)))?;
    let behind = behind(summary.behind_s, summary.most_behind_s);
    print_line(format_args!("overruns        {}{behind}", summary.overruns))?;
    print_restarts(summary)?;
    print_line(format_args!("folder          {}", Printable(&folder.path)))?;
    if folder.report().exists() {
        print_line(format_args!("report          {}", Printable(&folder.report())))?;
    } else {
        print_line("report          not written")?;
    }
    Ok(())
}

/// Prints the number of restarts of each child, and one line per child that ended before the show.
fn print_restarts(summary: &ShowSummary) -> anyhow::Result<()> {
    if summary.restart_log.is_empty() {
        return Ok(());
    }
    let Restarts { serve, monitor, record, view, also } = &summary.restarts;
    let mut counts = vec![format!("{serve} serve"), format!("{monitor} monitor"), format!("{record} record")];
    let others = std::iter::once(("view", view)).chain(also.iter().map(|(name, count)| (name.as_str(), count)));
    counts.extend(others.filter(|(_, count)| **count > 0).map(|(name, count)| format!("{count} {name}")));
    print_line(format_args!("restarts        {}", counts.join(", ")))?;
    for RestartReport { role, reason, show_time_s, at, restarted } in &summary.restart_log {
        let time =
            show_time_s.map_or("before the first frame".to_owned(), |time_s| format!("at {} s", Fixed::<3>(time_s)));
        let given_up = if *restarted { "" } else { ", not started again" };
        print_line(format_args!("                {role} {time}, {at}: {reason}{given_up}"))?;
    }
    Ok(())
}

fn percentiles(Percentiles { p50, p99, p999, max }: &Percentiles) -> String {
    format!("p50 {p50:.1}  p99 {p99:.1}  p99.9 {p999:.1}  max {max:.1} \u{b5}s")
}
