//! Drawings as other programs write them: what becomes of them, and the line that refuses what cannot be applied.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::{Value, json};
use test_support::process::{Ended, Process};

use crate::stage::{Stage, program};

/// Folder of drawings that other programs wrote.
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/processes/drawings");

/// Asks for a survey of a drawn route. `keys` are further lines of `[route]`, and tables behind it.
fn survey(stage: &Stage, file: &Path, keys: &str) -> Ended {
    let file = file.display();
    let config = format!("[dragon]\nbenches = 2\n[route]\nkind = \"drawing\"\nfile = \"{file}\"\n{keys}\n");
    fs::write(stage.path("drawn.toml"), config).expect("a configuration");
    let mut command = program(&["solve", "route", "--config", "drawn.toml", "--format", "json"]);
    command.current_dir(stage.path(""));
    Process::start(command).end()
}

/// The survey of a file of the folder.
fn kept(name: &str, keys: &str) -> Value {
    survey(&Stage::new(), &Path::new(FOLDER).join(name), keys).expect_clean().last_json()
}

/// The survey of a drawing with this text.
fn of_text(name: &str, text: impl AsRef<[u8]>, keys: &str) -> Ended {
    let stage = Stage::new();
    fs::write(stage.path(name), text).expect("a drawing");
    survey(&stage, &stage.path(name), keys)
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn assert_length(answer: &Value, expected_m: f64) {
    let length_m = number(&answer["length_m"]);
    assert!((length_m - expected_m).abs() < 1e-3, "{length_m} is not {expected_m}: {answer}");
}

/// Fails unless a drawing is refused in one line with this text.
fn assert_refused(ended: &Ended, reason: &str) {
    assert_eq!((ended.code(), ended.stdout.as_str()), (Some(2), ""), "{reason}: {}", ended.stderr);
    let error = &ended.stderr;
    assert!(error.lines().count() == 1 && error.contains(reason), "{reason:?} in {error:?}");
}

fn svg(body: &str) -> String {
    format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 400 400\">{body}</svg>")
}

#[test]
fn a_closed_drawing_is_smoothed_at_its_seam_as_at_any_other_joint() {
    let keys = "metres_per_unit = 0.2\ncorner_radius_m = 3";
    let answer = kept("seam.svg", keys);
    assert!(number(&answer["fit_error_m"]) <= 0.005, "{answer}");
    assert!((number(&answer["length_m"]) - 125.66).abs() < 0.1, "{answer}");
    // The same circle, whose ends meet at angles from 0.06° to 1.9°.
    for millidegrees in [60, 200, 700, 1300, 1900] {
        let (sine, cosine) = (f64::from(millidegrees) * 1e-3).to_radians().sin_cos();
        let control = format!("{:.4} {:.4}", 300.0 + 55.228 * sine, 200.0 - 55.228 * cosine);
        let (begin, rest) = ("M300 200", "C300 255.228 255.228 300 200 300S100 255.228 100 200S144.772 100 200 100");
        let drawn = svg(&format!("<path d=\"{begin}{rest}C255.228 100 {control} 300 200Z\"/>"));
        let answer = of_text("seam.svg", drawn, keys).expect_clean().last_json();
        assert!(number(&answer["fit_error_m"]) <= 0.005, "{millidegrees}: {answer}");
    }
}

#[test]
fn a_seam_with_a_slight_kink_is_smoothed_between_lines_and_arcs_too() {
    // A rounded rectangle whose first side ends half a degree off, begun at each of its vertices.
    let vertices = [(0.0, 0.0, 0.0), (40.0, 0.35, 0.414), (45.0, 5.0, 0.0), (45.0, 30.0, 0.414), (40.0, 35.0, 0.0)];
    let vertices = [&vertices[..], &[(0.0, 35.0, 0.414), (-5.0, 30.0, 0.0), (-5.0, 5.0, 0.414)]].concat();
    for first in 0..vertices.len() {
        let mut text = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n6\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nLWPOLYLINE\n8\n0\n70\n1\n".to_owned();
        for (x, y, bulge) in vertices.iter().cycle().skip(first).take(vertices.len()) {
            let _ = write!(text, "10\n{x}\n20\n{y}\n42\n{bulge}\n");
        }
        text += "0\nENDSEC\n0\nEOF\n";
        let answer = of_text("round.dxf", text, "corner_radius_m = 2").expect_clean().last_json();
        assert!(number(&answer["fit_error_m"]) <= 0.005, "{first}: {answer}");
    }
}

