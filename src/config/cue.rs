//! Cues: what is planned to happen, in the order of plan time. `[[cues]]` of the document, and its meaning.
//!
//! A cue changes the planned speed of a dragon or of all, or makes the show wait until GO, or marks an instant. So cues shape the
//! timetables, and the place of every dragon still depends on plan time alone.

use std::collections::BTreeSet;

use bench_dragon_geometry::formation::{Change, Planned, Timetable};
use bench_dragon_geometry::number::{Fixed, Number};
use serde::{Deserialize, Serialize};

use super::{ConfigError, HEAD_SPEED_MPS};

/// Greatest number of cues.
pub const MAX_CUES: usize = 1000;
/// Longest name of a cue, in characters.
const MAX_NAME: usize = 48;
/// Longest note of a cue, in characters.
const MAX_NOTE: usize = 200;
/// Plan time by which a ramp may reach its speed after the next cue, in seconds: rounding of planned times.
const RAMP_TOLERANCE_S: f64 = 1e-6;

/// A cue as the document has it, not yet checked.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct CueTable {
    /// Its name, which is unique.
    pub name: String,
    /// Plan time in seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_s: Option<f64>,
    /// Travel of the dragon in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_m: Option<f64>,
    /// Name of the dragon; without one all, and `at_m` is the travel of the leading one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dragon: Option<String>,
    /// Planned speed from here on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_mps: Option<f64>,
    /// Whether the show waits here until GO.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub wait: bool,
    /// Text for operators.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// A checked cue.
#[derive(Clone, Debug, PartialEq)]
pub struct Cue {
    /// Its name, which is unique.
    pub name: String,
    /// Plan time in seconds.
    pub at_s: f64,
    /// Number of the dragon whose speed it changes; `None`: all.
    pub dragon: Option<usize>,
    /// Planned speed from here on, in metres per second.
    pub speed_mps: Option<f64>,
    /// Whether the show waits here until GO.
    pub waits: bool,
    /// Text for operators.
    pub note: Option<String>,
}

impl Cue {
    /// The cue as a document with plan times has it. `names` are those of the dragons.
    pub(super) fn table(&self, names: &[&str]) -> CueTable {
        let Self { name, at_s, dragon, speed_mps, waits, note } = self.clone();
        let dragon = dragon.map(|number| names[number].to_owned());
        CueTable { name, at_s: Some(at_s), at_m: None, dragon, speed_mps, wait: waits, note }
    }
}

/// A dragon of which cues change the timetable.
struct Cued<'a> {
    name: Option<&'a str>,
    planned: &'a Planned,
    changes: Vec<Change>,
}

impl Cued<'_> {
    fn timetable(&self) -> Timetable {
        self.timetable_to(self.planned.dragon.end_travel_m())
    }

    /// The timetable of a run that ends at a travel.
    fn timetable_to(&self, end_m: f64) -> Timetable {
        self.planned.timetable.with_changes(&self.changes, [self.planned.dragon.start_travel_m(), end_m])
    }

    /// Plan time at which its run ends, with the cues so far; infinity where it stands until a later cue.
    fn end_s(&self) -> f64 {
        let last = self.changes.iter().rev().find(|change| matches!(change, Change::Speed { .. }));
        let stands = matches!(last, Some(Change::Speed { speed_mps: 0.0, .. }));
        if stands { f64::INFINITY } else { self.timetable().end_s() }
    }

    /// The dragon in a message: ` of gold`, or nothing for the only one.
    fn suffix(&self) -> String {
        self.name.map_or_else(String::new, |name| format!(" of {name}"))
    }
}

