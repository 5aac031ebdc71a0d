//! An entry of `[[dragons]]`, not yet checked. Every wrong key or value is found where it is, so that messages have its line.

use std::fmt::{self, Formatter};

use serde::de::{DeserializeSeed, Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use toml::{Table, Value};

use super::document::{DragonTable, HeadTable};
use super::ground_table::GroundTable;
use super::route_table::RouteTable;

/// A dragon of several: the keys of `[dragon]`, with its name, its colour, and its own tables.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct DragonEntry {
    pub(super) name: Option<Value>,
    pub(super) colour: Option<Value>,
    pub(super) dragon: DragonTable,
    pub(super) route: RouteTable,
    pub(super) head: HeadTable,
    /// Plan time at which the head leaves.
    pub(super) start_s: f64,
    /// Without one, the ground is that of all dragons.
    pub(super) ground: Option<GroundTable>,
}

/// `[dragons.head]`: the keys of `[head]`, and when the head leaves.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
struct LeavingHeadTable {
    speed_mps: f64,
    accel_mps2: Option<f64>,
    start_s: f64,
}

impl Default for LeavingHeadTable {
    fn default() -> Self {
        let HeadTable { speed_mps, accel_mps2 } = HeadTable::default();
        Self { speed_mps, accel_mps2, start_s: 0.0 }
    }
}

impl<'de> Deserialize<'de> for DragonEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(EntryVisitor)
    }
}

struct EntryVisitor;

impl<'de> Visitor<'de> for EntryVisitor {
    type Value = DragonEntry;

    fn expecting(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        formatter.write_str("a table")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<DragonEntry, A::Error> {
        let (mut entry, mut dragon) = (DragonEntry::default(), Table::new());
        while let Some(key) = map.next_key::<String>()? {
            match &*key {
                "name" => entry.name = Some(map.next_value()?),
                "colour" => entry.colour = Some(map.next_value()?),
                "route" => entry.route = map.next_value()?,
                "ground" => entry.ground = Some(map.next_value()?),
                "head" => {
                    let LeavingHeadTable { speed_mps, accel_mps2, start_s } = map.next_value()?;
                    entry.head = HeadTable { speed_mps, accel_mps2 };
                    entry.start_s = start_s;
                }
                _ => map.next_value_seed(DragonKey { key, dragon: &mut dragon })?,
            }
        }
        entry.dragon = dragon.try_into().map_err(|error: toml::de::Error| A::Error::custom(error.message()))?;
        Ok(entry)
    }
}

/// A key of `[dragon]`, which is checked with its value alone.
struct DragonKey<'a> {
    key: String,
    dragon: &'a mut Table,
}

impl<'de> DeserializeSeed<'de> for DragonKey<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        let value = Value::deserialize(deserializer)?;
        let alone = Table::from_iter([(self.key.clone(), value.clone())]);
        alone.try_into::<DragonTable>().map_err(|error| D::Error::custom(error.message()))?;
        self.dragon.insert(self.key, value);
        Ok(())
    }
}
