//! Paths of DXF files in text form: lines, arcs, circles, ellipses, polylines with bulges, and splines, also in blocks.
//!
//! Source: Autodesk, *DXF Reference* (2012). A file is a list of pairs of lines: a group code and a value. This reader keeps
//! only the entities above: the crate `dxf` reads everything, but takes longer to build than usvg and all of its crates.
//!
//! Only the entities that are chosen are judged.

mod chain;
mod entity;
mod model;
mod text;

use bench_dragon_geometry::drawing::{Drawing, Piece};
use glam::{DAffine2, DVec2};

use super::{DrawingFileError, ListedPath, PathChoice, PathList, listed, quoted};
use chain::{order, place};
use entity::{Entity, curve};
use model::{Model, Shown};

/// Most entities that are joined to one path.
const MAX_JOINED: usize = 5_000;
/// Most entities that are joined with those of blocks on trial.
const MAX_TRIED: usize = 1_000;

/// A drawn entity.
struct Curve<'a> {
    layer: &'a str,
    pieces: Vec<Piece>,
    is_closed: bool,
}

impl Curve<'_> {
    /// Where it begins and ends.
    fn ends(&self) -> [DVec2; 2] {
        [self.pieces[0].begin(), self.pieces[self.pieces.len() - 1].end()]
    }
}

/// The path of a file: an entity, all entities of a layer or a block, or all of the file, joined end to end. A unit is that of the
/// header.
pub(super) fn path(bytes: &[u8], choice: &PathChoice<'_>) -> Result<Drawing, DrawingFileError> {
    let text = text::decoded(bytes);
    let model = Model::of(&text)?;
    let unit_m = unit_m(&model, choice)?;
    let [own, inserted] = choose(&model, choice)?;
    if inserted.is_empty() {
        return join(curves(&own, unit_m)?, choice.gap_m);
    }
    if own.is_empty() {
        return join(curves(&inserted, unit_m)?, choice.gap_m);
    }
    // Blocks are a part of the path if all joins. Otherwise they are something else, such as a north arrow.
    if own.len() + inserted.len() <= MAX_TRIED {
        let all = [own.clone(), inserted].concat();
        if let Ok(drawing) = curves(&all, unit_m).and_then(|all| join(all, choice.gap_m)) {
            return Ok(drawing);
        }
    }
    join(curves(&own, unit_m)?, choice.gap_m)
}

/// All paths of a file: one for each entity.
pub(super) fn list(bytes: &[u8], choice: &PathChoice<'_>) -> Result<PathList, DrawingFileError> {
    let text = text::decoded(bytes);
    let model = Model::of(&text)?;
    // A list is there to choose from, before anything is known of the unit.
    let unit_m = choice.metres_per_unit.or(model.unit_m);
    let (unit_m, is_in_metres) = (unit_m.unwrap_or(1.0), unit_m.is_some());
    let named = |name: &str| (!name.is_empty()).then(|| name.to_owned());
    let listed = |shown: &Shown<'_, '_>| {
        let curve = curves(std::slice::from_ref(shown), unit_m).map(|mut curves| curves.pop());
        let empty = || DrawingFileError("the path has no length".to_owned());
        ListedPath {
            id: named(shown.entity.handle()),
            label: shown.insert.and_then(|insert| insert.text(2)).and_then(named),
            layer: named(shown.layer),
            drawing: curve.and_then(|curve| {
                curve.map(|curve| Drawing { pieces: curve.pieces, is_closed: curve.is_closed }).ok_or_else(empty)
            }),
        }
    };
    let paths = model.own().iter().chain(&model.inserted()).map(listed).collect();
    Ok(PathList { paths, is_in_metres })
}

fn unit_m(model: &Model<'_>, choice: &PathChoice<'_>) -> Result<f64, DrawingFileError> {
    if model.entities.is_empty() {
        let reason = if model.is_empty { "is empty" } else { "has no path: it has no entities" };
        return Err(DrawingFileError(reason.to_owned()));
    }
    if choice.scale.is_some() {
        return Err(DrawingFileError(
            "a scale is of a page, which a DXF file does not have: set metres_per_unit".to_owned(),
        ));
    }
    choice.metres_per_unit.or(model.unit_m).ok_or_else(|| match model.other_unit {
        Some(unit) => DrawingFileError(format!(
            "has the unit {} in its header ($INSUNITS), must be 1 to 17 or 21 to 24: set metres_per_unit",
            quoted(unit)
        )),
        None => DrawingFileError("has no unit of length in its header ($INSUNITS): set metres_per_unit".to_owned()),
    })
}