/// Checks cues, and gives the dragons the timetables with them. `dragons` have names, or there is one without.
///
/// # Errors
/// The first cue that is not valid.
pub(super) fn apply(
    tables: &[CueTable],
    dragons: &[(Option<&str>, &Planned)],
) -> Result<(Vec<Cue>, Vec<Timetable>), ConfigError> {
    if tables.len() > MAX_CUES {
        let count = tables.len();
        return Err(ConfigError(format!("[[cues]] occurs {count} times, at most {MAX_CUES} are allowed")));
    }
    let cued = |&(name, planned)| Cued { name, planned, changes: Vec::new() };
    let mut dragons: Vec<Cued<'_>> = dragons.iter().map(cued).collect();
    let (mut names, mut cues) = (BTreeSet::new(), Vec::<Cue>::new());
    for (number, table) in (1..).zip(tables) {
        check_texts(number, table)?;
        let failed = |text: String| ConfigError(format!("[[cues]] \"{}\": {text}", table.name));
        if !names.insert(&table.name) {
            return Err(failed("the name occurs twice, must be unique".to_owned()));
        }
        let cue = cue(table, &dragons, cues.last()).map_err(failed)?;
        for (number, dragon) in dragons.iter_mut().enumerate() {
            if cue.waits {
                dragon.changes.push(Change::Rest { at_s: cue.at_s });
            }
            if let Some(speed_mps) = cue.speed_mps.filter(|_| cue.dragon.is_none_or(|named| named == number)) {
                dragon.changes.push(Change::Speed { at_s: cue.at_s, speed_mps });
            }
        }
        cues.push(cue);
    }
    let timetables: Vec<Timetable> = dragons.iter().map(Cued::timetable).collect();
    for (dragon, timetable) in dragons.iter().zip(&timetables) {
        require_reached(dragon, timetable, &cues)?;
    }
    Ok((cues, timetables))
}

fn check_texts(number: usize, table: &CueTable) -> Result<(), ConfigError> {
    let is_plain = |text: &str, longest: usize| text.chars().count() <= longest && !text.contains(char::is_control);
    if table.name.trim().is_empty() || !is_plain(&table.name, MAX_NAME) {
        let name = table.name.escape_debug();
        let text =
            format!("[[cues]] name of number {number} is \"{name}\", must be 1 to {MAX_NAME} printable characters");
        return Err(ConfigError(text));
    }
    match table.note.as_deref().filter(|note| !is_plain(note, MAX_NOTE)) {
        Some(_) => {
            let name = &table.name;
            Err(ConfigError(format!("[[cues]] \"{name}\": note must have at most {MAX_NOTE} printable characters")))
        }
        None => Ok(()),
    }
}

