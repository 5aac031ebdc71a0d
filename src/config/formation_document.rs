//! `[[dragons]]`: several dragons on one clock. Each entry has the keys of `[dragon]`, its own `[dragons.route]` and
//! `[dragons.head]`, and is checked as the configuration of one dragon with the other tables of the file.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use bench_dragon_geometry::clearance::standing_in_each_other;
use bench_dragon_geometry::dragon::MAX_BENCHES;
use bench_dragon_geometry::formation::{Formation, Planned, Timetable};
use bench_dragon_ipc::MAX_DRAGONS;
use bench_dragon_ipc::service::MAX_DESCRIPTION_LEN;
use toml::{Table, Value};

use super::cue::{self, Cue, CueTable};
use super::document::{Document, HeadTable};
use super::dragon_entry::DragonEntry;
use super::origin_table::OriginTable;
use super::{Config, ConfigDocument, ConfigError, require};

/// Allowed numbers of dragons.
const DRAGONS: RangeInclusive<usize> = 1..=MAX_DRAGONS;
/// Longest name of a dragon, in characters.
const MAX_NAME: usize = 24;
/// Allowed plan times at which a head leaves, in seconds.
const LEAVES_S: RangeInclusive<f64> = 0.0..=1e6;

/// A dragon of a formation.
#[derive(Clone, Debug)]
pub struct NamedDragon {
    /// Its name, which is unique.
    pub name: String,
    /// Red, green and blue of its colour, if the configuration has one.
    pub colour: Option<[u8; 3]>,
    /// Its configuration, as if it were alone.
    pub config: Config,
}

/// A valid configuration of several dragons.
#[derive(Clone, Debug)]
pub struct FormationDocument {
    dragons: Vec<NamedDragon>,
    formation: Arc<Formation>,
    cue_tables: Vec<CueTable>,
    cues: Arc<[Cue]>,
}

impl FormationDocument {
    /// Builds the formation of a document with `[[dragons]]`. `folder` is that of the configuration.
    ///
    /// # Errors
    /// There are too many dragons, a name is not valid or occurs twice, or the table of a dragon is not valid.
    pub(super) fn build(mut tables: Document, folder: &Path, placing_steps: Option<u64>) -> Result<Self, ConfigError> {
        let entries = tables.dragons.take().unwrap_or_default();
        let cue_tables = std::mem::take(&mut tables.cues);
        require_no_short_form(&tables)?;
        // Otherwise the message would name the first dragon.
        tables.stage.stage()?;
        if !DRAGONS.contains(&entries.len()) {
            let (count, least, most) = (entries.len(), DRAGONS.start(), DRAGONS.end());
            return Err(ConfigError(format!("[[dragons]] occurs {count} times, must occur {least} to {most} times")));
        }
        let mut names = BTreeSet::new();
        let mut dragons = Vec::new();
        let mut planned = Vec::new();
        for (number, entry) in (1..).zip(entries) {
            let name = name_of(&entry, number)?;
            if !names.insert(name.clone()) {
                return Err(ConfigError(format!("[[dragons]] name is \"{name}\" twice, must be unique")));
            }
            let of_dragon = |ConfigError(text): ConfigError| ConfigError(format!("dragon {name}: {text}"));
            let (dragon, timetable) = named(&name, entry, &tables, folder, placing_steps).map_err(of_dragon)?;
            planned.push(Planned { dragon: Arc::clone(dragon.config.lead()), timetable });
            dragons.push(dragon);
        }
        let names = dragons.iter().map(|dragon| Some(&*dragon.name));
        let (cues, timetables) = cue::apply(&cue_tables, &names.zip(&planned).collect::<Vec<_>>())?;
        for (planned, timetable) in planned.iter_mut().zip(timetables) {
            planned.timetable = timetable;
        }
        let names: Vec<&str> = dragons.iter().map(|dragon| &*dragon.name).collect();
        let cue_tables = cues.iter().map(|cue| cue.table(&names)).collect();
        let formation = Formation::new(planned);
        let benches = formation.layout().benches();
        if benches > MAX_BENCHES {
            let text = format!("[[dragons]] have {benches} benches together, at most {MAX_BENCHES} are allowed");
            return Err(ConfigError(text));
        }
        let document = Self { dragons, formation: Arc::new(formation), cue_tables, cues: cues.into() };
        let written = document.to_toml().len();
        if written > MAX_DESCRIPTION_LEN {
            return Err(ConfigError(format!(
                "[[dragons]] take {written} bytes in all, at most {MAX_DESCRIPTION_LEN} are allowed: use fewer segments or heights"
            )));
        }
        Ok(document)
    }

