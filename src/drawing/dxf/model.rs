//! The contents of a DXF file: its entities, blocks and layers.

use std::collections::{HashMap, HashSet};

use glam::{DAffine2, DVec2};

use super::super::{DrawingFileError, quoted};
use super::entity::Entity;

/// A group code and its value.
pub(super) type Pair<'a> = (i32, &'a str);

/// Metres of the units 1 to 24 of `$INSUNITS`; 0: an astronomical unit, a light year or a parsec, which no stage has.
const UNITS_M: [f64; 24] = [
    0.0254,
    0.3048,
    1609.344,
    0.001,
    0.01,
    1.0,
    1000.0,
    2.54e-8,
    2.54e-5,
    0.9144,
    1e-10,
    1e-9,
    1e-6,
    0.1,
    10.0,
    100.0,
    1e9,
    0.0,
    0.0,
    0.0,
    1200.0 / 3937.0,
    100.0 / 3937.0,
    3600.0 / 3937.0,
    6_336_000.0 / 3937.0,
];
/// Most entities of all inserted blocks, and most blocks that contain each other.
const MAX_INSERTED: usize = 200_000;
const MAX_DEPTH: usize = 32;

/// A file.
pub(super) struct Model<'a> {
    /// Metres of a unit, by the header.
    pub(super) unit_m: Option<f64>,
    /// The unit in the header, if it is none of a stage.
    pub(super) other_unit: Option<&'a str>,
    pub(super) entities: Vec<Entity<'a>>,
    blocks: HashMap<String, Block<'a>>,
    /// Layers that are off or frozen, in upper case.
    hidden_layers: HashSet<String>,
    /// Those that are frozen. Blocks that are inserted on them are hidden with all of their layers.
    frozen_layers: HashSet<String>,
    /// Whether the file has any pair.
    pub(super) is_empty: bool,
}

#[derive(Default)]
struct Block<'a> {
    base: DVec2,
    is_in_other_file: bool,
    entities: Vec<Entity<'a>>,
}

/// An entity with a curve, where it is shown; or one that inserts a block, if that cannot be placed.
#[derive(Clone)]
pub(super) struct Shown<'m, 'a> {
    pub(super) entity: &'m Entity<'a>,
    /// From the entity's coordinates to those of the model.
    pub(super) map: DAffine2,
    /// Layer on which it is shown: entities on layer 0 of a block are on that of their block.
    pub(super) layer: &'a str,
    /// The outermost entity that inserts it.
    pub(super) insert: Option<&'m Entity<'a>>,
    is_hidden: bool,
    /// Why the block cannot be placed, in words.
    fault: Option<String>,
}

impl<'a> Model<'a> {
    pub(super) fn of(text: &'a str) -> Result<Self, DrawingFileError> {
        let pairs = pairs(text)?;
        let mut model = Self {
            unit_m: header_unit(&pairs).and_then(unit_m),
            other_unit: header_unit(&pairs).filter(|&unit| unit != "0" && unit_m(unit).is_none()),
            entities: entities(section(&pairs, "ENTITIES")?),
            blocks: HashMap::new(),
            hidden_layers: HashSet::new(),
            frozen_layers: HashSet::new(),
            is_empty: pairs.is_empty(),
        };
        for layer in entities(section(&pairs, "TABLES")?).iter().filter(|entity| entity.kind == "LAYER") {
            let is_off = layer.text(62).is_some_and(|colour| colour.starts_with('-'));
            let is_frozen = layer.text(70).and_then(|flags| flags.parse().ok()).unwrap_or(0) & 1 == 1;
            if is_off || is_frozen {
                let name = layer.text(2).unwrap_or_default().to_uppercase();
                model.frozen_layers.extend(is_frozen.then(|| name.clone()));
                model.hidden_layers.insert(name);
            }
        }
        let (mut name, mut block) = (String::new(), Block::default());
        for entity in entities(section(&pairs, "BLOCKS")?) {
            match entity.kind {
                "BLOCK" => {
                    const IN_OTHER_FILE: u32 = 4 | 8;
                    let coordinate = |code| entity.text(code).and_then(|value| value.parse().ok()).unwrap_or(0.0);
                    let flags: u32 = entity.text(70).and_then(|flags| flags.parse().ok()).unwrap_or(0);
                    name = entity.text(2).unwrap_or_default().to_uppercase();
                    block = Block {
                        base: DVec2::new(coordinate(10), coordinate(20)),
                        is_in_other_file: flags & IN_OTHER_FILE != 0,
                        entities: vec![],
                    };
                }
                "ENDBLK" => {
                    model.blocks.insert(std::mem::take(&mut name), std::mem::take(&mut block));
                }
                _ => block.entities.push(entity),
            }
        }
        Ok(model)
    }

