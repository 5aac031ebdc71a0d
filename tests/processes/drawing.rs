//! Drawn routes: what a drawing becomes, and what a bad drawing is answered with.

use std::ffi::OsStr;
use std::fmt::Write as _;
use std::fs;

use bench_dragon_ipc::DescriptionReader;
use serde_json::Value;
use test_support::eventually::eventually;
use test_support::process::{Ended, Process};
use test_support::property::case_count;
use test_support::pytest::run;

use crate::stage::{Stage, program};

/// Head of an SVG file.
const SVG: &str = r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">"#;

/// Plans a route that is drawn in a file of the stage. `keys` are further lines of `[route]`.
fn plan(stage: &Stage, name: &str, content: impl AsRef<[u8]>, keys: &str) -> Ended {
    fs::write(stage.path(name), content).expect("a drawing");
    let head = "[dragon]\nbenches = 2\n[route]\nkind = \"drawing\"\n";
    fs::write(stage.path("drawn.toml"), format!("{head}file = \"{name}\"\n{keys}\n")).expect("a configuration");
    solve(stage, &["speed-limit", "--limit", "9", "--save-config", "saved.toml"])
}

/// Asks the planner about the route that was planned last.
fn solve(stage: &Stage, question: &[&str]) -> Ended {
    let mut solve = program(&[&["solve"], question, &["--config", "drawn.toml"]].concat());
    solve.current_dir(stage.path(""));
    Process::start(solve).end()
}

/// The configuration with the path that follows a drawing.
fn saved(stage: &Stage, name: &str, content: impl AsRef<[u8]>, keys: &str) -> String {
    let ended = plan(stage, name, content, keys);
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    fs::read_to_string(stage.path("saved.toml")).expect("the saved configuration")
}

/// Fails unless a drawing is refused in one line that contains a text.
fn assert_refused(stage: &Stage, name: &str, content: impl AsRef<[u8]>, keys: &str, reason: &str) {
    let ended = plan(stage, name, content, keys);
    assert_eq!((ended.code(), ended.stdout.as_str()), (Some(2), ""), "{reason}: {}", ended.stderr);
    let error = &ended.stderr;
    assert!(error.starts_with("error: drawn.toml: [route] ") && error.lines().count() == 1, "{error:?}");
    assert!(error.contains(reason), "{reason:?} in {error:?}");
}

/// A DXF file of lines. Each is the group codes and values of its ends.
fn dxf(lines: &[&str]) -> String {
    format!("0\nSECTION\n2\nENTITIES\n0\nLINE\n8\n0\n{}\n0\nENDSEC\n0\nEOF\n", lines.join("\n0\nLINE\n8\n0\n"))
}

#[test]
fn a_drawn_square_becomes_lines_and_rounded_corners_where_it_is_drawn() {
    let stage = Stage::new();
    let square = format!("{SVG}<rect id=\"a\" x=\"10\" y=\"20\" width=\"30\" height=\"40\"/></svg>");
    let saved = saved(&stage, "square.svg", square, "corner_radius_m = 5\nlaps = 2");
    let expected = "[route]\nkind = \"path\"\nstart_x_m = 15.0\nstart_y_m = -20.0\nstart_heading_deg = 0.0\nstart_s = 0.0\n\
                    closed = true\nlaps = 2\n\n[[route.segments]]\nkind = \"line\"\nlength_m = 20.0\n\n\
                    [[route.segments]]\nkind = \"arc\"\nradius_m = 5.0\nturn_deg = -90.0\n";
    assert!(saved.contains(expected), "{saved}");
    assert_eq!(saved.matches("[[route.segments]]").count(), 8);
}

#[test]
fn a_drawing_can_be_moved_and_turned() {
    let stage = Stage::new();
    let keys = "start_x_m = 3\nstart_heading_deg = 90";
    let saved = saved(&stage, "line.csv", "x_m,y_m\n1,2\n5,2\n9,2\n", keys);
    assert!(saved.contains("start_x_m = 3.0\nstart_y_m = 2.0\nstart_heading_deg = 90.0\n"), "{saved}");
    assert!(saved.ends_with("catch_up_s = 0.25\n") || saved.contains("length_m = 8.0\n"), "{saved}");
}

