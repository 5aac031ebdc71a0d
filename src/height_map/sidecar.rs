//! Files beside a map that say more about its numbers: what GDAL adds (`map.tif.aux.xml`), and the system of its positions (`map.prj`).
//!
//! Formats: GDAL, *Persistent Auxiliary Metadata*; OGC 01-009 and ISO 19162 (well-known text); the older `.prj` of Arc/Info, with lines.

use std::io::ErrorKind;
use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};

use super::geotiff::METRE_NAMES;
use super::{HeightMapError, HeightMapFormat, Placing};
use crate::system::input_file::{self, InputFileError, quoted, utf8};

/// Most elements and texts of an `.aux.xml`.
const MAX_NODES: u32 = 100_000;
/// Names in well-known text behind which the system of the heights stands.
const VERTICAL: [&str; 4] = ["VERT_CS[", "VERTCS[", "VERTCRS[", "VERTICALCRS["];
/// Names behind which a unit of length or, with `UNIT[`, of an angle stands.
const UNITS: [&str; 2] = ["LENGTHUNIT[", "UNIT["];
/// Parts of the names of units of angles. All other units are of length.
const ANGLES: [&str; 7] = ["DEG", "GRAD", "GON", "RAD", "ARC", "MINUTE", "SECOND"];

/// Fails if a file beside the map gives its heights a scale or an offset, or positions or heights another unit than metres. With
/// `metres_per_unit` the unit of the heights may be any. A PNG has its unit from the configuration alone. A GeoTIFF has its own
/// system: a `.prj` beside it belongs to another file.
pub(super) fn require_unscaled_metres(
    map: &Path,
    format: HeightMapFormat,
    placing: &Placing,
) -> Result<(), HeightMapError> {
    if format == HeightMapFormat::Png {
        return Ok(());
    }
    let mut auxiliary = map.as_os_str().to_owned();
    auxiliary.push(".aux.xml");
    check(Path::new(&auxiliary), placing, auxiliary_metadata)?;
    if format == HeightMapFormat::GeoTiff {
        return Ok(());
    }
    check(&map.with_extension("prj"), placing, system)
}

/// Checks a file by `check`, if there is one. The name of the file stands behind the reason.
fn check(
    file: &Path,
    placing: &Placing,
    check: fn(&str, &Placing) -> Result<(), String>,
) -> Result<(), HeightMapError> {
    let name = || quoted(&file.file_name().unwrap_or_default().to_string_lossy());
    let bytes = match input_file::read(file) {
        Err(InputFileError::Unreadable(error)) if error.kind() == ErrorKind::NotFound => return Ok(()),
        bytes => bytes.map_err(|error| HeightMapError(format!("has {} beside it, which {error}", name())))?,
    };
    let text = utf8(&bytes).map_err(|error| HeightMapError(format!("has {} beside it, which {error}", name())))?;
    check(text.trim_start_matches('\u{feff}'), placing)
        .map_err(|reason| HeightMapError(format!("by {}: {reason}", name())))
}

/// Checks the text of an `.aux.xml`.
fn auxiliary_metadata(text: &str, placing: &Placing) -> Result<(), String> {
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options)
        .map_err(|error| format!("not valid XML: {}", error.to_string().replace('\n', " ")))?;
    let root = document.root_element();
    let value = |node: Node<'_, '_>| node.text().unwrap_or_default().trim().to_owned();
    for srs in root.children().filter(|node| node.has_tag_name("SRS")) {
        system(&value(srs), placing)?;
    }
    let is_first = |node: &Node<'_, '_>| node.has_tag_name("PAMRasterBand") && node.attribute("band") == Some("1");
    for item in root.children().filter(is_first).flat_map(|band| band.children()) {
        let value = value(item);
        let neutral = match item.tag_name().name() {
            "Scale" => Some(1.0),
            "Offset" => Some(0.0),
            _ => None,
        };
        if let Some(neutral) = neutral.filter(|neutral| value.parse() != Ok(*neutral)) {
            let key = item.tag_name().name().to_lowercase();
            return Err(format!("the {key} {}, must be {neutral}: write the heights themselves", quoted(&value)));
        }
        let is_metre = METRE_NAMES.contains(&value.to_lowercase().as_str());
        if item.has_tag_name("UnitType") && !is_metre && placing.metres_per_unit.is_none() {
            return Err(format!("heights in {}: set metres_per_unit", quoted(&value)));
        }
    }
    Ok(())
}