    /// The curves of the model itself.
    pub(super) fn own(&self) -> Vec<Shown<'_, 'a>> {
        let curves = self.entities.iter().filter(|entity| entity.is_curve());
        curves
            .map(|entity| Shown {
                entity,
                map: DAffine2::IDENTITY,
                layer: entity.layer(),
                insert: None,
                is_hidden: self.is_hidden(entity, entity.layer()),
                fault: None,
            })
            .collect()
    }

    /// The curves of all blocks that the model inserts. An insertion that cannot be placed is one entity with a fault.
    pub(super) fn inserted(&self) -> Vec<Shown<'_, 'a>> {
        let mut shown = vec![];
        for insert in self.entities.iter().filter(|entity| entity.kind == "INSERT" && !entity.is_on_paper()) {
            let outer = Shown {
                entity: insert,
                map: DAffine2::IDENTITY,
                layer: insert.layer(),
                insert: Some(insert),
                is_hidden: self.is_hidden(insert, insert.layer()),
                fault: None,
            };
            let before = shown.len();
            if let Err(error) = self.insert(&outer, 0, &mut shown) {
                shown.truncate(before);
                shown.push(Shown { fault: Some(error.to_string()), ..outer });
            }
        }
        shown
    }

    /// Whether a block, or a block that it inserts, has such an entity.
    pub(super) fn has_within(&self, block: &str, is_wanted: impl Fn(&Entity<'_>) -> bool) -> bool {
        let (mut names, mut seen) = (vec![block.to_uppercase()], HashSet::new());
        while let Some(name) = names.pop() {
            let Some(block) = self.blocks.get(&name) else { continue };
            if block.entities.iter().any(&is_wanted) {
                return true;
            }
            if seen.insert(name) {
                let inserts = block.entities.iter().filter(|entity| entity.kind == "INSERT");
                names.extend(inserts.filter_map(|insert| insert.text(2)).map(str::to_uppercase));
            }
        }
        false
    }

    /// A block that the model inserts, but that the file does not have.
    pub(super) fn missing_block(&self) -> Option<&'a str> {
        let inserts = self.entities.iter().filter(|entity| entity.kind == "INSERT");
        inserts.filter_map(|insert| insert.text(2)).find(|name| {
            self.blocks
                .get(&name.to_uppercase())
                .is_none_or(|block| block.is_in_other_file || block.entities.is_empty())
        })
    }

    fn is_hidden(&self, entity: &Entity<'_>, layer: &str) -> bool {
        // What a block shows has layers of its own, which may be on where its insertion is on a layer that is off.
        let hiding = if entity.kind == "INSERT" { &self.frozen_layers } else { &self.hidden_layers };
        entity.text(60) == Some("1") || hiding.contains(&layer.to_uppercase())
    }

    /// Adds the curves of a block where an entity inserts it.
    fn insert<'m>(
        &'m self,
        outer: &Shown<'m, 'a>,
        depth: usize,
        shown: &mut Vec<Shown<'m, 'a>>,
    ) -> Result<(), DrawingFileError> {
        let insert = outer.entity;
        let Some(block) = self.blocks.get(&insert.text(2).unwrap_or_default().to_uppercase()) else { return Ok(()) };
        if depth >= MAX_DEPTH {
            return Err(insert.fault(&format!("has blocks in more than {MAX_DEPTH} levels, the most that is allowed")));
        }
        for map in places(insert, block.base)? {
            for entity in &block.entities {
                if shown.len() >= MAX_INSERTED {
                    return Err(DrawingFileError(format!(
                        "has blocks with more than {MAX_INSERTED} entities, the most that is allowed"
                    )));
                }
                let layer = if ["0", ""].contains(&entity.layer()) { outer.layer } else { entity.layer() };
                let is_hidden = outer.is_hidden || self.is_hidden(entity, layer);
                let inner = Shown { entity, map: outer.map * map, layer, is_hidden, ..outer.clone() };
                if entity.kind == "INSERT" {
                    self.insert(&inner, depth + 1, shown)?;
                } else if entity.is_curve() {
                    shown.push(inner);
                }
            }
        }
        Ok(())
    }
}

impl Shown<'_, '_> {
    /// Whether it is invisible, or its layer is off or frozen.
    pub(super) fn is_hidden(&self) -> bool {
        self.is_hidden
    }

    /// # Errors
    /// The block of the entity cannot be placed.
    pub(super) fn require_placed(&self) -> Result<(), DrawingFileError> {
        self.fault.as_ref().map_or(Ok(()), |reason| Err(DrawingFileError(reason.clone())))
    }

