//! The floor of a show in metres, for marking it: the area that boards sweep and the borders of the stage, as DXF and GeoJSON.
//!
//! DXF is that of `AutoCAD` Release 12, which every program reads. GeoJSON is RFC 7946, but in metres of the configuration instead of
//! degrees. Layers and the property `kind` have the same names.

use std::fmt::{Display, Write as _};

use glam::DVec2;
use serde_json::{Value, json};

use super::figure::StageInPlan;

/// The floor of a show.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FloorPlan {
    /// The parts of the swept area, each with its outer border, counter-clockwise, and then those of its holes, clockwise.
    pub swept: Vec<Vec<Vec<DVec2>>>,
    /// The borders of the stage.
    pub stage: StageInPlan,
    /// Places to be marked. GeoJSON does not have them.
    pub marks: Vec<FloorMark>,
}

/// A place to be marked on the floor.
#[derive(Clone, Debug, PartialEq)]
pub struct FloorMark {
    /// Its layer: up to 31 of A–Z, 0–9, _ and -.
    pub layer: String,
    /// The place in metres.
    pub point: DVec2,
    /// Words beside it, in ASCII.
    pub words: Option<String>,
}

/// Height of the letters beside a mark, in metres.
const LETTER_M: f64 = 0.1;

impl FloorPlan {
    /// All lines in a DXF file, on the layers `SWEPT`, `OUTLINE`, `KEEP_OUT` and `CROWD`, and the marks on theirs.
    ///
    /// ```
    /// use bench_dragon::output::floor_plan::FloorPlan;
    /// use glam::DVec2;
    ///
    /// let triangle = vec![DVec2::ZERO, DVec2::X, DVec2::Y];
    /// let plan = FloorPlan { swept: vec![vec![triangle]], ..FloorPlan::default() };
    /// assert!(plan.to_dxf().starts_with("0\nSECTION\n2\nHEADER\n"));
    /// assert_eq!(plan.to_dxf().matches("VERTEX").count(), 3);
    /// ```
    pub fn to_dxf(&self) -> String {
        let mut dxf = Dxf::default();
        dxf.open("HEADER");
        dxf.group(9, "$ACADVER");
        dxf.group(1, "AC1009");
        // Metres.
        dxf.group(9, "$INSUNITS");
        dxf.group(70, 6);
        dxf.close();
        dxf.open("ENTITIES");
        for border in self.swept.iter().flatten() {
            dxf.polyline("SWEPT", border, true);
        }
        for (layer, corners) in self.closed() {
            dxf.polyline(layer, corners, true);
        }
        if !self.stage.crowd.is_empty() {
            dxf.polyline("CROWD", &self.stage.crowd, false);
        }
        self.marks.iter().for_each(|mark| dxf.mark(mark));
        dxf.close();
        dxf.group(0, "EOF");
        dxf.text
    }

    /// All areas and lines as features.
    pub fn to_geojson(&self) -> String {
        let points = |points: &[DVec2]| points.iter().map(DVec2::to_array).collect::<Vec<_>>();
        let ring = |border: &[DVec2]| [points(border), points(&border[..1])].concat();
        let feature = |layer: &str, kind: &str, coordinates: Value| {
            json!({
                "type": "Feature",
                "properties": { "kind": layer.to_ascii_lowercase(), "unit": "metres of the configuration" },
                "geometry": { "type": kind, "coordinates": coordinates },
            })
        };
        let rings = |part: &Vec<Vec<DVec2>>| part.iter().map(|border| ring(border)).collect::<Vec<_>>();
        let swept: Vec<_> = self.swept.iter().map(rings).collect();
        let mut features = vec![feature("SWEPT", "MultiPolygon", json!(swept))];
        features.extend(self.closed().map(|(layer, corners)| {
            let mut corners = corners.to_vec();
            let turns = corners.iter().zip(corners.iter().cycle().skip(1)).map(|(from, to)| from.perp_dot(*to));
            if turns.sum::<f64>() < 0.0 {
                corners.reverse();
            }
            feature(layer, "Polygon", json!([ring(&corners)]))
        }));
        if !self.stage.crowd.is_empty() {
            features.push(feature("CROWD", "LineString", json!(points(&self.stage.crowd))));
        }
        json!({ "type": "FeatureCollection", "features": features }).to_string() + "\n"
    }

    /// The closed borders of the stage with their layers.
    fn closed(&self) -> impl Iterator<Item = (&'static str, &[DVec2])> {
        let outline = Some(&self.stage.outline).filter(|outline| !outline.is_empty());
        let areas = self.stage.keep_out.iter().map(|area| ("KEEP_OUT", area.as_slice()));
        outline.into_iter().map(|outline| ("OUTLINE", outline.as_slice())).chain(areas)
    }
}

/// The groups of a DXF file: a code and a value, each on a line.
#[derive(Default)]
struct Dxf {
    text: String,
}

impl Dxf {
    fn group(&mut self, code: u32, value: impl Display) {
        // Writing into a String cannot fail.
        let _ = writeln!(self.text, "{code}\n{value}");
    }

    fn open(&mut self, section: &str) {
        self.group(0, "SECTION");
        self.group(2, section);
    }

    fn close(&mut self) {
        self.group(0, "ENDSEC");
    }

    fn mark(&mut self, FloorMark { layer, point, words }: &FloorMark) {
        self.group(0, "POINT");
        self.group(8, layer);
        self.place(*point);
        if let Some(words) = words {
            self.group(0, "TEXT");
            self.group(8, layer);
            self.place(*point + LETTER_M);
            self.group(40, LETTER_M);
            self.group(1, words);
        }
    }

    fn place(&mut self, point: DVec2) {
        self.group(10, point.x);
        self.group(20, point.y);
        self.group(30, 0);
    }

    fn polyline(&mut self, layer: &str, points: &[DVec2], is_closed: bool) {
        self.group(0, "POLYLINE");
        self.group(8, layer);
        // Vertices follow.
        self.group(66, 1);
        self.group(70, u32::from(is_closed));
        for point in points {
            self.group(0, "VERTEX");
            self.group(8, layer);
            self.place(*point);
        }
        self.group(0, "SEQEND");
    }
}