/// Checks a system of positions and heights, as well-known text or as lines.
fn system(text: &str, placing: &Placing) -> Result<(), String> {
    let text = text.to_uppercase();
    if !text.contains('[') {
        return text.lines().try_for_each(|line| line_of_units(line, placing));
    }
    let vertical = VERTICAL.iter().filter_map(|name| text.find(name)).min().unwrap_or(text.len());
    let (plan, heights) = text.split_at(vertical);
    if plan.contains("GEOG") && !plan.contains("PROJC") {
        return Err("positions in degrees: reproject it to a grid in metres".to_owned());
    }
    if let Some(unit) = other_unit(plan) {
        return Err(format!("positions in {unit}, must be in metres: reproject it"));
    }
    if heights.contains(",DOWN]") {
        return Err("depths, must be heights: negate them".to_owned());
    }
    match other_unit(heights).filter(|_| placing.metres_per_unit.is_none()) {
        Some(unit) => Err(format!("heights in {unit}: set metres_per_unit")),
        None => Ok(()),
    }
}

/// The first unit of length that is not the metre, in a part of well-known text.
fn other_unit(text: &str) -> Option<String> {
    let mut rest = text;
    loop {
        let (at, name) = UNITS.iter().filter_map(|name| Some((rest.find(name)?, name))).min_by_key(|(at, _)| *at)?;
        rest = &rest[at + name.len()..];
        let mut values = rest.split([',', ']']);
        let (name, metres) = (values.next()?.trim(), values.next()?.trim());
        let is_angle = ANGLES.iter().any(|angle| name.contains(angle));
        if !is_angle && metres.parse() != Ok(1.0) {
            return Some(quoted(name.trim_matches('"')));
        }
    }
}

