//! Answers to the questions of a page.

use bench_dragon_geometry::dragon::{Meter, Question};
use serde_json::{Value, json};

use super::{STREET, config, folder};
use crate::display::planner::PAPER;
use crate::display::planner::answerer::Answerer;
use crate::display::planner::newest::Newest;
use crate::display::planner::plan::{Plan, Touch};
use crate::display::planner::study::{Study, study_all};

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
    let plan = ask(&mut answerer, json!({ "number": 1, "text": PAPER }));
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
    let moved = ask(&mut answerer, json!({ "number": 4, "text": PAPER, "edit": edit }));
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
    let plan = ask(&mut answerer, json!({ "number": 1, "text": STREET, "saved": PAPER, "at_s": 8.5 }));
    let paper = Plan { text: PAPER.to_owned(), config: config(PAPER) };
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
fn what_is_known_of_a_plan_that_begins_elsewhere_is_searched_again() {
    let plan = |speed_mps: f64, start_s: f64| {
        let text = format!("[head]\nspeed_mps = {speed_mps:?}\n[route]\nstart_s = {start_s:?}\n");
        Plan { config: config(&text), text }
    };
    // At half of the speed the run begins before the other one; at 1.4 times the speed behind its contact.
    for (other, speed_mps) in [(plan(1.0, 413.0), 0.5), (plan(1.0, 300.0), 1.4)] {
        let touch = other.quick_touch(None);
        let own = plan(speed_mps, other.times_s()[0]);
        let (cold, warm) = (own.quick_touch(None), own.quick_touch(Some((&other, touch))));
        assert_eq!(format!("{warm:?}"), format!("{cold:?}"), "after {touch:?}");
    }
}

#[test]
fn a_long_search_ends_with_the_contact_of_one_search() {
    let text = "[dragon]\nbenches = 60\n";
    let plan = Plan { text: text.to_owned(), config: config(text) };
    let Touch::Found { time_s, benches, .. } = plan.touch(plan.times_s(), &Meter::of(1_000_000_000)) else {
        panic!("it touches")
    };
    let studies = Newest::new();
    let study = Study {
        number: 9,
        plan: plan.clone(),
        touch: plan.touch(plan.times_s(), &Meter::of(2_000)),
        question: Question::default(),
    };
    assert!(matches!(study.touch, Touch::Free { to_s } if to_s < time_s), "the quick search does not reach it");
    studies.put(study, |_, newer| newer);
    let (mut contact, mut misses, mut kinds) = (Value::Null, Value::Null, Vec::new());
    study_all(&folder(), &studies, |answer| {
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