/// The curves of entities in metres, without those that have no length.
fn curves<'a>(shown: &[Shown<'_, 'a>], unit_m: f64) -> Result<Vec<Curve<'a>>, DrawingFileError> {
    let scale = DAffine2::from_scale(DVec2::splat(unit_m));
    let mut curves = Vec::with_capacity(shown.len());
    for shown in shown {
        shown.require_placed()?;
        let (pieces, is_closed) = curve(shown.entity)?;
        let map = if shown.insert.is_some() { scale * shown.map } else { scale };
        let pieces: Vec<Piece> = pieces.iter().flat_map(|piece| piece.mapped(&map)).collect();
        if !pieces.is_empty() {
            curves.push(Curve { layer: shown.layer, pieces, is_closed });
        }
    }
    Ok(curves)
}

/// The wanted entities of the model itself and of its blocks. Hidden entities are chosen by name only, or if there is nothing else.
fn choose<'m, 'a>(model: &'m Model<'a>, choice: &PathChoice<'_>) -> Result<[Vec<Shown<'m, 'a>>; 2], DrawingFileError> {
    let own = model.own();
    if choice.is_open() {
        let visible: Vec<Shown<'m, 'a>> = own.iter().filter(|shown| !shown.is_hidden()).cloned().collect();
        let inserted: Vec<Shown<'m, 'a>> = model.inserted().into_iter().filter(|shown| !shown.is_hidden()).collect();
        return match (visible.is_empty() && inserted.is_empty(), own.is_empty()) {
            (false, _) => Ok([visible, inserted]),
            (true, false) => Ok([own, vec![]]),
            (true, true) => Err(no_path(model)),
        };
    }
    if let Some(id) = choice.id.filter(|_| choice.is_id()) {
        return choose_by_id(model, &own, id);
    }
    let all: Vec<Shown<'m, 'a>> = own.into_iter().chain(model.inserted()).collect();
    let of = all.len();
    let is_wanted = |(number, shown): &(usize, Shown<'m, 'a>)| {
        choice.id.is_none_or(|id| has_id(model, shown, id))
            && choice.label.is_none_or(|wanted| shown.insert.is_some_and(|insert| has_name(insert.text(2), wanted)))
            && choice.layer.is_none_or(|wanted| is_on_layer(model, shown, wanted))
            && choice.number.is_none_or(|wanted| wanted as usize == *number)
    };
    let found: Vec<Shown<'m, 'a>> = (1..).zip(all).filter(is_wanted).map(|(_, shown)| shown).collect();
    if found.is_empty() { Err(choice.not_one(0, of)) } else { Ok([found, vec![]]) }
}

fn choose_by_id<'m, 'a>(
    model: &'m Model<'a>,
    own: &[Shown<'m, 'a>],
    id: &str,
) -> Result<[Vec<Shown<'m, 'a>>; 2], DrawingFileError> {
    if let Some(only) = own.iter().find(|shown| has_name(Some(shown.entity.handle()), id)) {
        return Ok([vec![only.clone()], vec![]]);
    }
    let inserted = model.inserted();
    let is_wanted = |shown: &&Shown<'_, '_>| is_on_layer(model, shown, id) && shown.entity.text(60) != Some("1");
    let [on_layer, blocks] = [own, &inserted[..]].map(|all| all.iter().filter(is_wanted).cloned().collect::<Vec<_>>());
    if on_layer.is_empty() {
        let by_id: Vec<Shown<'m, 'a>> = inserted.iter().filter(|shown| has_id(model, shown, id)).cloned().collect();
        if !by_id.is_empty() {
            return Ok([vec![], by_id]);
        }
        if blocks.is_empty() {
            let (quoted, known) = (quoted(id), known_names(own, &inserted));
            return Err(DrawingFileError(format!("has no path with the handle, layer or block {quoted}; {known}")));
        }
    }
    Ok([on_layer, blocks])
}

/// The layers and the blocks by which a path can be chosen, for a message.
fn known_names(own: &[Shown<'_, '_>], inserted: &[Shown<'_, '_>]) -> String {
    let layers = layers(own.iter().chain(inserted).map(|shown| shown.layer));
    let mut blocks: Vec<&str> = inserted.iter().filter_map(|shown| shown.insert?.text(2)).collect();
    blocks.sort_unstable();
    blocks.dedup();
    let blocks = if blocks.is_empty() { String::new() } else { format!("; blocks: {}", listed(blocks.into_iter())) };
    format!("layers: {layers}{blocks}")
}

