//! Shows with killed children, and killed shows.

use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use bench_dragon::recording::repair;
use rustix::process::Signal;
use serde_json::Value;
use test_support::children::{children, send};
use test_support::eventually::before_deadline;
use test_support::process::Process;

use crate::books::{Books, Phase};
use crate::random::Random;
use crate::stage::Stage;
use crate::troupe::{Failure, START_UP};

/// Commands of a show's children.
const CHILDREN: [&str; 3] = ["serve", "monitor", "record"];
/// Longest time between two kills in a playing show.
const BETWEEN: Duration = Duration::from_millis(400);
/// Greatest number of kills in one show: a show restarts each child a limited number of times.
const MOST_KILLS: usize = 4;

/// Plays shows one after another on a stage, with this many kills.
pub(crate) fn play_shows(stage: &Stage, random: &mut Random, kills: u32, books: &mut Books) -> Result<(), Failure> {
    let (end, mut number) = (books.kills() + kills, 0);
    while books.kills() < end {
        // The next show uses another folder. The recorder of a killed show may still be finishing its file.
        number += 1;
        play_show(stage, number, random, end - books.kills(), books)?;
    }
    Ok(())
}

fn play_show(stage: &Stage, number: u32, random: &mut Random, most: u32, books: &mut Books) -> Result<(), Failure> {
    let folder = format!("show-{number}");
    let args = ["show", "--rate", "200", "--auto-resume", "--format", "json", "--out", &folder];
    let show = stage.start(&args);
    let mut killed = Vec::new();
    for _ in 0..(1 + random.below(MOST_KILLS)).min(most as usize) {
        let longest = if random.percent(40) { START_UP } else { BETWEEN };
        thread::sleep(random.up_to(longest));
        // A killed child may take some time to end.
        let running: Vec<_> = children(show.pid()).into_iter().filter(|(pid, _)| !killed.contains(pid)).collect();
        let phase = if running.len() == CHILDREN.len() { Phase::Playing } else { Phase::Starting };
        if random.percent(25) {
            let pid = show.pid();
            show.kill();
            books.kill("show", phase);
            return await_orphans(pid, random);
        }
        let Some((pid, name)) = (!running.is_empty()).then(|| running[random.below(running.len())].clone()) else {
            continue;
        };
        if send(pid, Signal::KILL).is_ok() {
            let name = CHILDREN.into_iter().find(|child| *child == name).expect("a show has no other children");
            books.kill(name, phase);
            killed.push(pid);
        }
    }
    end_show(stage, show, &killed, books)
}

/// Waits until the children of a killed show have ended, or, in half of the cases, returns at once.
fn await_orphans(show: u32, random: &mut Random) -> Result<(), Failure> {
    if random.percent(50) {
        return Ok(());
    }
    before_deadline(|| {
        let running = children(show);
        if running.is_empty() { Ok(()) } else { Err(format!("the children of a killed show still run: {running:?}")) }
    })
}

/// Waits until all children run again, ends the show, and checks its report.
fn end_show(stage: &Stage, show: Process, killed: &[u32], books: &mut Books) -> Result<(), Failure> {
    let pid = show.pid();
    // A killed child may take some time to end.
    let running = || children(pid).iter().filter(|(child, _)| !killed.contains(child)).count();
    if before_deadline(|| (running() >= CHILDREN.len()).then_some(()).ok_or(())).is_err() {
        show.signal(Signal::INT);
        return Err(format!("a show does not restart its children: {}", show.end().stderr));
    }
    let echo = stage.run(&["echo", "--count", "5"]);
    if echo.code() != Some(0) {
        return Err(format!("a reader of a show: {}", echo.stderr));
    }
    show.signal(Signal::INT);
    let ended = show.end();
    books.complain(&ended.stderr.lines().map(str::to_owned).collect::<Vec<_>>());
    let summary = ended.json_lines().pop().unwrap_or_default();
    let restarts: u64 = CHILDREN.iter().filter_map(|child| summary["restarts"][child].as_u64()).sum();
    let frames = |name: &str| summary["frames"][name].as_u64();
    let is_fine = ended.code() == Some(0)
        && restarts == killed.len() as u64
        && frames("monitored") <= frames("published")
        && frames("recorded") <= frames("published")
        && children(pid).is_empty();
    if !is_fine {
        return Err(format!("a show of {} killed children: {summary}\n{}", killed.len(), ended.stderr));
    }
    let recorded = read_recordings(stage, &summary, books)?;
    if frames("recorded") == Some(recorded) {
        Ok(())
    } else {
        Err(format!("{recorded} frames are in the recordings, but {summary}"))
    }
}

/// Counts the frames of a show's recordings. Fails unless all are whole.
fn read_recordings(stage: &Stage, summary: &Value, books: &mut Books) -> Result<u64, Failure> {
    let mut recorded = 0;
    for name in summary["recordings"].as_array().into_iter().flatten() {
        let path: PathBuf = stage.path(name.as_str().unwrap_or_default());
        let repaired = repair(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        if repaired.was_unfinished {
            return Err(format!("{} was not finished by its show", path.display()));
        }
        recorded += repaired.frames;
        books.recordings += 1;
    }
    books.recorded += recorded;
    Ok(recorded)
}
