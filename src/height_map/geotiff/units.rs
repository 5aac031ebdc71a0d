//! The units of positions and heights, which must be metres.

use roxmltree::{Document, ParsingOptions};
use tiff::tags::Tag;

use super::super::{HeightMapError, Placing, quoted};
use super::tags::{TiffFile, invalid, text};

/// Scale, offset and unit of heights, as XML.
pub(super) const GDAL_METADATA: Tag = Tag::Unknown(42112);
/// Most elements and texts of `GDAL_METADATA`.
const MAX_NODES: u32 = 10_000;
/// Names of the metre in the metadata of GDAL.
pub(in super::super) const METRE_NAMES: [&str; 6] = ["", "m", "metre", "meter", "metres", "meters"];

/// Vertical systems of EPSG whose unit is not the metre, and their unit in metres.
const VERTICAL_UNITS: [(u16, f64); 9] = [
    (5702, 0.304_800_609_601_219_24),
    (5754, 0.304_800_749_1),
    (6130, 0.3048),
    (6131, 0.3048),
    (6132, 0.3048),
    (6360, 0.304_800_609_601_219_24),
    (8050, 0.3048),
    (8052, 0.304_800_609_601_219_24),
    (8228, 0.3048),
];
/// Vertical systems of EPSG that point downwards.
const DEPTHS: [u16; 52] = [
    5336, 5612, 5614, 5706, 5715, 5734, 5739, 5789, 5831, 5861, 5862, 5863, 5864, 5865, 5866, 5867, 5873, 6357, 6358,
    6359, 7976, 8051, 8053, 8358, 8378, 8897, 9287, 9288, 9672, 10150, 10151, 10349, 10364, 10370, 10371, 10372, 10373,
    10374, 10375, 10376, 10377, 10378, 10379, 10547, 10548, 10549, 10550, 10551, 10552, 10649, 10650, 10678,
];
/// Projected systems of EPSG whose unit is not the metre, as ranges.
const OTHER_UNITS: &str = include_str!("epsg_other_units.txt");

/// Keys in the `GeoKeyDirectory`, and values of theirs.
pub(super) mod geo_key {
    pub(super) const MODEL_TYPE: u16 = 1024;
    pub(super) const MODEL_PROJECTED: u16 = 1;
    pub(super) const MODEL_GEOGRAPHIC: u16 = 2;
    pub(super) const MODEL_USER_DEFINED: u16 = 32767;
    pub(in super::super) const RASTER_TYPE: u16 = 1025;
    pub(in super::super) const RASTER_PIXEL_IS_POINT: u16 = 2;
    pub(super) const PROJECTED_UNIT: u16 = 3076;
    pub(super) const PROJECTED_SYSTEM: u16 = 3072;
    pub(super) const VERTICAL_SYSTEM: u16 = 4096;
    pub(super) const VERTICAL_UNIT: u16 = 4099;
    pub(super) const USER_DEFINED: u16 = 32767;
    pub(super) const METRE: u16 = 9001;
}

/// Fails if positions or heights are not in metres.
pub(super) fn require_metres(
    geo_keys: &impl Fn(u16) -> Option<u16>,
    citation: &str,
    placing: &Placing,
) -> Result<(), HeightMapError> {
    let model = geo_keys(geo_key::MODEL_TYPE).unwrap_or(geo_key::MODEL_PROJECTED);
    if model == geo_key::MODEL_GEOGRAPHIC {
        let remedy = "reproject it to a grid in metres";
        return Err(HeightMapError(format!("has positions in degrees (GTModelType {model}): {remedy}")));
    }
    if ![0, geo_key::MODEL_PROJECTED, geo_key::MODEL_USER_DEFINED].contains(&model) {
        let wanted = geo_key::MODEL_PROJECTED;
        return Err(HeightMapError(format!("GTModelType is {model}, must be {wanted}: a projected grid in metres")));
    }
    let is_metre = |unit: u16| unit == geo_key::METRE;
    if let Some(unit) = geo_keys(geo_key::PROJECTED_UNIT).filter(|&unit| !is_metre(unit)) {
        let wanted = geo_key::METRE;
        return Err(HeightMapError(format!("has positions in unit {unit} of EPSG, must be {wanted}: metres")));
    }
    let system = geo_keys(geo_key::PROJECTED_SYSTEM).filter(|_| geo_keys(geo_key::PROJECTED_UNIT).is_none());
    if let Some(system) = system.filter(|&system| has_other_unit(system)) {
        return Err(HeightMapError(format!(
            "has positions in EPSG:{system}, whose unit is not the metre: reproject it"
        )));
    }
    require_metres_up(geo_keys, citation, placing)?;
    match geo_keys(geo_key::VERTICAL_UNIT).filter(|&unit| !is_metre(unit)) {
        Some(unit) if placing.metres_per_unit.is_none() => {
            Err(HeightMapError(format!("has heights in unit {unit} of EPSG: set metres_per_unit")))
        }
        _ => Ok(()),
    }
}

