//! Texts and edits: an edit changes its numbers and nothing else, whatever a hand does.

use std::path::Path;

use serde_json::{Value, json};

use super::answerer::Answerer;
use super::edit::Edit;
use super::handle::{Handle, HandleId, HandleKind, handles};
use super::newest::Newest;
use super::plan::{Plan, Touch};
use super::plan_folder::PlanFolder;
use super::route_edit::NewSegment;
use super::stage_handles::NewBorder;
use crate::config::Config;

use test_support::property::case_count;

/// A street with two corners, with comments everywhere.
const STREET: &str = "# the street
[dragon]
benches = 12 # a short one

[route] # drawn by hand
kind = \"path\"
start_x_m = 0.0

# up the street
[[route.segments]]
kind = \"line\" # first
length_m = 20 # metres

[[route.segments]]
kind = \"arc\"
radius_m = 4.0 # at the well
turn_deg = 90.0

[[route.segments]]
kind = \"line\"
length_m = 20.0

[[route.segments]]
kind = \"arc\"
radius_m = 4.0
turn_deg = -90.0
[[route.segments]]
kind = \"line\"
length_m = 20.0 # the square

[stage]
outline = [[-40, -40], [60, -40], [60, 60], [-40, 60]] # ropes
";

const INLINE: &str = "[route]
kind = 'path'
segments = [
    { kind = 'line', length_m = 30 }, # in
    { kind = 'spiral', start_radius_m = 8.0, end_radius_m = 4.0, turn_deg = 360.0 },
    { kind = 'arc', radius_m = 2.0, turn_deg = 180.0 }, # round
    { kind = 'line', length_m = 10.0 },
]
[dragon]
benches = 10
";

const DRAGONS: &str = "[[dragons]]
name = 'gold' # leads
benches = 8
[dragons.route]
kind = 'turnaround'
start_s = -20.0
end_s = 20.0
[[dragons]]
name = 'silver'
benches = 8
[dragons.route]
kind = 'path'
start_x_m = -60.0
segments = [{ kind = 'line', length_m = 20 }, { kind = 'arc', radius_m = 5, turn_deg = 30 }, { kind = 'line', length_m = 20 }]
";