#[test]
fn the_survey_of_a_drawing_has_its_size() {
    let stage = Stage::new();
    // A page of Inkscape in millimetres, at 1:100.
    let page = r#"<svg xmlns="http://www.w3.org/2000/svg" width="210mm" height="297mm" viewBox="0 0 210 297">"#;
    let content = format!("{page}<path d=\"M 20,50 H 120 V 110\"/></svg>");
    saved(&stage, "a.svg", content, "metres_per_unit = 0.02645833\ncorner_radius_m = 2\nstart_heading_deg = 30");
    let text = solve(&stage, &["route"]).stdout;
    assert!(
        text.contains("\ndrawing          10.000 m x 6.000 m, at most 0.000000 m from a.svg, allowed are"),
        "{text}"
    );
    let json = solve(&stage, &["route", "--format", "json"]).stdout;
    let answer: Value = serde_json::from_str(&json).expect("JSON");
    let [width_m, height_m] = [0, 1].map(|i| answer["drawing_size_m"][i].as_f64().expect("a number"));
    assert!((width_m - 10.0).abs() + (height_m - 6.0).abs() < 1e-5, "{answer}");
}

#[test]
fn a_published_description_has_the_path_and_not_the_drawing() {
    let stage = Stage::new();
    fs::write(stage.path("line.csv"), "0,0\n60,0\n").expect("a drawing");
    let config = "[dragon]\nbenches = 2\n[route]\nkind = \"drawing\"\nfile = \"line.csv\"\n";
    fs::write(stage.path("drawn.toml"), config).expect("a configuration");
    let server = stage.serve(&["--config", "drawn.toml", "--rate", "20"]);
    let reader = DescriptionReader::open(stage.domain(), "test").expect("a server has created the services");
    let toml = eventually("the description has arrived", || reader.poll().expect("the bus is readable")).toml;
    assert!(toml.contains("length_m = 60.0") && !toml.contains("csv"), "{toml}");
    drop(reader);
    server.stop();
}

#[test]
fn bad_drawings_are_refused_in_one_line_that_names_what_is_wrong() {
    let stage = Stage::new();
    let svg = |body: &str| format!("{SVG}{body}</svg>");
    let cases: [(&str, String, &str, &str); 23] = [
        ("a.svg", String::new(), "", "\"a.svg\": is not valid XML: "),
        ("a.svg", svg(""), "", "has no path"),
        ("a.svg", svg("<path d=\"M1 1\"/>"), "", "has no path"),
        ("a.svg", svg("<path d=\"M1 1 L 1 1 1 1\"/>"), "", "has no"),
        ("a.svg", svg("<path d=\"M1 1 h9 L 9 x\"/>"), "", "the path has wrong data near \"x\": "),
        ("a.svg", svg("<path d=\"M1 1 L foo\"/>"), "", "the path has wrong data near \"foo\": "),
        (
            "a.svg",
            svg("<path id=\"a\" d=\"M1 1 L foo\"/><path id=\"b\" d=\"M1 1h9\"/>"),
            "id = \"a\"",
            "the path \"a\" has wrong data near \"foo\": ",
        ),
        (
            "a.svg",
            svg("<path d=\"M1 1 h9 L 1e9 1\"/>"),
            "",
            "part 2 of the path has a coordinate or a length of 1000000000 m, must be a number from -100000 to 100000",
        ),
        ("a.svg", svg("<path d=\"M1 1 h9 M 1 5 h9\"/>"), "", "the path has several parts, must have one"),
        (
            "a.svg",
            svg("<path id=\"a\" d=\"M1 1 h9 M 1 5 h9\"/>"),
            "",
            "the path \"a\" has several parts, must have one",
        ),
        (
            "a.svg",
            svg("<path d=\"M1 1 h40 h-30\"/>"),
            "",
            "the path turns back on itself at (41.000, -1.000) m, which no radius rounds",
        ),
        (
            "a.svg",
            svg("<path d=\"M1 1 h40 h-30\"/>"),
            "corner_radius_m = 1",
            "the path turns back on itself at (41.000, -1.000) m, which no radius rounds",
        ),
        ("a.svg", svg("<path d=\"M0 0h9v9\"/>"), "", "has a corner of 90.0° at (9.000, 0.000) m: set corner_radius_m"),
        ("a.svg", svg("<path d=\"M0 0h9v9\"/>"), "corner_radius_m = 9.5", "at (9.000, 0.000) m: at most 9.000 m fits"),
        (
            "a.svg",
            svg("<path id=\"a\" d=\"M1 1h9\"/><path d=\"M1 5h9\"/>"),
            "",
            "has 2 paths: set id to one of them; paths: \"a\"",
        ),
        ("a.svg", svg("<path id=\"a\" d=\"M1 1h9\"/>"), "id = \"b\"", "has no path with id \"b\"; paths: \"a\""),
        (
            "a.svg",
            svg("<g id=\"b\"/><path id=\"a\" d=\"M1 1h9\"/>"),
            "id = \"b\"",
            "the element with id \"b\" is not a path",
        ),
        (
            "a.svg",
            svg("<path d=\"M1 1h9\"/>"),
            "metres_per_unit = 0",
            "metres_per_unit is 0, must be from 0.000001 to 1000000",
        ),
        ("a.svg", svg("<path d=\"M1 1h9\"/>"), "tolerance_m = 2", "tolerance_m is 2, must be from 0.0001 to 1"),
        (
            "a.svg",
            svg("<path d=\"M1 1h9\"/>"),
            "closed = true",
            "closed: the path ends at (10.000, -1.000) m, 9 m from its beginning, at most 0.0005 m is allowed",
        ),
        ("a.svg", svg("<path d=\"M1 1h9\"/>"), "laps = 2", "laps is 2, only allowed with a closed path"),
        ("a.svg", svg("<path d=\"M1 1h9\"/>"), "pitch_m = 2", "pitch_m is 2, only allowed with kind = "),
        ("a.png", String::new(), "", "has no known format, must be .svg, .dxf, .csv, .gpx, .kml or .geojson"),
    ];
    for (name, content, keys, reason) in cases {
        assert_refused(&stage, name, content, keys, reason);
    }
    assert_refused(&stage, "a.svg", [0xff, 0xfe], "", "is text in UTF-16, must be in UTF-8");
    assert_refused(&stage, "a.svg", [b'<', 0xc3], "", "UTF-8");
}

