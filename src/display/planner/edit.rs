//! An edit: what a hand did to a plan. It becomes changes of the text.

use bench_dragon_geometry::route::{PathSpec, Placement, RouteShape};
use glam::DVec2;
use serde::Deserialize;

use super::change::{Change, Keys, Owner, Put};
use super::handle::{HandleId, HandleKind, documents};
use super::route_edit::{self, NewSegment};
use super::stage_handles::{self, NewBorder};
use super::{dragon_edit, path_handles, spiral_handles, toml_text};
use crate::config::{Config, ConfigDocument};

/// What a hand did.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Edit {
    /// A handle is dragged to a point.
    Move {
        handle: HandleId,
        to_m: [f64; 2],
    },
    /// A corner is taken out.
    Delete {
        handle: HandleId,
    },
    /// A number is typed.
    Set {
        keys: Keys,
        value: f64,
    },
    /// An answer of the planner, or a fix, is put into the plan.
    Put {
        puts: Vec<Put>,
    },
    /// A path becomes its mirror image, is walked the other way round, or is closed.
    Mirror {
        dragon: usize,
    },
    Reverse {
        dragon: usize,
    },
    Close {
        dragon: usize,
    },
    /// A path gets a segment, after the one of a number, or at its end.
    Insert {
        dragon: usize,
        after: Option<usize>,
        segment: NewSegment,
    },
    /// A new route goes through corners.
    Through {
        dragon: usize,
        points_m: Vec<[f64; 2]>,
        radius_m: f64,
    },
    /// A border of the stage is drawn.
    Border {
        border: NewBorder,
        points_m: Vec<[f64; 2]>,
    },
    /// A dragon comes, or goes.
    AddDragon,
    RemoveDragon {
        dragon: usize,
    },
}

impl Edit {
    /// The text after the edit of a text, whose configuration is this.
    ///
    /// # Errors
    /// The text has no such place, in one line.
    pub(super) fn apply(&self, text: &str, config: &Config) -> Result<String, String> {
        match *self {
            Self::AddDragon => return dragon_edit::added(text, config),
            Self::RemoveDragon { dragon } => return dragon_edit::removed(text, dragon),
            _ => {}
        }
        let changes = self.changes(text, config).ok_or_else(|| self.reason().to_owned())?;
        toml_text::changed(text, &changes)
    }

    /// Why there is no such change.
    fn reason(&self) -> &'static str {
        match self {
            Self::Mirror { .. } | Self::Reverse { .. } | Self::Close { .. } | Self::Insert { .. } => {
                "this needs an open path of lines, arcs and spirals that is not a drawing"
            }
            Self::Through { .. } => {
                "a route needs at least two points, and no corner may turn back by more than 170°: press the two sides of a U-turn apart"
            }
            _ => "this point is no longer in the plan",
        }
    }

    fn changes(&self, text: &str, config: &Config) -> Option<Vec<Change>> {
        match self {
            Self::Mirror { dragon } => {
                let (owner, path, _) = path_of(config, *dragon)?;
                Some(route_edit::mirrored(owner, &path.segments))
            }
            Self::Reverse { dragon } => {
                let (owner, path, begin) = path_of(config, *dragon)?;
                Some(route_edit::reversed(owner, &path.segments, begin))
            }
            Self::Close { dragon } => {
                let (owner, path, begin) = path_of(config, *dragon)?;
                route_edit::closed(owner, &path.segments, begin)
            }
            Self::Insert { dragon, after, segment } => {
                let (owner, path, _) = path_of(config, *dragon)?;
                Some(route_edit::longer(owner, &path.segments, *after, *segment))
            }
            Self::Through { dragon, points_m, radius_m } => {
                let (owner, _) = documents(config).into_iter().nth(*dragon)?;
                let points: Vec<DVec2> = points_m.iter().copied().map(DVec2::from_array).collect();
                Some(vec![route_edit::through(owner, &points, *radius_m)?.into()])
            }
            Self::Border { border, points_m } => Some(vec![stage_handles::drawn(text, *border, points_m)]),
            Self::AddDragon | Self::RemoveDragon { .. } => None,
            Self::Set { keys, value } => Some(vec![Change::Set { keys: keys.clone(), value: *value }]),
            Self::Put { puts } => Some(puts.iter().cloned().map(Change::from).collect()),
            Self::Move { handle, to_m } => moved(config, *handle, DVec2::from_array(*to_m)),
            Self::Delete { handle } if handle.kind.border().is_some() => {
                Some(vec![stage_handles::deleted(text, *handle)?])
            }
            Self::Delete { handle } => {
                let (owner, document) = document(config, *handle)?;
                let path = open_path(document)?;
                path_handles::deleted(owner, &path.segments, &document.route().placement, *handle)
            }
        }
    }
}

fn moved(config: &Config, id: HandleId, to: DVec2) -> Option<Vec<Change>> {
    if let Some(border) = id.kind.border() {
        return Some(if id.kind == border {
            stage_handles::moved(id, to)
        } else {
            stage_handles::inserted(id, border, to)
        });
    }
    let (owner, document) = document(config, id)?;
    let begin = &document.route().placement;
    match &document.route().shape {
        RouteShape::Spiral(spiral) => spiral_handles::moved_of_spiral(owner, spiral, begin, id, to),
        RouteShape::Turnaround(_) => spiral_handles::moved_of_turnaround(owner, begin, id, to),
        RouteShape::Path(_) => match open_path(document) {
            Some(path) => path_handles::moved(owner, &path.segments, begin, id, to),
            None => path_handles::moved(owner, &[], begin, id, to).filter(|_| id.kind == HandleKind::Whole),
        },
    }
}

fn document(config: &Config, id: HandleId) -> Option<(Owner, &ConfigDocument)> {
    documents(config).into_iter().nth(id.dragon)
}

/// The open path of a dragon, and where it begins.
fn path_of(config: &Config, dragon: usize) -> Option<(Owner, &PathSpec, &Placement)> {
    let (owner, document) = documents(config).into_iter().nth(dragon)?;
    Some((owner, open_path(document)?, &document.route().placement))
}

/// The path whose segments the text has; `None` for a drawing and for a closed path, whose measures depend on each other.
fn open_path(document: &ConfigDocument) -> Option<&PathSpec> {
    let path = document.route().as_path()?;
    (document.drawing().is_none() && path.laps.is_none()).then_some(path)
}