/// Fails if the vertical system has another unit than metres, or depths. With `metres_per_unit` the unit may be any.
fn require_metres_up(
    geo_keys: &impl Fn(u16) -> Option<u16>,
    citation: &str,
    placing: &Placing,
) -> Result<(), HeightMapError> {
    let Some(system) = geo_keys(geo_key::VERTICAL_SYSTEM) else { return Ok(()) };
    if DEPTHS.contains(&system) {
        return Err(HeightMapError(format!("has depths (EPSG:{system}), must have heights: negate them")));
    }
    if placing.metres_per_unit.is_some() || geo_keys(geo_key::VERTICAL_UNIT).is_some() {
        return Ok(());
    }
    let metres = VERTICAL_UNITS.iter().find(|(known, _)| *known == system).map(|(_, metres)| metres);
    if let Some(metres) = metres {
        let unit = format!("units of {metres} m (EPSG:{system})");
        return Err(HeightMapError(format!("has heights in {unit}: set metres_per_unit = {metres}")));
    }
    let citation = citation.to_lowercase();
    let names_feet = ["foot", "feet", "ftus", "(ft", "us ft"].iter().any(|name| citation.contains(name));
    if system == geo_key::USER_DEFINED && names_feet {
        return Err(HeightMapError("has a vertical system that may be in feet: set metres_per_unit".to_owned()));
    }
    Ok(())
}

/// Whether a projected system of EPSG has another unit than metres.
fn has_other_unit(system: u16) -> bool {
    OTHER_UNITS.split_ascii_whitespace().any(|range| {
        let (first, last) = range.split_once('-').unwrap_or((range, range));
        let within = |bound: &str| bound.parse::<u16>().ok();
        within(first).is_some_and(|first| first <= system) && within(last).is_some_and(|last| system <= last)
    })
}

/// The value of a key in the `GeoKeyDirectory`, of those that are numbers.
pub(super) fn geo_keys(file: &mut TiffFile<'_>) -> Result<impl Fn(u16) -> Option<u16> + use<>, HeightMapError> {
    let directory = file.find_tag_unsigned_vec::<u16>(Tag::GeoKeyDirectoryTag).map_err(invalid)?.unwrap_or_default();
    Ok(move |wanted: u16| {
        let mut entries = directory.get(4..)?.chunks_exact(4);
        entries.find_map(|entry| if entry[..2] == [wanted, 0] { Some(entry[3]) } else { None })
    })
}

/// Fails if GDAL notes a scale, an offset or a unit of the heights. With `metres_per_unit` the unit may be any.
pub(super) fn require_unscaled_metres(file: &mut TiffFile<'_>, placing: &Placing) -> Result<(), HeightMapError> {
    let Some(text) = text(file, GDAL_METADATA)? else { return Ok(()) };
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(&text, options).map_err(|error| {
        HeightMapError(format!("has GDAL_METADATA that is not valid XML: {}", error.to_string().replace('\n', " ")))
    })?;
    for item in document.descendants().filter(|node| node.has_tag_name("Item")) {
        let value = item.text().unwrap_or_default().trim();
        let role = item.attribute("role").unwrap_or_default();
        let neutral = match role {
            "scale" => Some(1.0),
            "offset" => Some(0.0),
            _ => None,
        };
        if let Some(neutral) = neutral.filter(|neutral| value.parse() != Ok(*neutral)) {
            let found = format!("GDAL_METADATA has the {role} {}", quoted(value));
            return Err(HeightMapError(format!("{found}, must be {neutral}: write the heights themselves")));
        }
        let is_metre = METRE_NAMES.contains(&value.to_lowercase().as_str());
        if role == "unittype" && !is_metre && placing.metres_per_unit.is_none() {
            return Err(HeightMapError(format!("has heights in {}: set metres_per_unit", quoted(value))));
        }
    }
    Ok(())
}
