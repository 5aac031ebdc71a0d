//! An edit: what a hand did to a plan. It becomes changes of the text.

use bench_dragon_geometry::route::{PathSpec, RouteShape};
use glam::DVec2;
use serde::Deserialize;

use super::change::{Change, Keys, Owner};
use super::handle::{HandleId, HandleKind, documents};
use super::{path_handles, spiral_handles, stage_handles, toml_text};
use crate::config::{Config, ConfigDocument};

/// What a hand did.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Edit {
    /// A handle is dragged to a point.
    Move { handle: HandleId, to_m: [f64; 2] },
    /// A corner is taken out.
    Delete { handle: HandleId },
    /// A number is typed.
    Set { keys: Keys, value: f64 },
}

impl Edit {
    /// The text after the edit of a text, whose configuration is this.
    ///
    /// # Errors
    /// The text has no such place, in one line.
    pub(super) fn apply(&self, text: &str, config: &Config) -> Result<String, String> {
        let changes = self.changes(config).ok_or("this point is no longer in the plan")?;
        toml_text::changed(text, &changes)
    }

    fn changes(&self, config: &Config) -> Option<Vec<Change>> {
        match self {
            Self::Set { keys, value } => Some(vec![Change::Set { keys: keys.clone(), value: *value }]),
            Self::Move { handle, to_m } => moved(config, *handle, DVec2::from_array(*to_m)),
            Self::Delete { handle } => {
                let (owner, document) = document(config, *handle)?;
                let path = open_path(document)?;
                path_handles::deleted(owner, &path.segments, &document.route().placement, *handle)
            }
        }
    }
}

fn moved(config: &Config, id: HandleId, to: DVec2) -> Option<Vec<Change>> {
    if matches!(id.kind, HandleKind::Outline | HandleKind::KeepOut | HandleKind::Crowd) {
        return Some(stage_handles::moved(id, to));
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

/// The path whose segments the text has; `None` for a drawing and for a closed path, whose measures depend on each other.
fn open_path(document: &ConfigDocument) -> Option<&PathSpec> {
    let path = document.route().as_path()?;
    (document.drawing().is_none() && path.laps.is_none()).then_some(path)
}
