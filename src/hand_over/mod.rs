//! What a choreographer hands over: the plan as files for those who build, dance and light the show.
//!
//! Every file is computed from the configuration alone, with a bound on its size. A file that would exceed its bound is left out, with
//! the reason.

mod benches;
mod figures;
mod player;
mod poses;

use std::borrow::Cow;

use bench_dragon_geometry::clearance::{first_meeting, first_within};
use bench_dragon_geometry::dragon::Meter;
use bench_dragon_geometry::number::Fixed;
use serde::Serialize;

use crate::config::Config;
use crate::output::dragon_colours;
use crate::output::figure::Paper;

/// Greatest number of moments: pages of the figures, and rows of a bench's sheet.
pub(crate) const MOST_MOMENTS: usize = 60;

/// A file that is handed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct File {
    /// Its name in the folder.
    pub(crate) name: &'static str,
    /// What it is, in a few words.
    pub(crate) what: &'static str,
}

/// All files, in the order in which people want them.
pub(crate) const FILES: [File; 15] = [
    File { name: "show.html", what: "the show in a browser, without a network" },
    File { name: "plan.pdf", what: "the plan: routes, stage, and all dragons at the start" },
    File { name: "plan.svg", what: "the same for drawing programs" },
    File { name: "plan.png", what: "the same as pixels" },
    File { name: "moments.pdf", what: "a page for each moment: start, cues, contact, end" },
    File { name: "floor.pdf", what: "the floor: what boards sweep, and where heads and tails are" },
    File { name: "floor.svg", what: "the same for drawing programs" },
    File { name: "floor.png", what: "the same as pixels" },
    File { name: "floor.dxf", what: "the floor in metres for CAD, with all handles at each moment" },
    File { name: "floor.csv", what: "the coordinates of all handles at each moment" },
    File { name: "benches.html", what: "a sheet for each bench: where it is at each moment, and how fast" },
    File { name: "benches.csv", what: "the same for programs" },
    File { name: "poses.xlsx", what: "positions and speeds of all handles, step by step" },
    File { name: "poses.csv", what: "the same for programs" },
    File { name: "config.toml", what: "the configuration with every key, which bench-dragon show plays" },
];

/// An instant of the plan that is worth a page.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Moment {
    pub(crate) name: String,
    /// Show time in seconds.
    pub(crate) time_s: f64,
    /// The cue's note, and whether the show waits there; `None` for another instant.
    pub(crate) cue: Option<(String, bool)>,
}

/// The first contact of a plan.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FirstContact {
    pub(crate) time_s: f64,
    /// The two benches in words.
    pub(crate) benches: String,
    /// The number of the dragon of each, and its index.
    pub(crate) places: [(usize, usize); 2],
}

/// A plan that is handed over.
#[derive(Debug)]
pub(crate) struct HandOver<'a> {
    config: &'a Config,
    title: String,
    paper: Paper,
    step_s: f64,
    meter: Meter,
    moments: Vec<Moment>,
    /// The first contact; an error is the show time in seconds up to which there is none, where finding it takes too much work.
    contact: Result<Option<FirstContact>, f64>,
}

/// What a plan is handed over with.
#[derive(Debug)]
pub(crate) struct Settings<'a> {
    /// The name of the show.
    pub(crate) title: String,
    /// Size of the figures.
    pub(crate) paper: Paper,
    /// Further moments, in seconds of show time.
    pub(crate) at_s: &'a [f64],
    /// Seconds between two poses of the tables.
    pub(crate) step_s: f64,
    /// The work for each answer.
    pub(crate) meter: Meter,
}

impl<'a> HandOver<'a> {
    /// Finds the first contact and the moments.
    ///
    /// # Errors
    /// A further moment is outside the run, or there are too many moments.
    pub(crate) fn of(config: &'a Config, settings: Settings<'_>) -> Result<Self, String> {
        let Settings { title, paper, at_s, step_s, meter } = settings;
        let (start_s, end_s) = (config.start_s(), config.end_s());
        if let Some(time_s) = at_s.iter().find(|time_s| !(start_s..=end_s).contains(time_s)) {
            return Err(format!("--at is {time_s}, must be from {start_s} to {end_s}, where the run ends"));
        }
        let contact = first_contact(config, &meter);
        let moments = moments(config, at_s, contact.as_ref().ok().and_then(Option::as_ref));
        if moments.len() > MOST_MOMENTS {
            return Err(format!(
                "start, cues, --at and end are {} moments, at most {MOST_MOMENTS} are allowed",
                moments.len()
            ));
        }
        Ok(Self { config, title, paper, step_s, meter, moments, contact })
    }