    /// The whole configuration as TOML, with every key that applies. Heights that were read from a file are written for each dragon.
    pub fn to_toml(&self) -> String {
        let written = |config: &Config| {
            Table::try_from(config.tables()).expect("the document has only tables of numbers and strings")
        };
        let mut all = written(&self.dragons[0].config);
        for key in ["dragon", "route", "head", "ground"] {
            all.remove(key);
        }
        let entries = self.dragons.iter().zip(self.formation.dragons()).map(|(dragon, planned)| {
            let mut tables = written(&dragon.config);
            let mut taken = |key: &str| match tables.remove(key) {
                Some(Value::Table(table)) => table,
                _ => Table::new(),
            };
            let (mut entry, mut head) = (taken("dragon"), taken("head"));
            head.insert("start_s".to_owned(), planned.timetable.start_s().into());
            entry.insert("name".to_owned(), dragon.name.clone().into());
            if let Some([red, green, blue]) = dragon.colour {
                entry.insert("colour".to_owned(), format!("#{red:02x}{green:02x}{blue:02x}").into());
            }
            entry.insert("head".to_owned(), head.into());
            for key in ["route", "ground"] {
                if let Some(table) = tables.remove(key) {
                    entry.insert(key.to_owned(), table);
                }
            }
            Value::from(entry)
        });
        all.insert("dragons".to_owned(), entries.collect::<Vec<Value>>().into());
        if !self.cue_tables.is_empty() {
            let cues = Value::try_from(&self.cue_tables).expect("the cues have only numbers and strings");
            all.insert("cues".to_owned(), cues);
        }
        toml::to_string(&all).expect("the document has only tables of numbers and strings")
    }

    /// The same configuration, in which each dragon leaves at another plan time.
    #[must_use]
    pub fn leaving_at(&self, starts_s: &[f64]) -> Self {
        Self { formation: Arc::new(self.formation.leaving_at(starts_s)), ..self.clone() }
    }

    /// Fails for dragons that stand in each other before the first of them leaves. The planner answers where such dragons touch; a
    /// server has nothing to play.
    ///
    /// # Errors
    /// The two dragons, and a bench of each.
    pub fn require_apart(&self) -> Result<(), ConfigError> {
        let Some(benches) = standing_in_each_other(&self.formation) else { return Ok(()) };
        let [(one, index), (other, of_other)] = benches.map(|bench| self.named_bench(bench));
        Err(ConfigError(format!(
            "[[dragons]] {one} and {other} stand in each other at the start, benches {index} and {of_other}: begin a route elsewhere"
        )))
    }

    /// The dragons, the leading one first.
    pub fn dragons(&self) -> &[NamedDragon] {
        &self.dragons
    }

    /// All dragons on their routes.
    pub fn formation(&self) -> &Arc<Formation> {
        &self.formation
    }

    /// The name of the dragon of a bench that is numbered on from dragon to dragon, and its index within that dragon.
    pub fn named_bench(&self, bench: usize) -> (&str, usize) {
        let (dragon, index) = self.formation.layout().place(bench);
        (&self.dragons[dragon].name, index)
    }

    /// Plan time at which the first dragon leaves, in seconds.
    pub fn start_s(&self) -> f64 {
        self.formation.dragons().iter().map(|planned| planned.timetable.start_s()).fold(f64::INFINITY, f64::min)
    }

