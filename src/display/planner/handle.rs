//! The points of a plan that a hand may drag.

use bench_dragon_geometry::route::{Placement, RouteShape};
use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::change::{Change, Keys, Owner, heading_deg, rounded_m};
use super::{path_handles, spiral_handles, stage_handles};
use crate::config::{Config, ConfigDocument};

/// What a handle changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum HandleKind {
    /// The beginning of a path.
    Start,
    /// The whole route.
    Whole,
    /// The direction of the whole route.
    Heading,
    /// A rounded corner between two lines.
    Corner,
    /// The end of a line.
    End,
    /// The middle of a line, where a dragged corner comes into being.
    Middle,
    /// The middle of an arc: its radius.
    ArcRadius,
    /// The end of an arc: its turn.
    ArcEnd,
    /// The end of a part of a spiral: its turn and its radius.
    SpiralEnd,
    /// Where the head starts on a spiral.
    SpiralStart,
    /// The distance of neighbouring turns.
    Pitch,
    /// The circle that contains the S of a turnaround.
    TurnCircle,
    /// Points of the stage's borders.
    Outline,
    KeepOut,
    Crowd,
    /// The middles of their sides, where a dragged point comes into being.
    OutlineMiddle,
    KeepOutMiddle,
    CrowdMiddle,
}

impl HandleKind {
    /// The border on which it is; `None` if it belongs to a route.
    pub(super) fn border(self) -> Option<Self> {
        match self {
            Self::Outline | Self::OutlineMiddle => Some(Self::Outline),
            Self::KeepOut | Self::KeepOutMiddle => Some(Self::KeepOut),
            Self::Crowd | Self::CrowdMiddle => Some(Self::Crowd),
            _ => None,
        }
    }
}

/// A handle, without its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HandleId {
    /// The dragon, counted from 0; 0 also for borders.
    pub(super) dragon: usize,
    pub(super) kind: HandleKind,
    /// The segment, the turn of a spiral, or the area.
    pub(super) at: usize,
    /// The point of a border.
    pub(super) point: usize,
}

/// A handle at its place.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Handle {
    #[serde(flatten)]
    pub(super) id: HandleId,
    pub(super) x_m: f64,
    pub(super) y_m: f64,
    pub(super) name: String,
    /// The numbers that belong to it.
    pub(super) fields: Vec<Field>,
    pub(super) can_delete: bool,
}

/// A number of the configuration.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Field {
    pub(super) keys: Keys,
    pub(super) label: &'static str,
    pub(super) value: f64,
    pub(super) unit: &'static str,
}

impl Handle {
    pub(super) fn new(id: HandleId, at: DVec2, name: impl Into<String>, fields: Vec<Field>) -> Self {
        Self { id, x_m: at.x, y_m: at.y, name: name.into(), fields, can_delete: false }
    }
}

impl Field {
    /// A length in metres.
    pub(super) fn length(keys: Keys, label: &'static str, value: f64) -> Self {
        Self { keys, label, value: rounded_m(value), unit: "m" }
    }
}

/// The documents of all dragons, with the places of their tables.
pub(super) fn documents(config: &Config) -> Vec<(Owner, &ConfigDocument)> {
    match config.named() {
        None => vec![(Owner(None), config.document())],
        Some(named) => {
            let documents = named.dragons().iter().map(|dragon| dragon.config.document());
            documents.enumerate().map(|(number, document)| (Owner(Some(number)), document)).collect()
        }
    }
}

/// All handles of a configuration and its text.
pub(super) fn handles(text: &str, config: &Config) -> Vec<Handle> {
    let mut all = Vec::new();
    for (dragon, (owner, document)) in documents(config).into_iter().enumerate() {
        let begin = &document.route().placement;
        match &document.route().shape {
            RouteShape::Path(path) if document.drawing().is_none() && path.laps.is_none() => {
                all.extend(path_handles::handles(dragon, owner, &path.segments, begin));
            }
            RouteShape::Path(_) => {
                let id = HandleId { dragon, kind: HandleKind::Whole, at: 0, point: 0 };
                all.push(Handle::new(id, begin.position, "Start", place_fields(owner, begin)));
            }
            RouteShape::Spiral(spiral) => all.extend(spiral_handles::of_spiral(dragon, owner, spiral, begin)),
            RouteShape::Turnaround(turn) => all.extend(spiral_handles::of_turnaround(dragon, owner, turn, begin)),
        }
    }
    all.extend(stage_handles::handles(text));
    all
}

/// The numbers of a route's place.
pub(super) fn place_fields(owner: Owner, at: &Placement) -> Vec<Field> {
    vec![
        Field::length(owner.route("start_x_m"), "x", at.position.x),
        Field::length(owner.route("start_y_m"), "y", at.position.y),
        Field { keys: owner.route("start_heading_deg"), label: "heading", value: heading_deg(at.heading), unit: "°" },
    ]
}

/// The changes that put a route elsewhere.
pub(super) fn placed_at(owner: Owner, to: DVec2) -> Vec<Change> {
    [("start_x_m", to.x), ("start_y_m", to.y)]
        .map(|(key, value_m)| Change::Set { keys: owner.route(key), value: rounded_m(value_m) })
        .into()
}

/// The change that turns a whole route.
pub(super) fn headed(owner: Owner, heading: f64) -> Change {
    Change::Set { keys: owner.route("start_heading_deg"), value: heading_deg(heading) }
}
