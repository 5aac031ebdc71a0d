//! Random edits, one after another.

use glam::DVec2;
use test_support::property::case_count;

use super::{DRAGONS, INLINE, STREET, config, folder};
use crate::config::Config;
use crate::display::planner::edit::Edit;
use crate::display::planner::handle::{HandleId, handles};
use crate::display::planner::plan::{Plan, Touch};
use crate::display::planner::route_edit::NewSegment;
use crate::display::planner::stage_handles::NewBorder;

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

/// Random drags of each text, times the factor of the environment.
const DRAGS: u32 = 150;
/// Difference of a contact's time in seconds, and of its place in metres, from search to search.
const ROUNDING: f64 = 1e-6;

#[test]
fn what_is_known_of_the_plan_before_gives_the_same_contact() {
    let mut random = fastrand::Rng::with_seed(11);
    let folder = folder();
    let mut known = 0;
    for text in [STREET.replace("benches = 12", "benches = 40"), INLINE.replace("benches = 10", "benches = 40")] {
        let mut now = Plan { config: config(&text), text };
        let mut touch = now.quick_touch(None);
        for _ in 0..case_count(DRAGS) {
            let all = handles(&now.text, &now.config);
            let handle = &all[random.usize(0..all.len())];
            let step = |random: &mut fastrand::Rng| 4.0 * (random.f64() - 0.5);
            let to_m = [handle.x_m + step(&mut random), handle.y_m + step(&mut random)];
            let edit = Edit::Move { handle: handle.id, to_m };
            let Ok(text) = edit.apply(&now.text, &now.config) else { continue };
            let Ok(config) = folder.config(&text).and_then(if_short) else { continue };
            let plan = Plan { text, config };
            known += usize::from(now.config.route().same_to_m(plan.config.route()) > 0.0);
            let (cold, warm) = (plan.quick_touch(None), plan.quick_touch(Some((&now, touch))));
            let is_same = match (cold, warm) {
                (
                    Touch::Found { time_s, benches, point_m },
                    Touch::Found { time_s: other_s, benches: others, point_m: other_m },
                ) => {
                    let off_m = DVec2::from(point_m).distance(other_m.into());
                    benches == others && (time_s - other_s).abs() < ROUNDING && off_m < ROUNDING
                }
                // With what is known, the same work reaches further.
                (Touch::Free { to_s }, Touch::Free { to_s: reached_s } | Touch::Found { time_s: reached_s, .. }) => {
                    reached_s >= to_s - ROUNDING
                }
                (Touch::Found { .. }, Touch::Free { .. }) => false,
            };
            assert!(is_same, "{cold:?}, with what is known {warm:?}\n{}\nafter\n{}", plan.text, now.text);
            (now, touch) = (plan, warm);
        }
    }
    assert!(known > 100, "{known}");
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