fn folder() -> PlanFolder {
    PlanFolder::of(Some(&Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/paper.toml"))).expect("the folder")
}

fn config(text: &str) -> Config {
    folder().config(text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn find(text: &str, kind: HandleKind, at: usize) -> Handle {
    let all = handles(text, &config(text));
    let found = all.into_iter().find(|handle| handle.id.kind == kind && handle.id.at == at);
    found.unwrap_or_else(|| panic!("no handle {kind:?} {at}"))
}

fn moved(text: &str, handle: HandleId, to_m: [f64; 2]) -> String {
    Edit::Move { handle, to_m }.apply(text, &config(text)).expect("the text has this place")
}

/// The lines that differ, before and after.
fn difference<'a>(before: &'a str, after: &'a str) -> Vec<(&'a str, &'a str)> {
    assert_eq!(before.lines().count(), after.lines().count(), "{after}");
    before.lines().zip(after.lines()).filter(|(before, after)| before != after).collect()
}

#[test]
fn a_dragged_corner_is_under_the_hand_and_all_other_corners_stay() {
    let before = find(STREET, HandleKind::Corner, 1);
    let text = moved(STREET, before.id, [26.0, -3.0]);
    let (corner, next) = (find(&text, HandleKind::Corner, 1), find(&text, HandleKind::Corner, 3));
    assert!((corner.x_m - 26.0).abs() < 2e-3 && (corner.y_m + 3.0).abs() < 2e-3, "{corner:?}");
    let (was, is) = (find(STREET, HandleKind::Corner, 3), next);
    assert!((was.x_m - is.x_m).hypot(was.y_m - is.y_m) < 5e-3, "{was:?} {is:?}");
    let (was, is) = (find(STREET, HandleKind::End, 4), find(&text, HandleKind::End, 4));
    assert!((was.x_m - is.x_m).hypot(was.y_m - is.y_m) < 5e-3, "{was:?} {is:?}");
}

#[test]
fn an_edit_keeps_every_comment_and_every_other_line() {
    let text = moved(STREET, find(STREET, HandleKind::End, 4).id, [52.0, 28.0]);
    for (before, after) in difference(STREET, &text).into_iter().filter(|(before, _)| before.contains('#')) {
        assert_eq!(before.split('#').nth(1), after.split('#').nth(1));
    }
    let radius = Edit::Set { keys: find(STREET, HandleKind::Corner, 1).fields[0].keys.clone(), value: 5.5 };
    let text = radius.apply(STREET, &config(STREET)).expect("a number");
    assert_eq!(difference(STREET, &text), [("radius_m = 4.0 # at the well", "radius_m = 5.5 # at the well")]);
    let point = find(STREET, HandleKind::Outline, 0).id;
    let text = moved(STREET, point, [-41.0, -42.5]);
    let [(_, after)] = difference(STREET, &text)[..] else { panic!("{text}") };
    assert_eq!(after, "outline = [[-41, -42.5], [60, -40], [60, 60], [-40, 60]] # ropes");
}

#[test]
fn a_new_corner_and_its_removal_leave_the_text_as_it_was() {
    for (text, line) in [(STREET, 2), (INLINE, 0), (DRAGONS, 2)] {
        let middle = find(text, HandleKind::Middle, line);
        let longer = moved(text, middle.id, [middle.x_m + 1.0, middle.y_m + 2.0]);
        let corner = find(&longer, HandleKind::Corner, line + 1);
        assert!((corner.x_m - middle.x_m - 1.0).abs() < 5e-3, "{longer}");
        let deleted = Edit::Delete { handle: corner.id }.apply(&longer, &config(&longer)).expect("a corner");
        let numbers = |text: &str| -> Vec<(f64, f64)> {
            handles(text, &config(text)).iter().map(|handle| (handle.x_m, handle.y_m)).collect()
        };
        for (was, is) in numbers(text).into_iter().zip(numbers(&deleted)) {
            assert!((was.0 - is.0).hypot(was.1 - is.1) < 0.02, "{text}\n{longer}\n{deleted}");
        }
        assert!(text.split('#').skip(1).all(|rest| deleted.contains(rest.lines().next().unwrap_or_default())));
    }
}

#[test]
fn spirals_and_turnarounds_follow_the_hand() {
    let paper = "[route]\nkind = \"spiral\"\npitch_m = 0.55 # m\nstart_turns = 16\n";
    let start = find(paper, HandleKind::SpiralStart, 0);
    assert!((start.x_m - 8.8).abs() < 1e-9);
    let text = moved(paper, start.id, [0.0, 8.0]);
    let at = find(&text, HandleKind::SpiralStart, 0);
    assert!(at.x_m.abs() < 1e-3 && (at.y_m - 7.8).abs() < 0.3, "{at:?}");
    let pitch = find(paper, HandleKind::Pitch, 0);
    let text = moved(paper, pitch.id, [1.1 * pitch.x_m, 1.1 * pitch.y_m]);
    assert_eq!(difference(paper, &text), [("pitch_m = 0.55 # m", "pitch_m = 0.605 # m")]);
    let circle = find(DRAGONS, HandleKind::TurnCircle, 0);
    let text = moved(DRAGONS, circle.id, [0.0, -5.0]);
    assert!(text.contains("turn_diameter_m = 10.0"), "{text}");
    let end = find(INLINE, HandleKind::SpiralEnd, 1);
    let text = moved(INLINE, end.id, [end.x_m + 0.4, end.y_m - 0.3]);
    let at = find(&text, HandleKind::SpiralEnd, 1);
    assert!((at.x_m - end.x_m - 0.4).hypot(at.y_m - end.y_m + 0.3) < 0.01, "{end:?} {at:?}");
}

/// Random edits of each text, times the factor of the environment.
const EDITS: u32 = 700;
/// Longest text that is edited further: a random hand adds more than it takes away.
const MAX_TEXT: usize = 20_000;

#[test]
fn random_edits_neither_panic_nor_lose_a_comment() {
    let mut random = fastrand::Rng::with_seed(7);
    let folder = folder();
    // Few benches, so that the test stays short.
    for text in [STREET, INLINE, DRAGONS]
        .map(|text| text.replace("benches = 1", "benches = 2 #").replace("benches = 8", "benches = 3"))
    {
        let (mut now, mut known) = (text.clone(), config(&text));
        let comments = |text: &str| text.matches('#').count();
        for _ in 0..case_count(EDITS) {
            let all = handles(&now, &known);
            let handle = &all[random.usize(0..all.len())];
            let step = |random: &mut fastrand::Rng| 10f64.powf(random.f64() * 5.0 - 3.0) * (random.f64() - 0.5);
            let edit = match random.u8(0..12) {
                10 | 11 => any_edit(&mut random, handle.id.dragon),
                0 => Edit::Delete { handle: handle.id },
                1 if !handle.fields.is_empty() => {
                    let field = &handle.fields[random.usize(0..handle.fields.len())];
                    Edit::Set { keys: field.keys.clone(), value: field.value + step(&mut random) }
                }
                2 => Edit::Move { handle: HandleId { at: random.usize(0..9), ..handle.id }, to_m: [0.0; 2] },
                _ => Edit::Move {
                    handle: handle.id,
                    to_m: [handle.x_m + step(&mut random), handle.y_m + step(&mut random)],
                },
            };
            let Ok(edited) = edit.apply(&now, &known) else { continue };
            let takes_away = matches!(edit, Edit::Delete { .. } | Edit::Through { .. } | Edit::Border { .. });
            if !takes_away && !matches!(edit, Edit::AddDragon | Edit::RemoveDragon { .. }) {
                assert_eq!(comments(&edited), comments(&now), "{edit:?}\n{now}\n{edited}");
            }
            // A plan that no dragon can walk is reported, and the last good one stays.
            if edited.len() > MAX_TEXT {
                continue;
            }
            if let Ok(config) = folder.config(&edited).and_then(if_short) {
                (now, known) = (edited, config);
            }
        }
    }
}

/// An edit of a whole route, of the stage, or of the dragons.
fn any_edit(random: &mut fastrand::Rng, dragon: usize) -> Edit {
    let points_m: Vec<[f64; 2]> =
        (0..random.usize(1..6)).map(|_| [0, 1].map(|_| (random.f64() * 40.0 - 20.0).round())).collect();
    match random.u8(0..9) {
        0 => Edit::Mirror { dragon },
        1 => Edit::Reverse { dragon },
        2 => Edit::Close { dragon },
        3 => {
            let segments = [NewSegment::Line, NewSegment::Arc, NewSegment::Spiral, NewSegment::Turnaround];
            Edit::Insert { dragon, after: Some(random.usize(0..5)), segment: segments[random.usize(0..4)] }
        }
        4 => Edit::Through { dragon, points_m, radius_m: 2.0 },
        5 | 6 => {
            let borders = [NewBorder::Outline, NewBorder::KeepOut, NewBorder::Crowd];
            Edit::Border { border: borders[random.usize(0..3)], points_m }
        }
        7 => Edit::AddDragon,
        _ => Edit::RemoveDragon { dragon },
    }
}

/// Keeps random plans small, so that the test stays short.
fn if_short(config: Config) -> Result<Config, String> {
    let is_short = config.formation().dragons().len() <= 4
        && config.formation().dragons().iter().all(|planned| {
            let route = planned.dragon.route();
            route.end_travel_m() - route.start_travel_m() < 300.0
        });
    if is_short { Ok(config) } else { Err("long".to_owned()) }
}

fn ask(answerer: &mut Answerer<'_>, question: Value) -> Value {
    let questions = Newest::new();
    questions.put(serde_json::from_value(question).expect("a question"), |_, newer| newer);
    let mut answers = Vec::new();
    answerer.answer_all(&questions, |answer| {
        answers.push(answer.clone());
        false
    });
    answers.pop().expect("an answer")
}

#[test]
fn a_question_gets_the_drawing_the_contact_and_the_pose_and_a_bad_text_its_line() {
    let studies = Newest::new();
    let mut answerer = Answerer::new(folder().into(), &studies);
    let plan = ask(&mut answerer, json!({ "number": 1, "text": super::PAPER }));
    assert_eq!((&plan["type"], &plan["contact"]["pair"]["benches"]), (&json!("plan"), &json!([0, 8])), "{plan}");
    assert!((plan["contact"]["time_s"].as_f64().expect("a time") - 412.473_838).abs() < 1e-6);
    assert_eq!(plan["pose"]["handles"].as_array().map(Vec::len), Some(2 * 224));
    let study = studies.take().expect("the plan is studied");
    assert_eq!(study.number, 1);

    let mistake = ask(&mut answerer, json!({ "number": 2, "text": "[route]\nkind = \"spirale\"\n" }));
    assert_eq!((&mistake["type"], &mistake["number"]), (&json!("mistake"), &json!(2)));
    assert!(mistake["reason"].as_str().expect("a line").starts_with("line 2, "), "{mistake}");
    let pose = ask(&mut answerer, json!({ "number": 3, "at_s": 1e9 }));
    assert_eq!(pose["pose"]["handles"].as_array().map(Vec::len), Some(2 * 224), "the last good plan is still there");

    let edit =
        json!({ "kind": "move", "handle": { "dragon": 0, "kind": "whole", "at": 0, "point": 0 }, "to_m": [1.0, 2.0] });
    let moved = ask(&mut answerer, json!({ "number": 4, "text": super::PAPER, "edit": edit }));
    assert!(moved["text"].as_str().expect("a text").contains("start_y_m = 2.0"), "{moved}");
    assert!(
        (moved["contact"]["point_m"][1].as_f64().expect("a number")
            - plan["contact"]["point_m"][1].as_f64().expect("a number")
            - 2.0)
            .abs()
            < 1e-6
    );
}

#[test]
fn the_saved_version_stands_beside_the_plan_at_the_same_time_until_it_is_no_longer_wanted() {
    let studies = Newest::new();
    let mut answerer = Answerer::new(folder().into(), &studies);
    let plan = ask(&mut answerer, json!({ "number": 1, "text": STREET, "saved": super::PAPER, "at_s": 8.5 }));
    let paper = Plan { text: super::PAPER.to_owned(), config: config(super::PAPER) };
    let time_s = plan["pose"]["time_s"].as_f64().expect("a time");
    assert_eq!(plan["saved"]["handles"], paper.pose(time_s)["handles"]);
    assert_eq!(plan["saved"]["run"]["benches"], 223, "its routes are new");
    let pose = ask(&mut answerer, json!({ "number": 2, "at_s": 3.0 }));
    assert_eq!(pose["saved"], json!({ "handles": paper.pose(3.0)["handles"] }));
    let bare = ask(&mut answerer, json!({ "number": 3, "text": STREET, "saved": "" }));
    assert_eq!(bare["saved"], Value::Null);
    let bad = ask(&mut answerer, json!({ "number": 4, "text": STREET, "saved": "[route]\nkind = 3\n" }));
    assert_eq!(
        (&bad["type"], &bad["saved"]),
        (&json!("plan"), &Value::Null),
        "a saved version with a mistake is not drawn"
    );
}

#[test]
fn a_long_search_ends_with_the_contact_of_one_search() {
    let text = "[dragon]\nbenches = 60\n";
    let plan = Plan { text: text.to_owned(), config: config(text) };
    let Touch::Found { time_s, benches, .. } = plan.touch(plan.times_s(), 1_000_000_000) else { panic!("it touches") };
    let studies = Newest::new();
    let study = super::study::Study { number: 9, plan: plan.clone(), touch: plan.touch(plan.times_s(), 2_000) };
    assert!(matches!(study.touch, Touch::Free { to_s } if to_s < time_s), "the quick search does not reach it");
    studies.put(study, |_, newer| newer);
    let (mut contact, mut misses, mut kinds) = (Value::Null, Value::Null, Vec::new());
    super::study::study_all(&folder(), &studies, |answer| {
        assert_eq!(answer["number"], 9);
        kinds.push(answer["type"].as_str().expect("a type").to_owned());
        if answer["type"] == "contact" {
            contact = answer["contact"].clone();
        }
        if answer["type"] == "misses" {
            misses = answer["misses"].clone();
        }
        if answer["type"] == "speeds" {
            studies.close();
        }
        true
    });
    assert!((contact["time_s"].as_f64().expect("a time") - time_s).abs() < 1e-6, "{contact}, not {time_s}");
    assert_eq!(contact["pair"]["benches"], json!(benches));
    assert_eq!(misses.as_array().map(Vec::len), Some(3), "the published near misses: {misses}");
    assert_eq!(kinds.last().map(String::as_str), Some("speeds"));
}

/// Two dragons that cross each other's way at the same time.
const CROSSING: &str = "# two streets
[[dragons]]
name = 'gold' # leads
benches = 8
[dragons.route]
kind = 'path'
start_x_m = -30.0
segments = [{ kind = 'line', length_m = 60 }]
[[dragons]]
name = 'silver'
benches = 8
[dragons.route]
kind = 'path'
start_y_m = -30.0
start_heading_deg = 90.0
segments = [{ kind = 'line', length_m = 60 }]
";

fn mended(text: &str) -> Vec<(String, Plan)> {
    let plan = Plan { text: text.to_owned(), config: config(text) };
    let touch = plan.touch(plan.times_s(), 1_000_000_000);
    let mends = super::mend::mends(&plan, &folder(), touch);
    let after = |mend: &Value| {
        let edit: Edit = serde_json::from_value(json!({ "kind": "put", "puts": mend["puts"] })).expect("an edit");
        let text = edit.apply(text, &plan.config).expect("the text has this place");
        (mend["words"].as_str().expect("words").to_owned(), Plan { config: config(&text), text })
    };
    mends.iter().map(after).collect()
}

#[test]
fn each_mend_takes_its_problem_away_and_keeps_every_comment() {
    let spiral = "[route] # ours\nkind = \"spiral\"\npitch_m = 0.5 # narrow\nend_s = 360\n";
    let found = mended(spiral);
    assert!(found[0].0.starts_with("pitch 0.5") && found[1].0.starts_with("end at "), "{found:?}");
    let crossing = mended(CROSSING);
    let [(words, later)] = &crossing[..] else { panic!("{crossing:?}") };
    assert!(words.starts_with("start ") && words.ends_with(" s later"), "{words}");
    assert!(later.text.contains("# two streets") && later.text.contains("'gold' # leads"), "{}", later.text);
    for (words, plan) in found.iter().chain(&crossing) {
        let touch = plan.touch(plan.times_s(), 1_000_000_000);
        assert!(matches!(touch, Touch::Free { to_s } if to_s >= plan.times_s()[1]), "{words}: {touch:?}");
    }
    let tight = "[dragon]\nbenches = 8\n[route]\nkind = 'path'\nsegments = [{ kind = 'line', length_m = 20 }, \
                 { kind = 'arc', radius_m = 0.6, turn_deg = 180 }, # round\n{ kind = 'line', length_m = 20 }]\n";
    let bend = mended(tight);
    let (words, plan) = bend.last().unwrap_or_else(|| panic!("so tight a bend stops the dragon"));
    assert!(words.starts_with("radius ") && plan.text.contains("# round"), "{words}\n{}", plan.text);
    assert!(plan.planned()[0].dragon.tight_spot().is_none(), "{words}");
}

#[test]
fn an_answer_changes_only_the_values_that_differ() {
    let text = "# mine\n[head]\nspeed_mps = 1.0 # walk\n[route]\nkind = \"spiral\" # in\npitch_m = 0.55\n";
    let (before, after) = (config(text), config(&text.replace("0.55", "0.6").replace("1.0 #", "1.5 #")));
    let table = |config: &Config| toml::from_str::<toml::Table>(&config.to_toml()).expect("a document");
    let puts = super::change::difference(&table(&before), &table(&after));
    let text = Edit::Put { puts }.apply(text, &before).expect("the text has these places");
    assert_eq!(text, "# mine\n[head]\nspeed_mps = 1.5 # walk\n[route]\nkind = \"spiral\" # in\npitch_m = 0.6\n");
}

fn edited(text: &str, edit: &Edit) -> String {
    edit.apply(text, &config(text)).unwrap_or_else(|reason| panic!("{edit:?}: {reason}"))
}

/// Where the points of a route are, and how far each is from those of another text.
fn furthest_m(one: &str, other: &str) -> f64 {
    let places = |text: &str| -> Vec<[f64; 2]> {
        handles(text, &config(text)).iter().map(|handle| [handle.x_m, handle.y_m]).collect()
    };
    let pairs = places(one).into_iter().zip(places(other));
    pairs.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max)
}

#[test]
fn a_route_that_is_mirrored_or_reversed_twice_is_as_it_was_with_its_comments() {
    for text in [STREET, INLINE] {
        for edit in [Edit::Mirror { dragon: 0 }, Edit::Reverse { dragon: 0 }] {
            let once = edited(text, &edit);
            let twice = edited(&once, &edit);
            assert!(furthest_m(text, &once) > 1.0 && furthest_m(text, &twice) < 0.02, "{edit:?}\n{once}\n{twice}");
            assert_eq!(text.matches('#').count(), twice.matches('#').count(), "{twice}");
        }
    }
    let well = edited(STREET, &Edit::Reverse { dragon: 0 });
    assert!(well.contains("radius_m = 4.0 # at the well\nturn_deg = -90.0"), "{well}");
}

#[test]
fn a_path_is_closed_made_longer_and_drawn_through_corners() {
    let closed = edited(STREET, &Edit::Close { dragon: 0 });
    assert!(closed.contains("closed = true") && config(&closed).document().route().as_path().is_some(), "{closed}");
    let longer = edited(INLINE, &Edit::Insert { dragon: 0, after: None, segment: NewSegment::Turnaround });
    assert_eq!(config(&longer).document().route().as_path().map(|path| path.segments.len()), Some(5), "{longer}");
    let points_m = vec![[0.0, 0.0], [20.0, 0.0], [20.0, 15.0]];
    for text in [STREET, DRAGONS, "# nothing yet\n[dragon]\nbenches = 8\n"] {
        let through = edited(text, &Edit::Through { dragon: 0, points_m: points_m.clone(), radius_m: 3.0 });
        let corner = find(&through, HandleKind::Corner, 1);
        assert!((corner.x_m - 20.0).hypot(corner.y_m) < 2e-3, "{through}");
        let names = |text: &str| handles(text, &config(text)).iter().filter(|at| at.id.kind.border().is_some()).count();
        assert_eq!(names(text), names(&through), "{through}");
    }
}

/// Its arc would cut off nearly all of both lines: the route would stay metres away from the corner.
#[test]
fn a_route_that_turns_back_at_a_corner_is_refused() {
    for points_m in
        [vec![[0.0, 0.0], [14.0, 0.0], [1.0, 1.2]], vec![[0.0, 0.0], [6.0, 0.0], [0.0, 0.05]], vec![[0.0, 0.0]]]
    {
        let refused = Edit::Through { dragon: 0, points_m, radius_m: 2.0 }.apply(STREET, &config(STREET));
        assert!(refused.is_err_and(|reason| reason.contains("turn back by more than 170°")));
    }
}

#[test]
fn borders_are_drawn_and_taken_out_point_by_point() {
    let area = vec![[5.0, 5.0], [7.0, 5.0], [7.0, 7.0], [5.0, 7.0]];
    let draw = |text: &str, border| edited(text, &Edit::Border { border, points_m: area.clone() });
    let bare = "[dragon]\nbenches = 8\n";
    let one = draw(bare, NewBorder::KeepOut);
    let two = draw(&one, NewBorder::KeepOut);
    assert!(two.contains("keep_out = [[[5.0, 5.0]"), "{two}");
    let mut text = draw(&draw(&two, NewBorder::Crowd), NewBorder::Outline);
    assert_eq!(handles(&text, &config(&text)).iter().filter(|handle| handle.can_delete).count(), 16, "{text}");
    for _ in 0..20 {
        let all = handles(&text, &config(&text));
        let Some(handle) = all.iter().find(|handle| handle.can_delete && handle.id.kind.border().is_some()) else {
            break;
        };
        text = edited(&text, &Edit::Delete { handle: handle.id });
    }
    assert!(!text.contains("5.0"), "{text}");
}

/// Its comments, and the form of the array, stay.
#[test]
fn a_point_comes_into_a_border_between_the_ends_of_a_side() {
    let text = "[stage]\noutline = [[0, 0], [40, 0], # along the wall\n  [40, 30]]\nkeep_out = [[[5, 5], [7, 5], [7, 7]]]\ncrowd = [[0, -2], [40, -2]]\n";
    let insert = |text: &str, kind, point| {
        let handle = HandleId { dragon: 0, kind, at: 0, point };
        edited(text, &Edit::Move { handle, to_m: [9.0, 8.5] })
    };
    let middles = |kind| handles(text, &config(text)).iter().filter(|handle| handle.id.kind == kind).count();
    let kinds = [HandleKind::OutlineMiddle, HandleKind::KeepOutMiddle, HandleKind::CrowdMiddle];
    assert_eq!(kinds.map(middles), [3, 3, 1]);
    assert!(
        insert(text, kinds[0], 0).contains("outline = [[0, 0], [9.0, 8.5], [40, 0], # along the wall\n  [40, 30]]")
    );
    let between = insert(text, kinds[0], 1);
    assert!(between.contains("[40, 0], # along the wall\n  [9.0, 8.5],\n  [40, 30]]"), "{between}");
    let last = insert(text, kinds[1], 2);
    assert!(last.contains("keep_out = [[[5, 5], [7, 5], [7, 7], [9.0, 8.5]]]"), "{last}");
    let line = insert(text, kinds[2], 0);
    assert!(line.contains("crowd = [[0, -2], [9.0, 8.5], [40, -2]]"), "{line}");
}

#[test]
fn a_dragon_comes_beside_the_others_and_goes_again() {
    for text in [STREET, DRAGONS, "# only the paper\n"] {
        let more = edited(text, &Edit::AddDragon);
        let all = config(&more);
        assert_eq!(all.formation().dragons().len(), config(text).formation().dragons().len() + 1, "{more}");
        all.named().expect("several").require_apart().expect("they stand apart");
        assert!(text.split('#').skip(1).all(|rest| more.contains(rest.lines().next().unwrap_or_default())), "{more}");
        let last = all.formation().dragons().len() - 1;
        let fewer = edited(&more, &Edit::RemoveDragon { dragon: last });
        assert_eq!(config(&fewer).formation().dragons().len(), last.max(1), "{fewer}");
    }
}