#[test]
fn a_drawing_in_survey_coordinates_is_placed_or_the_line_proposes_how() {
    let placed = kept("survey.csv", "start_x_m = 0\nstart_y_m = 0\ncorner_radius_m = 5");
    let by_origin = kept("survey.csv", "corner_radius_m = 5\n[origin]\nx_m = 500000\ny_m = 4000000");
    let near = of_text("near.csv", "x_m,y_m\n0,0\n100,0\n200,20\n", "corner_radius_m = 5").expect_clean().last_json();
    for answer in [&placed, &by_origin] {
        assert_length(answer, number(&near["length_m"]));
        assert_eq!(answer["segments"], near["segments"]);
    }
    let polyline = "500000,-4000000 500100,-4000000 500200,-4000020";
    let drawn = svg(&format!("<polyline points=\"{polyline}\"/>"));
    let line = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n6\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nLWPOLYLINE\n8\n0\n70\n0\n10\n500000\n20\n4000000\n\
                10\n500100\n20\n4000000\n10\n500200\n20\n4000020\n0\nENDSEC\n0\nEOF\n";
    let csv = fs::read_to_string(Path::new(FOLDER).join("survey.csv")).expect("a drawing");
    for (name, text) in [("a.svg", drawn.as_str()), ("a.dxf", line), ("a.csv", &csv)] {
        let answer =
            of_text(name, text, "start_x_m = 0\nstart_y_m = 0\ncorner_radius_m = 5").expect_clean().last_json();
        assert_length(&answer, number(&near["length_m"]));
        let reason = "the path begins at (500000, 4000000) m, further than 100000 m from the origin: set start_x_m = 0 and \
                      start_y_m = 0, or [origin] x_m = 500000 and y_m = 4000000";
        assert_refused(&of_text(name, text, "corner_radius_m = 5"), reason);
    }
    assert_refused(
        &of_text("a.csv", "0,0\n9,0\n", "start_s = 0\n[origin]\nx_m = 1e9"),
        "[origin] x_m is 1000000000, must be from",
    );
}

#[test]
fn what_is_not_chosen_is_not_judged() {
    let answer = kept("other_layer.dxf", "id = \"route\"\ncorner_radius_m = 5");
    assert!((number(&answer["length_m"]) - 163.6).abs() < 1.0, "{answer}");
    let layers = "0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLAYER\n0\nLAYER\n2\nOff\n70\n0\n62\n-7\n0\nLAYER\n2\nCold\n70\n1\n62\n7\n0\nENDTAB\n0\nENDSEC\n";
    let line = |keys: &str| format!("0\nLINE\n{keys}\n10\n0\n20\n0\n11\n50\n21\n0\n");
    let bad = |keys: &str| format!("0\nCIRCLE\n{keys}\n10\n5\n20\n5\n40\n0\n");
    for hidden in ["8\nOff", "8\ncold", "8\n0\n60\n1", "8\n0\n67\n1"] {
        let text = format!("{layers}0\nSECTION\n2\nENTITIES\n{}{}0\nENDSEC\n0\nEOF\n", bad(hidden), line("8\n0"));
        assert_length(&of_text("a.dxf", &text, "metres_per_unit = 1").expect_clean().last_json(), 50.0);
    }
    let both = format!("0\nSECTION\n2\nENTITIES\n{}{}0\nENDSEC\n", bad("5\nA1\n8\n0"), line("5\nA2\n8\n0"));
    assert_length(&of_text("a.dxf", &both, "metres_per_unit = 1\nid = \"a2\"").expect_clean().last_json(), 50.0);
    assert_refused(
        &of_text("a.dxf", &both, "metres_per_unit = 1"),
        "the \"CIRCLE\" \"A1\" has the radius 0, must be above 0",
    );
    let wrong = "<path id=\"a\" d=\"M0 0 L 1e300 0\"/><path id=\"c\" transform=\"turn(3)\" d=\"M0 0h9\"/><path id=\"b\" d=\"M0 0h50\"/>";
    assert_length(&of_text("a.svg", svg(wrong), "id = \"b\"").expect_clean().last_json(), 50.0);
    assert_refused(&of_text("a.svg", svg(wrong), "id = \"a\""), "the path \"a\" has the number 1e300, must be from");
    assert_refused(
        &of_text("a.svg", svg(wrong), "id = \"c\""),
        "the element <path> \"c\" has the transform \"turn(3)\"",
    );
}