/// Whether an inserted entity, or what inserts it, has a handle, or its block a name.
fn has_id(model: &Model<'_>, shown: &Shown<'_, '_>, id: &str) -> bool {
    let insert = shown.insert.map(|insert| [insert.text(5), insert.text(2)]);
    let names = [Some(shown.entity.handle())].into_iter().chain(insert.into_iter().flatten());
    names.into_iter().any(|name| has_name(name, id))
        || is_within_faulty(model, shown, |entity| has_name(Some(entity.handle()), id))
}

/// Whether an entity is on a layer, or its block would show something on it if it could be placed.
fn is_on_layer(model: &Model<'_>, shown: &Shown<'_, '_>, layer: &str) -> bool {
    has_name(Some(shown.layer), layer) || is_within_faulty(model, shown, |entity| has_name(Some(entity.layer()), layer))
}

/// Whether the block of an entity cannot be placed, and has such an entity.
fn is_within_faulty(model: &Model<'_>, shown: &Shown<'_, '_>, is_wanted: impl Fn(&Entity<'_>) -> bool) -> bool {
    shown.is_faulty() && shown.entity.text(2).is_some_and(|block| model.has_within(block, is_wanted))
}

fn has_name(name: Option<&str>, wanted: &str) -> bool {
    name.is_some_and(|name| name.eq_ignore_ascii_case(wanted))
}

/// The error of a file without a curve.
fn no_path(model: &Model<'_>) -> DrawingFileError {
    if let Some(name) = model.missing_block() {
        let name = quoted(name);
        return DrawingFileError(format!(
            "has no path: the block {name} is empty or in another file: bind or explode it"
        ));
    }
    let mut kinds: Vec<&str> = model.entities.iter().map(|entity| entity.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    DrawingFileError(format!("has no path: it has only {}", listed(kinds.into_iter())))
}

/// Names of layers, for a message.
fn layers<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let mut names: Vec<&str> = names.collect();
    names.sort_unstable();
    names.dedup();
    listed(names.into_iter())
}

/// Joins curves end to end. The path begins where the first curve has a free end, or with the first curve.
fn join(mut curves: Vec<Curve<'_>>, gap_m: f64) -> Result<Drawing, DrawingFileError> {
    if let [only] = &mut curves[..] {
        return Ok(Drawing { pieces: std::mem::take(&mut only.pieces), is_closed: only.is_closed });
    }
    let count = curves.len();
    if count == 0 {
        return Err(DrawingFileError("has no path".to_owned()));
    }
    if count > MAX_JOINED {
        return Err(DrawingFileError(format!("has {count} entities, at most {MAX_JOINED} can be one path: set id")));
    }
    let order = order_of(&curves, gap_m).map_err(|reason| {
        let layers = layers(curves.iter().map(|curve| curve.layer));
        DrawingFileError(format!(
            "has {count} entities that do not join to one path: {reason}; join them, or set id to a handle or a layer; \
             layers: {layers}"
        ))
    })?;
    let mut pieces: Vec<Piece> = vec![];
    for &(number, is_reversed) in &order {
        let own = std::mem::take(&mut curves[number].pieces);
        if is_reversed {
            pieces.extend(own.iter().rev().map(Piece::reversed));
        } else {
            pieces.extend(own);
        }
    }
    let is_closed = pieces[0].begin().distance(pieces[pieces.len() - 1].end()) <= gap_m;
    Ok(Drawing { pieces, is_closed })
}