#[test]
fn bad_points_and_bad_dxf_files_are_refused_in_one_line_that_names_what_is_wrong() {
    let stage = Stage::new();
    let cases: [(&str, String, &str, &str); 11] = [
        ("a.csv", "0,0\n10,0\n5,0\n".to_owned(), "", "the path turns back on itself at (10.000, 0.000) m"),
        ("a.csv", String::new(), "", "has 0 points, must have at least 2"),
        (
            "a.csv",
            "x_m,y_m\n1,2\n3,inf\n".to_owned(),
            "",
            "line 3 has the point (3, inf) m, must be numbers from -100000",
        ),
        ("a.csv", "1,2\nNaN,2\n".to_owned(), "", "line 2 has the point (NaN, 2) m"),
        ("a.csv", "1,2\n1,2\n1,2\n".to_owned(), "", "the path has no length"),
        ("a.csv", "1,2\n3\n".to_owned(), "", "line 2 is \"3\", must be two numbers, x_m and y_m"),
        ("a.dxf", "0\nSECTION\n2\nENTITIES\n0\nENDSEC\n".to_owned(), "", "has no path: it has no entities"),
        ("a.dxf", String::new(), "", "\"a.dxf\": is empty"),
        (
            "a.dxf",
            "0\nSECTION\n2\nENTITIES\n0\nLINE\n10\n1\n0\nENDSEC\n".to_owned(),
            "",
            "has no unit of length in its header",
        ),
        (
            "a.dxf",
            "0\nSECTION\n2\nENTITIES\n0\nLINE\n10\nx\n0\nENDSEC\n".to_owned(),
            "metres_per_unit = 1",
            "has \"x\" in group 10",
        ),
        (
            "a.dxf",
            dxf(&["10\n0\n20\n0\n11\n10\n21\n0", "10\n10.001\n20\n0\n11\n20\n21\n0"]),
            "metres_per_unit = 1",
            "has 2 entities that do not join to one path: the nearest ends, at (10.000, 0.000) m and (10.001, 0.000) m, \
             are 0.001 m apart, at most 0.0005 m is allowed; join them, or set id to a handle or a layer; layers: \"0\"",
        ),
    ];
    for (name, content, keys, reason) in cases {
        assert_refused(&stage, name, content, keys, reason);
    }
}