#[test]
fn columns_are_found_by_name_or_refused_with_the_known_names() {
    let answer = kept("degrees.csv", "");
    // A circle's arc through the three points; the two chords have 349.50 m.
    assert!((number(&answer["length_m"]) - 351.35).abs() < 0.01, "{answer}");
    let refused = of_text("a.csv", "id,height\n1,2\n3,4\n", "");
    assert_refused(&refused, "has the columns \"id\", \"height\", must have x_m and y_m, or lon and lat");
    assert_refused(&of_text("a.csv", "lon,lat\n1,2\n3,4\n", ""), "from their centre, at most 10 km can be projected");
}

#[test]
fn rows_and_names_of_a_table_fit_or_are_refused() {
    for (text, reason) in [
        ("x,y\n0,5,0,5\n100,5,20,7\n", "line 2 is \"0,5,0,5\", with 4 columns, must have 2 as the first row"),
        ("x,x_m,y\n0,0,5\n100,5,20\n", "has the columns \"x\", \"x_m\", must have one of them"),
        ("x,y,x\n0,5,0\n100,5,20\n", "has several columns \"x\", must have one"),
        ("lon,lat,lat\n0,5,0\n100,5,20\n", "has several columns \"lat\", must have one"),
    ] {
        assert_refused(&of_text("a.csv", text, ""), reason);
    }
    assert_length(&of_text("a.csv", "x,y\n0,5,\n100,5,,\n", "").expect_clean().last_json(), 100.0);
}

#[test]
fn sizes_are_applied_or_refused() {
    let page = |style: &str, body: &str| svg(body).replacen("<svg", &format!("<svg {style}"), 1);
    let path = "<path d=\"M40 40H140\"/>";
    for (text, keys, length_m) in [
        (page("style=\"width:800px;height:800px\"", path), "", 200.0),
        (page("style=\"width:100%;height:auto\"", path), "", 100.0),
        (svg(&format!("<style>svg {{ width: 800px; height: 800px }}</style>{path}")), "", 200.0),
        (page("style=\"width:800mm;height:800mm\"", path), "scale = \"1:100\"", 20.0),
        (svg("<g font-size=\"10px\"><rect width=\"2em\" height=\"3em\"/></g>"), "corner_radius_m = 1", 98.283_185),
    ] {
        assert_length(&of_text("a.svg", &text, keys).expect_clean().last_json(), length_m);
    }
    let symbol = |keys: &str, body: &str, used: &str| {
        svg(&format!("<symbol id=\"a\" viewBox=\"0 0 100 100\" {keys}>{body}</symbol><use href=\"#a\" {used}/>"))
    };
    let path = "<path d=\"M4 4H14\"/>";
    let share = "has a size in per cent, which is not supported with a symbol";
    for (text, reason) in [
        (page("style=\"width:50vw\"", path), "has the property width \"50vw\", which is not supported for the page"),
        (symbol("", path, "width=\"50%\" height=\"50%\""), share),
        (symbol("width=\"50%\"", path, ""), share),
        (symbol("", "<line x2=\"50%\" y2=\"0\"/>", ""), share),
        (symbol("", "<svg viewBox=\"0 0 9 9\"><path d=\"M4 4H14\"/></svg>", ""), share),
        (
            svg("<circle cx=\"20\" cy=\"20\" r=\"1em\"/>"),
            "the element <circle> has a length in em or ex, but no font-size: use another unit",
        ),
    ] {
        assert_refused(&of_text("a.svg", &text, ""), reason);
    }
}

#[test]
fn style_sheets_of_other_files_are_refused() {
    let drawn = svg("<path d=\"M0 0h10\"/>");
    let text = format!("<?xml-stylesheet href=\"a.css\"?>{drawn}");
    assert_refused(&of_text("a.svg", text, ""), "has the style sheet \"href=\"a.css\"\", which is not read");
}