    /// The cues, in the order of plan time.
    pub fn cues(&self) -> &Arc<[Cue]> {
        &self.cues
    }
}

/// Fails for a document that also has the short form for one dragon.
fn require_no_short_form(tables: &Document) -> Result<(), ConfigError> {
    let plain = Document::default();
    let short = [
        ("dragon", tables.dragon != plain.dragon),
        ("route", tables.route != plain.route),
        ("head", tables.head != plain.head),
    ];
    match short.into_iter().find(|(_, is_set)| *is_set) {
        Some(("dragon", _)) => {
            let text = "[dragon] and [[dragons]] exclude each other: put its keys into each entry of [[dragons]]";
            Err(ConfigError(text.to_owned()))
        }
        Some((table, _)) => Err(ConfigError(format!(
            "[{table}] and [[dragons]] exclude each other: use [dragons.{table}] in each entry"
        ))),
        None => Ok(()),
    }
}

fn name_of(entry: &DragonEntry, number: usize) -> Result<String, ConfigError> {
    let allowed = "1 to 24 of a–z, 0–9 and -";
    let Some(name) = &entry.name else {
        return Err(ConfigError(format!("[[dragons]] name of number {number} is missing, must be {allowed}")));
    };
    let is_plain = |char: char| char.is_ascii_lowercase() || char.is_ascii_digit() || char == '-';
    match name.as_str() {
        Some(text) if (1..=MAX_NAME).contains(&text.len()) && text.chars().all(is_plain) => Ok(text.to_owned()),
        _ => Err(ConfigError(format!("[[dragons]] name of number {number} is {name}, must be {allowed}"))),
    }
}

fn colour_of(value: Option<Value>) -> Result<Option<[u8; 3]>, ConfigError> {
    let Some(value) = value else { return Ok(None) };
    let digits = value
        .as_str()
        .and_then(|text| text.strip_prefix('#'))
        .filter(|digits| digits.len() == 6 && digits.chars().all(|digit| digit.is_ascii_hexdigit()));
    let number = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
    let Some([_, red, green, blue]) = number.map(u32::to_be_bytes) else {
        return Err(ConfigError(format!("colour is {value}, must be as \"#c8a04a\"")));
    };
    Ok(Some([red, green, blue]))
}

/// The dragon of an entry, and its travel over plan time.
fn named(
    name: &str,
    entry: DragonEntry,
    shared: &Document,
    folder: &Path,
    placing_steps: Option<u64>,
) -> Result<(NamedDragon, Timetable), ConfigError> {
    let DragonEntry { colour, dragon, route, head, start_s: leaves_s, ground, .. } = entry;
    let colour = colour_of(colour)?;
    require("head", "start_s", leaves_s, &LEAVES_S)?;
    let ground = ground.filter(|ground| !ground.is_empty()).unwrap_or_else(|| shared.ground.clone());
    let mut tables = Document { dragon, route, ground, head, ..shared.clone() };
    // Another dragon may be drawn.
    if !tables.route.is_drawing() && !tables.ground.is_file() {
        tables.origin = OriginTable::default();
    }
    let document = ConfigDocument::of_tables(tables, folder)?;
    let document = placing_steps.into_iter().fold(document, ConfigDocument::with_placing_steps);
    if document.dimensions().play_m() > 0.0 {
        let poles = "[dragon] pole_diameter_m: hinges of several dragons have no play: remove it";
        return Err(ConfigError(poles.to_owned()));
    }
    let config = document.build()?;
    let HeadTable { speed_mps, accel_mps2 } = config.tables().head;
    let (start_m, end_m) = (config.lead().start_travel_m(), config.lead().end_travel_m());
    let timetable = Timetable::leaving(leaves_s, start_m, speed_mps, accel_mps2, end_m);
    Ok((NamedDragon { name: name.to_owned(), colour, config }, timetable))
}