#[test]
fn a_missing_drawing_and_a_folder_are_refused() {
    let stage = Stage::new();
    for (file, reason) in [("none.svg", "cannot be read: No such file"), (".svg", "has no known format")] {
        fs::write(stage.path("drawn.toml"), format!("[route]\nkind = \"drawing\"\nfile = \"{file}\"\n"))
            .expect("a file");
        let ended = stage.run(&["show", "--config", "drawn.toml"]);
        assert_eq!(ended.code(), Some(2), "{}", ended.stderr);
        assert!(ended.stderr.contains(reason) && ended.stderr.lines().count() == 1, "{}", ended.stderr);
    }
}

#[test]
fn xml_bombs_and_external_entities_are_refused() {
    let stage = Stage::new();
    let mut lol = String::from("<!DOCTYPE svg [<!ENTITY a0 \"M0 0\">");
    for i in 0..20 {
        write!(lol, "<!ENTITY a{} \"{}\">", i + 1, format!("&a{i};").repeat(10)).expect("text");
    }
    let bomb = format!("{lol}]>{SVG}<path d=\"&a20;\"/></svg>");
    assert_refused(&stage, "a.svg", bomb, "", "is not valid XML");
    let external = format!("<!DOCTYPE svg [<!ENTITY e SYSTEM \"/etc/passwd\">]>{SVG}<path d=\"&e;\"/></svg>");
    assert_refused(&stage, "a.svg", external, "", "is not valid XML");
    let mut uses = String::from("<g id=\"u0\"><path d=\"M0 0h9\"/></g>");
    for i in 0..12 {
        let own = format!("<use href=\"#u{i}\"/>").repeat(10);
        write!(uses, "<g id=\"u{}\">{own}</g>", i + 1).expect("text");
    }
    assert_refused(&stage, "a.svg", format!("{SVG}{uses}</svg>"), "", "at most 400000 are allowed");
    let deep = "<g>".repeat(100_000) + "<path d=\"M0 0h9\"/>" + &"</g>".repeat(100_000);
    assert_refused(&stage, "a.svg", format!("{SVG}{deep}</svg>"), "", "has elements in more than 1000 levels");
}

#[test]
fn a_million_points_are_followed_and_noise_is_refused() {
    let stage = Stage::new();
    let mut points = String::new();
    for i in 0..1_000_000 {
        let (sine, cosine) = (f64::from(i) * 6e-5).sin_cos();
        let radius_m = 40.0 - 2e-5 * f64::from(i);
        writeln!(points, "{:.4},{:.4}", radius_m * cosine, radius_m * sine).expect("text");
    }
    let saved = saved(&stage, "spiral.csv", points, "");
    assert!(saved.matches("[[route.segments]]").count() < 200, "{}", saved.len());
    let mut noise = String::new();
    let mut random = fastrand::Rng::with_seed(7);
    for _ in 0..1_000_000 {
        writeln!(noise, "{},{}", 100.0 * random.f64(), 100.0 * random.f64()).expect("text");
    }
    assert_refused(&stage, "noise.csv", noise, "", "the path has a corner of ");
}

#[test]
fn a_route_that_no_description_can_hold_is_refused() {
    let stage = Stage::new();
    let waves = "c0 10 10 10 10 0c0 -10 10 -10 10 0".repeat(60);
    let content = format!("{SVG}<path d=\"M0 0{waves}\"/></svg>");
    assert_refused(
        &stage,
        "waves.svg",
        content,
        "tolerance_m = 0.0002",
        "bytes, at most 262144 are allowed: set tolerance_m",
    );
    let zigzag = "l1 1l1 -1".repeat(4500);
    assert_refused(
        &stage,
        "zigzag.svg",
        format!("{SVG}<path d=\"M0 0{zigzag}\"/></svg>"),
        "corner_radius_m = 0.01",
        "bytes, at most 262144 are allowed: 8999 rounded corners need most of them: draw a path with fewer corners",
    );
}

#[test]
fn independent_libraries_measure_the_routes_of_random_drawings() {
    let program = OsStr::new(env!("CARGO_BIN_EXE_bench-dragon"));
    let drawings = case_count(6).to_string();
    run("test_drawing.py", &[("BENCH_DRAGON", program), ("DRAWINGS", OsStr::new(&drawings))]);
}