#[test]
fn large_coordinates_of_single_precision_are_refused() {
    let keys = "start_x_m = 0\nstart_y_m = 0\nmetres_per_unit = 1";
    for body in [
        "<line x1=\"500000.1\" y1=\"-4000000\" x2=\"500003.4\" y2=\"-4000000\"/>",
        "<circle cx=\"500000\" cy=\"-4000000\" r=\"20\"/>",
        "<path transform=\"translate(500000.1 -4000000)\" d=\"M0 0H10\"/>",
        "<path transform=\"rotate(30 500000 -4000000)\" d=\"M500000 -4000000h10\"/>",
        "<g transform=\"translate(500000.1)\"><path transform=\"translate(-500000.3)\" d=\"M0 0H10\"/></g>",
        "<path transform=\"rotate(30)\" d=\"M500000 -4000000h10\"/>",
    ] {
        assert_refused(&of_text("a.svg", svg(body), keys), "has coordinates too large for its shape or transform");
    }
    let path = "<path d=\"M500000.1 -4000000H500003.4\"/>";
    assert_length(&of_text("a.svg", svg(path), keys).expect_clean().last_json(), 3.3);
    let line = "<line transform=\"translate(300 4)\" x1=\"100\" x2=\"103.3\"/>";
    assert_length(&of_text("a.svg", svg(line), keys).expect_clean().last_json(), 3.3);
}

#[test]
fn transforms_of_css_are_applied_or_refused() {
    assert_length(&kept("css_transform.svg", "metres_per_unit = 1"), 200.0);
    for (body, length_m) in [
        ("<path transform=\"scale(2)\" d=\"M0 0h10\"/>", 20.0),
        ("<path style=\"transform:rotate(30deg) scale(2)\" d=\"M0 0h10\"/>", 20.0),
        ("<g style=\"transform: scaleX(300%)\"><path d=\"M0 0h10\"/></g>", 30.0),
        (
            "<style>.a { transform: scale(2); } /* x */ path.b { transform: none }</style><path class=\"a\" d=\"M0 0h10\"/>",
            20.0,
        ),
        ("<style>path { transform: scale(2) !important }</style><path style=\"transform:none\" d=\"M0 0h10\"/>", 20.0),
        ("<style><![CDATA[ g > path { transform: translate(1in, 2px) } ]]></style><g><path d=\"M0 0h10\"/></g>", 10.0),
        ("<path style=\"transform-box:fill-box;transform:translate(3px)\" d=\"M0 0h10\"/>", 10.0),
        ("<path style=\"d: path('M0 0h33')\" d=\"M0 0h10\"/>", 33.0),
        ("<path style=\"/* c */transform:scale(2)\" d=\"M0 0h10\"/>", 20.0),
        ("<path style=\"/*x;*/d:path('M0 0h33')\" d=\"M0 0h10\"/>", 33.0),
        ("<path style=\"/*x*/display:none\" d=\"M0 0h99\"/><path d=\"M0 0h10\"/>", 10.0),
        ("<path style=\"-webkit-transform:scale(2)\" d=\"M0 0h10\"/>", 20.0),
        ("<style>@import url('https://fonts.googleapis.com/css?family=A');</style><path d=\"M0 0h10\"/>", 10.0),
        ("<style media=\"print\">path { transform: scale(2) }</style><path d=\"M0 0h10\"/>", 10.0),
        ("<style media=\"screen\">path { transform: scale(2) }</style><path d=\"M0 0h10\"/>", 20.0),
        ("<style>g { path { fill: red } }</style><g><path d=\"M0 0h10\"/></g>", 10.0),
        ("<circle style=\"r:7px\" cx=\"20\" cy=\"20\" r=\"1\"/>", 43.982_297),
        (
            "<style>@media print { path { display: none } } @font-face { src: x } a:hover { transform: scale(2) }</style><path d=\"M0 0h10\"/>",
            10.0,
        ),
        (
            "<symbol id=\"s\" viewBox=\"0 0 100 100\" width=\"50\" height=\"50\"><path d=\"M0 0h10\"/></symbol><use href=\"#s\"/>",
            5.0,
        ),
        (
            "<symbol id=\"s\" viewBox=\"0 0 100 100\" width=\"50\" height=\"50\"><path d=\"M0 0h10\"/></symbol><use href=\"#s\" width=\"200\" height=\"200\"/>",
            20.0,
        ),
    ] {
        assert_length(&of_text("a.svg", svg(body), "").expect_clean().last_json(), length_m);
    }
    for (body, reason) in [
        (
            "<path id=\"a\" style=\"transform:translate(50%)\" d=\"M0 0h10\"/>",
            "\"a\" has the transform \"translate(50%)\", which is not supported",
        ),
        (
            "<g style=\"transform-box:fill-box;transform:scale(2)\"><path d=\"M0 0h10\"/></g>",
            "<g> has the transform-box \"fill-box\", must be view-box",
        ),
        (
            "<path style=\"rotate:30deg\" d=\"M0 0h10\"/>",
            "has the property rotate \"30deg\", which is not supported: use transform",
        ),
        ("<path style=\"offset-path:path('M0 0')\" d=\"M0 0h10\"/>", "has the property offset-path"),
        (
            "<style>path:nth-child(2) { transform: scale(2) }</style><path d=\"M0 0h10\"/>",
            "has a style sheet with \"path:nth-child(2)\"",
        ),
        (
            "<style>@import \"a.css\";</style><path d=\"M0 0h10\"/>",
            "has a style sheet with \"@import \"a.css\"\", which is not supported",
        ),
        (
            "<use href=\"other.svg#a\"/><path d=\"M0 0h10\"/>",
            "the element <use> shows \"other.svg#a\", must be in the file itself",
        ),
        (
            "<style>g{ path{transform:scale(2)} }</style><g><path d=\"M0 0h10\"/></g>",
            "has a style sheet with \"g { path{transform:scale(2)}",
        ),
        (
            "<style>@media screen { path { transform: scale(2) } }</style><path d=\"M0 0h10\"/>",
            "has a style sheet with \"@media screen\"",
        ),
        (
            "<style media=\"(min-width: 9px)\">path { transform: scale(2) }</style><path d=\"M0 0h10\"/>",
            "has a style sheet with \"@media (min-width: 9px)\"",
        ),
        ("<style>} path { transform: scale(2) }</style><path d=\"M0 0h10\"/>", "has a style sheet with \"} path\""),
        (
            "<symbol id=\"s\" transform=\"scale(2)\"><path d=\"M0 0h10\"/></symbol><use href=\"#s\"/>",
            "has a transform, which is not supported for a symbol: move its use element",
        ),
        ("<rect width=\"calc(1px + 3px)\" height=\"3\"/><path d=\"M0 0h10\"/>", "has 2 paths: set id to one of them"),
        (
            "<circle cx=\"20\" cy=\"20\" r=\"1rem\"/>",
            "the element <circle> has the r \"1rem\", which is not a known length",
        ),
    ] {
        assert_refused(&of_text("a.svg", svg(body), ""), reason);
    }
}

