//! `doctor`: what stands in the way of a show, and how to mend it.

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context as _;
use bench_dragon_ipc::{BusError, Cleared, Domain, NodeEntry, clear};
use clap::builder::styling::{AnsiColor, Style};

use crate::cli::{DoctorArgs, Format};
use crate::command::load_config;
use crate::command::print::{print_json, print_line};
use crate::config::Overrides;
use crate::output::terminal_text::Painted;
use crate::system::doctor::{Examination, Examined, Target, Verdict};

pub(crate) fn run(args: &DoctorArgs) -> anyhow::Result<ExitCode> {
    let config = load_config(&args.config, Overrides::default())?;
    let fixed = if args.fix {
        Domain::new(args.bus.instance.clone()).map_err(BusError::from).and_then(|domain| clear(&domain))
    } else {
        Ok(Cleared::default())
    };
    let (fixed, failed) = match fixed {
        Ok(cleared) => (lines(&cleared), None),
        // What is wrong with the directory is among the findings.
        Err(BusError::Domain(_)) => (Vec::new(), None),
        Err(error) => (Vec::new(), Some(error)),
    };
    let target = Target::new(args.bus.instance.clone(), config, PathBuf::from("."));
    let examination = Examination::of(&target, fixed);
    match args.format.format {
        Format::Json => print_json(&examination)?,
        Format::Text => print_text(&examination)?,
    }
    match failed {
        Some(error) => Err(error).context("cannot clean up"),
        None if examination.healthy => Ok(ExitCode::SUCCESS),
        None => Ok(ExitCode::FAILURE),
    }
}

/// What was cleaned up, a line each.
fn lines(cleared: &Cleared) -> Vec<String> {
    let node = |node: &NodeEntry| match node.pid {
        Some(pid) => format!("removed the entry of {}, pid {pid}, which was killed", node.name),
        None => "removed the entry of a process that was killed".to_owned(),
    };
    let paths = cleared.paths.iter().map(|path| format!("removed {}", path.display()));
    cleared.nodes.iter().map(node).chain(paths).collect()
}

/// A line for each check, and a second one where there is something to mend.
fn print_text(examination: &Examination) -> anyhow::Result<()> {
    for line in &examination.fixed {
        print_line(line)?;
    }
    for Examined { name, finding } in &examination.checks {
        let status = Painted::on(&io::stdout(), style(finding.status), format!("{:<9}", finding.status));
        print_line(format_args!("{status}  {name:<20}  {}", finding.message))?;
        if let Some(remedy) = &finding.remedy {
            print_line(format_args!("{:<9}  {:<20}  mend: {remedy}", "", ""))?;
        }
    }
    Ok(())
}

fn style(verdict: Verdict) -> Style {
    match verdict {
        Verdict::Ok => AnsiColor::Green.on_default(),
        Verdict::Warning => AnsiColor::Yellow.on_default(),
        Verdict::Problem => AnsiColor::Red.on_default().bold(),
        Verdict::NotKnown => Style::new().dimmed(),
    }
}