    /// The bytes of a file; an error is the reason for which it is left out.
    pub(crate) fn make(&self, file: File) -> Result<Vec<u8>, String> {
        let (stem, suffix) = file.name.split_once('.').unwrap_or_default();
        match (stem, suffix) {
            ("show", _) => player::html(self).map(String::into_bytes),
            ("plan", suffix) => figures::plan(self, suffix),
            ("moments", _) => figures::moments(self),
            ("floor", "csv") => Ok(benches::floor_csv(self)),
            ("floor", suffix) => figures::floor(self, suffix),
            ("benches", "html") => benches::html(self),
            ("benches", _) => benches::csv(self),
            ("poses", "xlsx") => poses::workbook(self),
            ("poses", _) => poses::csv(self),
            _ => Ok(self.config.to_toml().into_bytes()),
        }
    }

    pub(crate) fn contact(&self) -> Option<&FirstContact> {
        self.contact.as_ref().ok()?.as_ref()
    }

    /// Show time in seconds up to which a contact was searched for, if it was not to the end.
    pub(crate) fn searched_to_s(&self) -> Option<f64> {
        self.contact.as_ref().err().copied()
    }

    /// What is to be known about contacts: the first one, or how far none was found; `None` if there is none.
    pub(crate) fn attention(&self) -> Option<String> {
        match &self.contact {
            Ok(contact) => contact.as_ref().map(FirstContact::words),
            Err(searched_to_s) => {
                Some(format!("no contact before {} s; not searched further", Fixed::<3>(*searched_to_s)))
            }
        }
    }

    /// The names of the dragons; "dragon" of the only one.
    fn names(&self) -> Vec<Cow<'_, str>> {
        match self.config.named() {
            Some(named) => named.dragons().iter().map(|dragon| dragon.name.as_str().into()).collect(),
            None => vec!["dragon".into()],
        }
    }

    /// Red, green and blue of each dragon.
    fn colours(&self) -> Vec<[u8; 3]> {
        /// Sky blue, as the boards of figures.
        const ONLY: [u8; 3] = [0x56, 0xB4, 0xE9];
        self.config.named().map_or_else(|| vec![ONLY], dragon_colours)
    }
}

impl FirstContact {
    pub(crate) fn words(&self) -> String {
        format!("{} touch at {} s", self.benches, Fixed::<3>(self.time_s))
    }
}

/// The first contact; an error is the show time up to which there is none, where finding it takes too much work.
fn first_contact(config: &Config, meter: &Meter) -> Result<Option<FirstContact>, f64> {
    if let Some(named) = config.named() {
        let formation = named.formation().metered(meter);
        let meeting = first_meeting(&formation, 0.0, named.start_s(), formation.end_s());
        let Some(meeting) = meeting.map_err(|unfinished| unfinished.reached_s)? else { return Ok(None) };
        let benches = meeting.benches.map(|bench| {
            let (dragon, bench) = named.named_bench(bench);
            format!("{dragon} bench {bench}")
        });
        let places = meeting.benches.map(|bench| formation.layout().place(bench));
        return Ok(Some(FirstContact { time_s: meeting.time_s, benches: benches.join(" and "), places }));
    }
    let dragon = config.lead().metered(meter);
    let time_s = |travel_m| config.timetable().time_s(travel_m);
    let contact = first_within(&dragon, 0.0, dragon.start_travel_m(), dragon.end_travel_m());
    Ok(contact.map_err(|spent| time_s(spent.reached_m))?.map(|contact| {
        let [one, other] = contact.benches;
        let benches = format!("benches {one} and {other}");
        FirstContact { time_s: time_s(contact.travel_m), benches, places: [(0, one), (0, other)] }
    }))
}

/// The start, the cues, further times, the first contact and the end, in their order.
fn moments(config: &Config, at_s: &[f64], contact: Option<&FirstContact>) -> Vec<Moment> {
    let moment = |name: String, time_s: f64| Moment { name, time_s, cue: None };
    let mut moments = vec![moment("start".to_owned(), config.start_s()), moment("end".to_owned(), config.end_s())];
    moments.extend(config.cues().iter().map(|cue| Moment {
        name: cue.name.clone(),
        time_s: cue.at_s,
        cue: Some((cue.note.clone().unwrap_or_default(), cue.waits)),
    }));
    moments.extend(contact.map(|contact| moment("first contact".to_owned(), contact.time_s)));
    moments.extend(at_s.iter().map(|time_s| moment(format!("{time_s} s"), *time_s)));
    moments.sort_by(|one, other| one.time_s.total_cmp(&other.time_s));
    moments
}