#[test]
fn blocks_are_exploded() {
    assert_length(&kept("block.dxf", ""), 100.0);
    let file = |blocks: &str, entities: &str| {
        format!("0\nSECTION\n2\nBLOCKS\n{blocks}0\nENDSEC\n0\nSECTION\n2\nENTITIES\n{entities}0\nENDSEC\n0\nEOF\n")
    };
    let line = "0\nLINE\n8\n0\n10\n1\n20\n1\n11\n11\n21\n1\n";
    let block = |name: &str, inner: &str| format!("0\nBLOCK\n2\n{name}\n10\n1\n20\n1\n{inner}0\nENDBLK\n");
    let insert = |name: &str, keys: &str| format!("0\nINSERT\n5\nF{name}\n8\nway\n2\n{name}\n10\n5\n20\n5\n{keys}");
    let keys = "metres_per_unit = 1";
    for (entities, more, length_m) in [
        (insert("a", ""), "", 10.0),
        (insert("A", "41\n2\n42\n2\n"), "", 20.0),
        (insert("a", "41\n-1\n50\n90\n"), "", 10.0),
        (insert("a", "70\n3\n44\n10\n"), "", 30.0),
        (insert("a", "71\n4\n45\n10\n50\n90\n"), "\nid = \"none\"", f64::NAN),
        (insert("b", "41\n3\n42\n3\n"), "", 60.0),
        (insert("a", "230\n-1\n210\n0\n220\n0\n"), "", 10.0),
        (insert("a", ""), "\nid = \"way\"", 10.0),
        (insert("a", ""), "\nid = \"Fa\"", 10.0),
        (insert("a", ""), "\nlayer = \"WAY\"", 10.0),
        (format!("{}0\nLINE\n8\n0\n10\n15\n20\n5\n11\n15\n21\n5.001\n", insert("a", "")), "\nnumber = 2", 10.0),
        // A block that does not join is something else.
        (format!("{}0\nLINE\n8\n0\n10\n0\n20\n99\n11\n40\n21\n99\n", insert("a", "")), "", 40.0),
        // One that joins is a part of the path.
        (format!("{}0\nLINE\n8\n0\n10\n15\n20\n5\n11\n40\n21\n5\n", insert("a", "")), "", 35.0),
    ] {
        let blocks = block("a", line) + &block("b", &insert("a", "41\n2\n42\n2\n"));
        let ended = of_text("a.dxf", file(&blocks, &entities), &format!("{keys}{more}"));
        if length_m.is_nan() {
            assert_refused(
                &ended,
                "has no path with the handle, layer or block \"none\"; layers: \"way\"; blocks: \"a\"",
            );
            continue;
        }
        assert_length(&ended.expect_clean().last_json(), length_m);
    }
    let looped = block("a", &insert("a", "")) + &block("b", line);
    assert_refused(&of_text("a.dxf", file(&looped, &insert("a", "")), keys), "has blocks in more than 32 levels");
    assert_refused(
        &of_text("a.dxf", file("", &insert("x", "")), keys),
        "has no path: the block \"x\" is empty or in another file",
    );
    let wide = insert("a", "70\n60000\n71\n60000\n");
    assert_refused(&of_text("a.dxf", file(&block("a", line), &wide), keys), "has 60000 columns and 60000 rows");
    assert_refused(&of_text("a.dxf", file("", "0\nTEXT\n8\n0\n1\nx\n"), keys), "has no path: it has only \"TEXT\"");
}