    /// Whether the entity inserts a block that cannot be placed.
    pub(super) fn is_faulty(&self) -> bool {
        self.fault.is_some()
    }
}

/// The maps of a block with this base point to the places where an entity inserts it: rows and columns of one map.
fn places(insert: &Entity<'_>, base: DVec2) -> Result<Vec<DAffine2>, DrawingFileError> {
    let number = |code: i32, missing: f64| Ok::<_, DrawingFileError>(insert.number(code)?.unwrap_or(missing));
    let (at, angle) = (insert.point(10)?, number(50, 0.0)?.to_radians());
    let scale = DVec2::new(number(41, 1.0)?, number(42, 1.0)?);
    let [columns, rows] = [number(70, 1.0)?, number(71, 1.0)?].map(|count| count.clamp(1.0, 65_535.0) as usize);
    let apart = DVec2::new(number(44, 0.0)?, number(45, 0.0)?);
    if columns * rows > MAX_INSERTED {
        return Err(
            insert.fault(&format!("has {columns} columns and {rows} rows, at most {MAX_INSERTED} blocks are allowed"))
        );
    }
    if scale.x == 0.0 || scale.y == 0.0 {
        return Err(insert.fault("has a scale of 0"));
    }
    let mirror = DVec2::new(if insert.is_mirrored()? { -1.0 } else { 1.0 }, 1.0);
    let outer = DAffine2::from_scale(mirror) * DAffine2::from_translation(at) * DAffine2::from_angle(angle);
    let inner = DAffine2::from_scale(scale) * DAffine2::from_translation(-base);
    let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| DVec2::new(column as f64, row as f64)));
    Ok(cells.map(|cell| outer * DAffine2::from_translation(cell * apart) * inner).collect())
}

/// The pairs of a file.
fn pairs(text: &str) -> Result<Vec<Pair<'_>>, DrawingFileError> {
    let mut lines = text.trim_start_matches('\u{feff}').lines();
    let (mut pairs, mut number) = (vec![], 1);
    while let Some(line) = lines.next() {
        let Ok(code) = line.trim().parse() else {
            let shown = quoted(line.trim());
            return Err(DrawingFileError(format!("line {number} is {shown}, must be a group code of a DXF file")));
        };
        let Some(value) = lines.next() else {
            return Err(DrawingFileError(format!("ends early: line {number} is a group code, must have a value")));
        };
        pairs.push((code, value.trim()));
        number += 2;
    }
    Ok(pairs)
}

/// The unit of length in the header.
fn header_unit<'a>(pairs: &[Pair<'a>]) -> Option<&'a str> {
    let at = pairs.iter().position(|&pair| pair == (9, "$INSUNITS"))?;
    pairs.get(at + 1).map(|&(_, unit)| unit)
}

/// A unit of the header in metres.
fn unit_m(unit: &str) -> Option<f64> {
    let unit: usize = unit.parse().ok()?;
    UNITS_M.get(unit.checked_sub(1)?).copied().filter(|&unit_m| unit_m > 0.0)
}

/// The pairs of a section; none without it.
///
/// # Errors
/// The section has no end.
fn section<'p, 'a>(pairs: &'p [Pair<'a>], name: &str) -> Result<&'p [Pair<'a>], DrawingFileError> {
    let begin = pairs.windows(2).position(|pair| pair == [(0, "SECTION"), (2, name)]);
    let Some(section) = begin.map(|begin| &pairs[begin + 2..]) else { return Ok(&[]) };
    let end = section.iter().position(|pair| [(0, "ENDSEC"), (0, "SECTION"), (0, "EOF")].contains(pair));
    match end.filter(|&end| section[end] == (0, "ENDSEC")) {
        Some(end) => Ok(&section[..end]),
        None => Err(DrawingFileError(format!("ends early: the section {} has no end, must have ENDSEC", quoted(name)))),
    }
}

/// The entities of a section.
fn entities<'a>(pairs: &[Pair<'a>]) -> Vec<Entity<'a>> {
    let mut entities: Vec<Entity<'a>> = vec![];
    for &(code, value) in pairs {
        match (code, value) {
            (0, "VERTEX") if !entities.is_empty() => entities.last_mut().expect("an entity").vertices.push(vec![]),
            (0, kind) => entities.push(Entity { kind, groups: vec![], vertices: vec![] }),
            _ => {
                if let Some(entity) = entities.last_mut() {
                    entity.vertices.last_mut().unwrap_or(&mut entity.groups).push((code, value));
                }
            }
        }
    }
    entities
}