/// The order of curves in a path, and which are reversed; otherwise the reason why they are no path, in words.
fn order_of(curves: &[Curve<'_>], gap_m: f64) -> Result<Vec<(usize, bool)>, String> {
    if let Some(closed) = curves.iter().find(|curve| curve.is_closed) {
        return Err(format!("the one at {} is closed", place(closed.ends()[0])));
    }
    order(&curves.iter().map(Curve::ends).collect::<Vec<_>>(), gap_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    const POLYLINE: &str = "0\nLWPOLYLINE\n8\n0\n10\n0\n20\n5\n10\n9\n20\n5\n10\n9\n20\n8\n";

    fn section(name: &str, body: &str) -> String {
        format!("0\nSECTION\n2\n{name}\n{body}0\nENDSEC\n")
    }

    fn drawn(text: &str) -> Result<Drawing, String> {
        let choice = PathChoice { metres_per_unit: Some(1.0), gap_m: 1e-3, ..PathChoice::default() };
        path(text.as_bytes(), &choice).map_err(|error| error.to_string())
    }

    #[test]
    fn a_file_that_is_cut_short_is_refused() {
        let whole = section("ENTITIES", POLYLINE) + "0\nEOF\n";
        assert_eq!(drawn(&whole).expect("a path").pieces.len(), 2);
        let unended = "ends early: the section \"ENTITIES\" has no end, must have ENDSEC";
        let cut = |before: &str| drawn(&whole[..whole.rfind(before).expect(before)]).err();
        assert_eq!(cut("0\nENDSEC").as_deref(), Some(unended));
        assert_eq!(cut("10\n9\n20\n8").as_deref(), Some(unended));
        assert_eq!(drawn(&whole.replace("0\nENDSEC\n", "")).err().as_deref(), Some(unended));
        assert_eq!(cut("\nENDSEC").as_deref(), Some("ends early: line 21 is a group code, must have a value"));
    }

    #[test]
    fn a_point_without_its_y_is_refused() {
        let text = section("ENTITIES", &POLYLINE.replacen("20\n5\n10\n9\n", "10\n9\n", 1));
        let reason = "the \"LWPOLYLINE\" has a point without a group 20, must have one for each group 10";
        assert_eq!(drawn(&text).err().as_deref(), Some(reason));
        let spline = "0\nSPLINE\n71\n1\n40\n0\n40\n0\n40\n1\n40\n1\n10\n0\n20\n0\n10\n9\n";
        let reason = "the \"SPLINE\" has 2 groups 10 and 1 groups 20, must have as many";
        assert_eq!(drawn(&section("ENTITIES", spline)).err().as_deref(), Some(reason));
    }

    #[test]
    fn a_block_on_a_layer_that_is_off_shows_what_is_on_visible_layers() {
        let line = |layer: &str, y: u32| format!("0\nLINE\n8\n{layer}\n10\n0\n20\n{y}\n11\n9\n21\n{y}\n");
        let block = format!("0\nBLOCK\n2\nB\n{}{}0\nENDBLK\n", line("0", 1), line("Seen", 2));
        let shown = |layer: &str| {
            let layer = format!("0\nLAYER\n2\nHall\n{layer}");
            let entities = "0\nINSERT\n8\nHall\n2\nB\n10\n0\n20\n0\n";
            drawn(&(section("TABLES", &layer) + &section("BLOCKS", &block) + &section("ENTITIES", entities)))
        };
        let off = shown("62\n-7\n").expect("a path");
        assert_eq!(off.pieces[0].begin(), DVec2::new(0.0, 2.0));
        assert!(shown("70\n1\n").is_err() && shown("62\n7\n").is_err());
    }

    /// A line on the layer R, and these entities and blocks.
    fn with_line(entities: &str, blocks: &str) -> String {
        let line = "0\nLINE\n5\nA1\n8\nR\n10\n0\n20\n0\n11\n100\n21\n0\n";
        section("BLOCKS", blocks) + &section("ENTITIES", &(entities.to_owned() + line))
    }

    fn block(name: &str, inner: &str) -> String {
        format!("0\nBLOCK\n2\n{name}\n{inner}0\nENDBLK\n")
    }

    #[test]
    fn an_insertion_that_is_not_chosen_is_not_judged() {
        let insert = |name: &str, keys: &str| format!("0\nINSERT\n5\nF1\n8\nJ\n2\n{name}\n10\n0\n20\n0\n{keys}");
        let inner = |layer: &str| format!("0\nLINE\n5\nB1\n8\n{layer}\n10\n0\n20\n0\n11\n7\n21\n0\n");
        let wide = insert("B", "70\n3000\n71\n3000\n");
        let upright = insert("B", "210\n0\n220\n1\n230\n0\n");
        let looped = block("L", &insert("L", ""));
        let flat = "does not lie in a horizontal plane";
        for (text, reason) in [
            (with_line(&insert("L", ""), &looped), "has blocks in more than 32 levels, the most that is allowed"),
            (
                with_line(&wide, &block("B", &inner("0"))),
                "has 3000 columns and 3000 rows, at most 200000 blocks are allowed",
            ),
            (with_line(&upright, &block("B", &inner("K"))), flat),
        ] {
            let fault = format!("the \"INSERT\" \"F1\" {reason}");
            let metres = PathChoice { metres_per_unit: Some(1.0), gap_m: 1e-3, ..PathChoice::default() };
            let length = |choice: PathChoice<'_>| {
                path(text.as_bytes(), &choice).map(|drawing| drawing.length_m()).map_err(|error| error.to_string())
            };
            assert_eq!(length(metres), Ok(100.0));
            assert_eq!(length(PathChoice { layer: Some("R"), ..metres }), Ok(100.0));
            assert_eq!(length(PathChoice { number: Some(1), ..metres }), Ok(100.0));
            assert_eq!(length(PathChoice { id: Some("R"), ..metres }), Ok(100.0));
            for chosen in [
                PathChoice { layer: Some("J"), ..metres },
                PathChoice { number: Some(2), ..metres },
                PathChoice { id: Some("F1"), ..metres },
            ] {
                assert_eq!(length(chosen).as_ref(), Err(&fault), "{chosen:?}");
            }
            let listed = list(text.as_bytes(), &metres).expect("a list").paths;
            let faults: Vec<Option<String>> =
                listed.iter().map(|path| path.drawing.as_ref().err().map(ToString::to_string)).collect();
            assert_eq!(faults, [None, Some(fault)]);
            assert_eq!((listed[1].id.as_deref(), listed[1].layer.as_deref()), (Some("F1"), Some("J")));
        }
    }

    #[test]
    fn a_block_that_cannot_be_placed_is_a_fault_of_the_layers_and_handles_in_it() {
        let insert = "0\nINSERT\n5\nF1\n8\nJ\n2\nOUT\n10\n0\n20\n0\n41\n0\n";
        let good = "0\nINSERT\n5\nF2\n8\nJ\n2\nIN\n10\n0\n20\n0\n";
        let inner = "0\nLINE\n5\nB1\n8\nK\n10\n0\n20\n0\n11\n7\n21\n0\n";
        let blocks = block("OUT", &good.replace("F2", "F3")) + &block("IN", inner);
        let text = with_line(&(insert.to_owned() + good), &blocks);
        let metres = PathChoice { metres_per_unit: Some(1.0), gap_m: 1e-3, ..PathChoice::default() };
        let length = |choice: PathChoice<'_>| {
            path(text.as_bytes(), &choice).map(|drawing| drawing.length_m()).map_err(|error| error.to_string())
        };
        let fault = || Err("the \"INSERT\" \"F1\" has a scale of 0".to_owned());
        assert_eq!(length(PathChoice { layer: Some("K"), ..metres }), fault());
        assert_eq!(length(PathChoice { label: Some("OUT"), ..metres }), fault());
        assert_eq!(length(PathChoice { id: Some("B1"), ..metres }), fault());
        assert_eq!(length(PathChoice { label: Some("IN"), ..metres }), Ok(7.0));
        assert_eq!(length(PathChoice { id: Some("F2"), ..metres }), Ok(7.0));
        let reason =
            "has no path with the handle, layer or block \"C\"; layers: \"J\", \"K\", \"R\"; blocks: \"IN\", \"OUT\"";
        assert_eq!(length(PathChoice { id: Some("C"), ..metres }), Err(reason.to_owned()));
    }

    #[test]
    fn letters_of_layers_may_be_escaped() {
        let line = "0\nLINE\n8\nStra\\U+00DFe\n10\n0\n20\n0\n11\n9\n21\n0\n";
        let text = section("ENTITIES", &(line.to_owned() + &line.replace("Stra", "Seiten")));
        let choice = PathChoice { id: Some("Straße"), metres_per_unit: Some(1.0), ..PathChoice::default() };
        assert_eq!(path(text.as_bytes(), &choice).expect("a path").pieces.len(), 1);
        let choice = PathChoice { id: Some("Weg"), ..choice };
        let error = path(text.as_bytes(), &choice).expect_err("no such layer").to_string();
        assert!(error.contains("Straße") && error.contains("Seitenße"), "{error}");
    }

    #[test]
    fn a_polyline_in_space_is_never_mirrored() {
        let vertex = |x: u32| format!("0\nVERTEX\n10\n{x}\n20\n0\n30\n1\n");
        let begin = |flags: u32| {
            let polyline = format!("0\nPOLYLINE\n70\n{flags}\n230\n-1\n{}{}0\nSEQEND\n", vertex(1), vertex(9));
            drawn(&section("ENTITIES", &polyline)).expect("a path").pieces[0].begin().x
        };
        assert_eq!([begin(8), begin(0)], [1.0, -1.0]);
    }
}