#[test]
fn the_work_of_style_sheets_is_bounded() {
    let answer = kept("css_deep.svg", "");
    assert_length(&answer, 10.0);
    let rules = ".a{fill:red}".repeat(60_000);
    assert_length(
        &of_text("a.svg", svg(&format!("<style>{rules}</style><path d=\"M0 0h10\"/>")), "").expect_clean().last_json(),
        10.0,
    );
    let selector = "g ".repeat(20);
    let (open, close) = ("<g>".repeat(40), "</g>".repeat(40));
    let deep = format!("<style>x {selector} path {{ transform: scale(2) }}</style>{open}<path d=\"M0 0h10\"/>{close}");
    assert_refused(&of_text("a.svg", svg(&deep), ""), "has a style sheet whose 1 rules take too long");
    let uses: String = (0..40).fold("<path id=\"u0\" d=\"M0 0h10\"/>".to_owned(), |mut text, i| {
        let _ = write!(text, "<g id=\"u{}\"><use href=\"#u{i}\"/><use href=\"#u{i}\"/></g>", i + 1);
        text
    });
    assert_refused(&of_text("a.svg", svg(&uses), ""), "shows 1000000000 elements");
    let levels = format!("{}<path d=\"M0 0h10\"/>{}", "<g>".repeat(5_000), "</g>".repeat(5_000));
    assert_refused(&of_text("a.svg", svg(&levels), ""), "has elements in more than 1000 levels");
}

#[test]
fn what_a_file_really_is_is_told() {
    for (name, bytes, reason) in [
        ("a.svg", &b"\x1f\x8b\x08\0"[..], "is compressed by gzip"),
        ("a.svg", b"\xff\xfe<\0s\0", "is text in UTF-16"),
        (
            "a.svg",
            b"<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?><svg id=\"\xe9\"/>",
            "is text in \"ISO-8859-1\", must be in UTF-8",
        ),
        ("a.dxf", b"AC1032\0\0\0\0", "is a DWG file: save it as DXF in text form"),
        ("a.dxf", b"AutoCAD Binary DXF\r\n\x1a\0", "is a binary DXF file, must be in text form"),
        ("a.csv", b"PK\x03\x04", "is a ZIP archive"),
        ("a.svgz", b"\x1f\x8b\x08\0", "is compressed by gzip"),
        ("a.dwg", b"AC1032\0\0\0\0", "is a DWG file: save it as DXF in text form"),
        ("a.kmz", b"PK\x03\x04", "is a ZIP archive"),
        ("a.svg", b"<kml xmlns=\"http://www.opengis.net/kml/2.2\"/>", "begins with the element \"kml\", must be svg"),
        ("a.shp", b"x", "has no known format, must be .svg, .dxf, .csv, .gpx, .kml or .geojson"),
    ] {
        assert_refused(&of_text(name, bytes, ""), reason);
    }
}

