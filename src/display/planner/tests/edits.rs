//! An edit changes its numbers and nothing else.

use super::{DRAGONS, INLINE, STREET, config};
use crate::config::Config;
use crate::display::planner::change;
use crate::display::planner::edit::Edit;
use crate::display::planner::handle::{Handle, HandleId, HandleKind, handles};
use crate::display::planner::route_edit::NewSegment;
use crate::display::planner::stage_handles::NewBorder;

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

fn edited(text: &str, edit: &Edit) -> String {
    edit.apply(text, &config(text)).unwrap_or_else(|reason| panic!("{edit:?}: {reason}"))
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

#[test]
fn an_answer_changes_only_the_values_that_differ() {
    let text = "# mine\n[head]\nspeed_mps = 1.0 # walk\n[route]\nkind = \"spiral\" # in\npitch_m = 0.55\n";
    let (before, after) = (config(text), config(&text.replace("0.55", "0.6").replace("1.0 #", "1.5 #")));
    let table = |config: &Config| toml::from_str::<toml::Table>(&config.to_toml()).expect("a document");
    let puts = change::difference(&table(&before), &table(&after));
    let text = Edit::Put { puts }.apply(text, &before).expect("the text has these places");
    assert_eq!(text, "# mine\n[head]\nspeed_mps = 1.5 # walk\n[route]\nkind = \"spiral\" # in\npitch_m = 0.6\n");
}