/// The cue of a table, after the one before it.
fn cue(table: &CueTable, dragons: &[Cued<'_>], last: Option<&Cue>) -> Result<Cue, String> {
    let dragon = table.dragon.as_deref().map(|name| number_of(name, dragons)).transpose()?;
    if let Some(speed_mps) =
        table.speed_mps.filter(|&speed_mps| speed_mps != 0.0 && !HEAD_SPEED_MPS.contains(&speed_mps))
    {
        let (value, least, most) = (Number(speed_mps), HEAD_SPEED_MPS.start(), HEAD_SPEED_MPS.end());
        return Err(format!("speed_mps is {value}, must be 0, or from {least} to {most}"));
    }
    let at_s = at_s(table, &dragons[dragon.unwrap_or(0)], dragons)?;
    if let Some(last) = last.filter(|last| last.at_s > at_s || table.wait && last.waits && last.at_s == at_s) {
        let (at, before) = (Fixed::<3>(at_s), Fixed::<3>(last.at_s));
        return Err(format!("it is at {at} s, must be after \"{}\" at {before} s", last.name));
    }
    let is_past = |dragon: &Cued<'_>| at_s >= dragon.end_s();
    if let Some(dragon) =
        dragon.map(|number| &dragons[number]).filter(|dragon| table.speed_mps.is_some() && is_past(dragon))
    {
        let end = Fixed::<3>(dragon.timetable().end_s());
        return Err(format!("it is at {} s, must be before the end{} at {end} s", Fixed::<3>(at_s), dragon.suffix()));
    }
    let (name, note) = (table.name.clone(), table.note.clone());
    Ok(Cue { name, at_s, dragon, speed_mps: table.speed_mps, waits: table.wait, note })
}

fn number_of(name: &str, dragons: &[Cued<'_>]) -> Result<usize, String> {
    dragons.iter().position(|dragon| dragon.name == Some(name)).ok_or_else(|| {
        let names: Vec<&str> = dragons.iter().filter_map(|dragon| dragon.name).collect();
        match &*names {
            [] => format!("dragon is \"{name}\", must be absent without [[dragons]]"),
            names => format!("dragon is \"{name}\", must be one of {}", names.join(", ")),
        }
    })
}

/// Plan time of a cue. For a wait at a travel, it is the time at which the head rests there.
fn at_s(table: &CueTable, dragon: &Cued<'_>, dragons: &[Cued<'_>]) -> Result<f64, String> {
    let (starts_s, ends_s) = (dragons.iter().map(|dragon| dragon.planned.timetable.start_s()), dragons.iter());
    match (table.at_s, table.at_m) {
        (Some(at_s), None) => {
            let begin_s = if dragon.name.is_some() { 0.0 } else { starts_s.fold(f64::INFINITY, f64::min) };
            let end_s = ends_s.map(Cued::end_s).fold(begin_s, f64::max);
            if (begin_s..end_s).contains(&at_s) {
                return Ok(at_s);
            }
            let (value, begin, end) = (Number(at_s), Number(begin_s), Fixed::<3>(end_s));
            Err(format!("at_s is {value}, must be at least {begin} and before the end of the plan at {end} s"))
        }
        (None, Some(at_m)) => {
            let timetable = dragon.timetable();
            let begin_m = timetable.travel_m(timetable.start_s());
            let end_m = dragon.planned.dragon.end_travel_m();
            if !(begin_m..end_m).contains(&at_m) {
                let (value, begin, end, of) = (Number(at_m), Number(begin_m), Fixed::<3>(end_m), dragon.suffix());
                return Err(format!("at_m is {value}, must be at least {begin} and before the end{of} at {end} m"));
            }
            Ok(if table.wait { dragon.timetable_to(at_m).end_s() } else { timetable.time_s(at_m) })
        }
        (None, None) => Err("at_s or at_m is missing".to_owned()),
        (Some(_), Some(_)) => Err("at_s and at_m exclude each other".to_owned()),
    }
}

/// Fails for a speed that no ramp reaches before the next cue, and for a dragon that stands for ever.
fn require_reached(dragon: &Cued<'_>, timetable: &Timetable, cues: &[Cue]) -> Result<(), ConfigError> {
    let named = |at_s: f64| cues.iter().find(|cue| cue.at_s == at_s).map_or("", |cue| cue.name.as_str());
    let of = dragon.suffix();
    let mut changes = dragon.changes.iter().peekable();
    while let Some(change) = changes.next() {
        let &Change::Speed { at_s, speed_mps } = change else { continue };
        let next_s = changes.peek().map_or_else(|| timetable.end_s(), |next| next.at_s());
        if speed_mps == 0.0
            && !changes.clone().any(|later| matches!(later, Change::Speed { speed_mps, .. } if *speed_mps > 0.0))
        {
            let text = format!("[[cues]] \"{}\": speed_mps is 0{of}, and no later cue lets it walk on", named(at_s));
            return Err(ConfigError(text));
        }
        let is_reached = timetable.reaches_speed(speed_mps, [at_s, next_s + RAMP_TOLERANCE_S]);
        if !is_reached && at_s >= timetable.start_s() {
            let before =
                changes.peek().map_or_else(|| "the end".to_owned(), |next| format!("\"{}\"", named(next.at_s())));
            let (name, speed) = (named(at_s), Number(speed_mps));
            let text = format!("[[cues]] \"{name}\": speed_mps is {speed}{of}, and no ramp reaches it before {before}");
            return Err(ConfigError(text));
        }
    }
    Ok(())
}