#[test]
fn lines_on_the_earth_are_projected_about_their_centre() {
    let gpx = "<gpx xmlns=\"http://www.topografix.com/GPX/1/1\"><trk><name>Way</name><trkseg><trkpt lat=\"37.941\" lon=\"140.946\"/>\
               <trkpt lat=\"37.943\" lon=\"140.949\"/></trkseg></trk></gpx>";
    let kml = "<kml xmlns=\"http://www.opengis.net/kml/2.2\"><Document><Folder><name>North</name><Placemark id=\"p\"><name>Way</name>\
               <LineString><coordinates>140.946,37.941,0 140.949,37.943,0</coordinates></LineString></Placemark></Folder></Document></kml>";
    let json = r#"{"type":"FeatureCollection","features":[{"type":"Feature","id":7,"properties":{"name":"Way","n":[1]},
                  "geometry":{"type":"LineString","coordinates":[[140.946,37.941,3],[140.949,37.943,3]]}},
                  {"type":"Feature","properties":null,"geometry":{"type":"Point","coordinates":[1,2]}}]}"#;
    for (name, text) in [("a.gpx", gpx), ("a.kml", kml), ("a.geojson", json)] {
        assert_length(&of_text(name, text, "").expect_clean().last_json(), 344.703);
        assert_length(&of_text(name, text, "label = \"Way\"").expect_clean().last_json(), 344.703);
        assert_refused(&of_text(name, text, "label = \"Other\""), "has 0 paths with label \"Other\", must have 1");
        assert_refused(&of_text(name, text, "metres_per_unit = 2"), "has positions in degrees: omit metres_per_unit");
    }
    let ring = r#"{"type":"Polygon","coordinates":[[[0,0],[0.001,0],[0.001,0.001],[0,0.001],[0,0]]]}"#;
    let answer = of_text("a.geojson", ring, "corner_radius_m = 5").expect_clean().last_json();
    assert!(number(&answer["length_m"]) > 400.0, "{answer}");
    let two = json.replace("\"Point\",\"coordinates\":[1,2]", "\"LineString\",\"coordinates\":[[1,2],[1.001,2]]");
    assert_refused(&of_text("a.json", &two, ""), "has 2 lines: \"Way\"; set label or number to one of them");
    assert!(
        (number(&of_text("a.json", &two, "number = 2").expect_clean().last_json()["length_m"]) - 111.25).abs() < 0.2
    );
    assert_refused(&of_text("a.geojson", "{\"type\":", ""), "is not a valid GeoJSON file");
    let projected = json.replacen('{', r#"{"crs":{"type":"name","properties":{"name":"EPSG:25832"}},"#, 1);
    assert_refused(
        &of_text("a.geojson", projected, ""),
        "has positions in \"EPSG:25832\", must be longitude and latitude",
    );
}