/// Checks a line of an older `.prj`, such as `Zunits FEET`.
fn line_of_units(line: &str, placing: &Placing) -> Result<(), String> {
    let mut words = line.split_whitespace();
    let (key, unit) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
    let is_metre = matches!(unit, "METERS" | "METRES" | "METER" | "METRE");
    match key {
        "UNITS" if !is_metre => Err(format!("positions in {}, must be in metres: reproject it", quoted(unit))),
        "ZUNITS" if !is_metre && unit != "NO" && placing.metres_per_unit.is_none() => {
            Err(format!("heights in {}: set metres_per_unit", quoted(unit)))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const METRES: &str = r#"PROJCS["UTM 33N",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.25]],UNIT["degree",0.0174532925199433]],UNIT["metre",1]]"#;

    fn reason(check: fn(&str, &Placing) -> Result<(), String>, text: &str) -> Option<String> {
        check(text, &Placing::default()).err()
    }

    #[test]
    fn systems_in_metres_are_read_and_other_units_are_named() {
        let heights =
            |unit| METRES.replacen("PROJCS", "COMPD_CS[\"both\",PROJCS", 1) + &format!(r#",VERT_CS["NAVD88",{unit}]]"#);
        for (text, wanted) in [
            (METRES.to_owned(), None),
            (
                METRES.replace("\"metre\",1", "\"US survey foot\",0.304800609601219"),
                Some("positions in \"US SURVEY FOOT\", must be in metres: reproject it"),
            ),
            (heights(r#"UNIT["metre",1.0],AXIS["Gravity-related height",UP]"#), None),
            (heights(r#"UNIT["millimetre",0.001]"#), Some("heights in \"MILLIMETRE\": set metres_per_unit")),
            (
                METRES.replace("\"metre\",1", "\"centimetre\",0.01"),
                Some("positions in \"CENTIMETRE\", must be in metres: reproject it"),
            ),
            (
                heights(r#"UNIT["US survey foot",0.304800609601219]"#),
                Some("heights in \"US SURVEY FOOT\": set metres_per_unit"),
            ),
            (heights(r#"UNIT["metre",1],AXIS["Depth",DOWN]"#), Some("depths, must be heights: negate them")),
            (
                r#"GEOGCRS["WGS 84",CS[ellipsoidal,2],ANGLEUNIT["degree",0.0174532925199433]]"#.to_owned(),
                Some("positions in degrees: reproject it to a grid in metres"),
            ),
            (
                "Projection UTM\nZunits FEET\nUnits METERS\n".to_owned(),
                Some("heights in \"FEET\": set metres_per_unit"),
            ),
            ("Projection UTM\nZunits NO\nUnits METERS\n".to_owned(), None),
            (
                "Projection GEOGRAPHIC\nUnits DD\n".to_owned(),
                Some("positions in \"DD\", must be in metres: reproject it"),
            ),
        ] {
            assert_eq!(reason(system, &text).as_deref(), wanted, "{text}");
        }
    }

    #[test]
    fn notes_of_gdal_on_the_first_band_count() {
        let note = |band: u8, note: &str| {
            format!("<PAMDataset><PAMRasterBand band=\"{band}\">{note}</PAMRasterBand></PAMDataset>")
        };
        for (text, wanted) in [
            (note(1, "<UnitType>m</UnitType><Scale>1</Scale><Offset>0</Offset>"), None),
            (note(1, "<UnitType>us-ft</UnitType>"), Some("heights in \"us-ft\": set metres_per_unit")),
            (note(1, "<Scale>0.1</Scale>"), Some("the scale \"0.1\", must be 1: write the heights themselves")),
            (note(1, "<Offset>100</Offset>"), Some("the offset \"100\", must be 0: write the heights themselves")),
            (note(2, "<UnitType>us-ft</UnitType>"), None),
            (format!("<PAMDataset><SRS>{METRES}</SRS></PAMDataset>"), None),
        ] {
            assert_eq!(reason(auxiliary_metadata, &text).as_deref(), wanted, "{text}");
        }
        let broken = reason(auxiliary_metadata, "<PAMDataset>").expect("it has no end");
        assert!(broken.starts_with("not valid XML: "), "{broken}");
    }

    #[test]
    fn a_unit_of_heights_may_be_any_with_metres_per_unit() {
        let placing = Placing { metres_per_unit: Some(0.3048), ..Placing::default() };
        assert_eq!(system("Zunits FEET\nUnits METERS\n", &placing), Ok(()));
        let feet = "<PAMDataset><PAMRasterBand band=\"1\"><UnitType>ft</UnitType></PAMRasterBand></PAMDataset>";
        assert_eq!(auxiliary_metadata(feet, &placing), Ok(()));
    }

    #[test]
    fn a_prj_beside_a_geotiff_belongs_to_another_file() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("hill.prj"), "Units DD\n").expect("a file");
        let check = |name: &str, format| {
            require_unscaled_metres(&folder.path().join(name), format, &Placing::default()).is_ok()
        };
        assert!(check("hill.tif", HeightMapFormat::GeoTiff) && !check("hill.asc", HeightMapFormat::EsriAscii));
    }

    #[test]
    fn files_beside_a_map_are_read_by_their_names() {
        let folder = tempfile::tempdir().expect("a folder");
        let map = folder.path().join("hill.asc");
        let grid = "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 1\n1 1\n";
        std::fs::write(&map, grid).expect("a map");
        let read =
            || super::super::read(&map, &Placing::default()).map(|grid| grid.rows).map_err(|error| error.to_string());
        assert_eq!(read(), Ok(2));
        std::fs::write(folder.path().join("hill.prj"), "Zunits FEET\n").expect("a file");
        assert_eq!(read(), Err("by \"hill.prj\": heights in \"FEET\": set metres_per_unit".to_owned()));
        std::fs::write(folder.path().join("hill.asc.aux.xml"), [0xff]).expect("a file");
        assert_eq!(read(), Err("has \"hill.asc.aux.xml\" beside it, which is not UTF-8 text".to_owned()));
    }
}