#[test]
fn a_path_is_chosen_by_label_layer_or_number_and_listed() {
    let drawn = "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" \
                 width=\"210mm\" height=\"297mm\" viewBox=\"0 0 210 297\">\
                 <g id=\"layer1\" inkscape:groupmode=\"layer\" inkscape:label=\"Streets\">\
                 <path id=\"path1\" inkscape:label=\"north\" d=\"M0 0h10\"/><path id=\"path2\" d=\"M0 9h20\"/></g>\
                 <g id=\"layer2\" inkscape:groupmode=\"layer\" inkscape:label=\"Houses\"><circle id=\"c\" cx=\"50\" cy=\"50\" r=\"10\"/>\
                 <path id=\"broken\" d=\"M0 0h9M5 5h5\"/></g></svg>";
    for (keys, length_m) in [
        ("scale = \"1:100\"\nlabel = \"north\"", 1.0),
        ("scale = \"1:100\"\nnumber = 2", 2.0),
        ("scale = \"1:1000\"\nlayer = \"Streets\"\nid = \"path1\"", 10.0),
        ("scale = \"1 : 50\"\nlayer = \"layer1\"\nnumber = 1", 0.5),
    ] {
        let answer = of_text("a.svg", drawn, keys).expect_clean().last_json();
        assert!((number(&answer["length_m"]) - length_m).abs() < 1e-5, "{keys}: {answer}");
    }
    assert_refused(
        &of_text("a.svg", drawn, "layer = \"Streets\""),
        "has 2 paths with layer \"Streets\", must have 1; solve route --list shows all 4",
    );
    assert_refused(&of_text("a.svg", drawn, "number = 5"), "has 0 paths with number 5");
    assert_refused(
        &of_text("a.svg", svg("<path d=\"M0 0h9\"/>"), "scale = \"1:100\""),
        "the page has no size for a scale: set metres_per_unit",
    );
    assert_refused(
        &of_text("a.svg", drawn.replace("210mm", "210"), "scale = \"1:100\"\nnumber = 1"),
        "the page is \"210\" wide or high, must be in mm",
    );
    assert_refused(&of_text("a.svg", drawn, "scale = \"100\""), "[route] scale is \"100\", must be such as \"1:100\"");
    let stage = Stage::new();
    fs::write(stage.path("a.svg"), drawn).expect("a drawing");
    let list = |format: &str| {
        let mut command = program(&["solve", "route", "--list", "a.svg", "--format", format]);
        command.current_dir(stage.path(""));
        Process::start(command).end().expect_clean()
    };
    let answer = list("json").last_json();
    let paths = answer["paths"].as_array().expect("paths");
    assert_eq!((paths.len(), &answer["unit"]), (4, &json!("drawing")), "an SVG has pixels");
    assert_eq!(
        (&paths[0]["id"], &paths[0]["label"], &paths[0]["layer"], &paths[0]["closed"]),
        (&json!("path1"), &json!("north"), &json!("Streets"), &json!(false))
    );
    assert_eq!((&paths[2]["number"], &paths[2]["closed"], &paths[2]["fault"]), (&json!(3), &json!(true), &Value::Null));
    assert!(paths[3]["fault"].as_str().is_some_and(|fault| fault.contains("has several parts")), "{answer}");
    let text = list("text").stdout;
    assert!(text.starts_with("4 paths in a.svg\nnumber  id"), "{text}");
    assert!(text.contains("1       path1   north  Streets"), "{text}");
    assert!(text.contains("length in units of the drawing"), "{text}");
}

#[test]
fn a_drawing_and_a_map_share_an_origin() {
    let stage = Stage::new();
    let rows = "1 1 1 1\n".repeat(4);
    let map = format!("ncols 4\nnrows 4\nxllcorner 499900\nyllcorner 3999900\ncellsize 100\n{rows}");
    fs::write(stage.path("hill.asc"), map).expect("a map");
    let keys = "corner_radius_m = 5\n[origin]\nx_m = 500000\ny_m = 4000000\n[ground]\nheights = \"hill.asc\"\n";
    let answer = survey(&stage, &Path::new(FOLDER).join("survey.csv"), keys).expect_clean().last_json();
    assert_eq!((number(&answer["lowest_m"]), number(&answer["highest_m"])), (1.0, 1.0), "{answer}");
}

#[test]
fn lines_of_a_table_may_end_as_on_an_old_macintosh() {
    let answer = of_text("a.csv", "x_m,y_m\r0,0\r50,0\r", "").expect_clean().last_json();
    assert_eq!(number(&answer["length_m"]), 50.0);
}

#[test]
fn a_unit_that_no_stage_has_is_named_and_an_american_mile_is_read() {
    let line = |unit| {
        format!(
            "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n{unit}\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nLINE\n8\n0\n10\n0\n\
             20\n0\n11\n0.1\n21\n0\n0\nENDSEC\n0\nEOF\n"
        )
    };
    for unit in ["18", "25", "x"] {
        let reason = format!("has the unit \"{unit}\" in its header ($INSUNITS), must be 1 to 17 or 21 to 24");
        assert_refused(&of_text("a.dxf", line(unit), ""), &reason);
    }
    let mile = of_text("a.dxf", line("24"), "").expect_clean().last_json();
    assert!((number(&mile["length_m"]) - 160.934_722).abs() < 1e-6, "{mile}");
}
