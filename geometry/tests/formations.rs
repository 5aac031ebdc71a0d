//! The first contact of several dragons, compared with closed forms and with a search of all pairs.

mod common;

use std::sync::Arc;

use bench_dragon_geometry::clearance::{Meeting, first_contact, first_meeting};
use bench_dragon_geometry::dragon::Board;
use bench_dragon_geometry::formation::{Formation, Planned, Timetable};
use glam::DVec2;
use proptest::prelude::*;
use test_support::dragons::paper_dragon;
use test_support::property::random_cases;

use common::{boards_at, formations_of, least_clearance_m, planned, straight};

#[test]
fn two_straight_dragons_touch_where_the_closed_form_says() {
    let half_width_m = 0.125;
    let overhang_m = 0.1;
    for (delay_s, accel_mps2) in [(0.0, None), (3.0, None), (7.5, Some(0.5)), (40.0, Some(0.2))] {
        // One walks along the x axis at 1 m/s; the other walks up the line x = 20 from 30 m below at 1.5 m/s.
        let gold = planned(12, &straight(DVec2::ZERO, 0.0, 60.0), [0.0, 1.0], None).expect("a line");
        let up = straight(DVec2::new(20.0, -30.0), std::f64::consts::FRAC_PI_2, 60.0);
        let silver = planned(12, &up, [delay_s, 1.5], accel_mps2).expect("a line");
        let time_at = |walked_m: f64| match accel_mps2 {
            None => delay_s + walked_m / 1.5,
            Some(a) => delay_s + walked_m / 1.5 + 1.5 / (2.0 * a),
        };
        // The boards of gold cover the crossing's square from the time at which the head reaches it, until the tail leaves it.
        let links_m = gold.dragon.dimensions().links_m();
        let gold_s = [20.0 - half_width_m - overhang_m, 20.0 + half_width_m + overhang_m + links_m];
        let silver_s = [30.0 - half_width_m - overhang_m, 30.0 + half_width_m + overhang_m + links_m].map(time_at);
        let expected_s = gold_s[0].max(silver_s[0]);
        let meets = expected_s <= gold_s[1].min(silver_s[1]);
        let formation = Formation::new(vec![gold, silver]);
        let found = first_meeting(&formation, 0.0, 0.0, 60.0).expect("little work");
        assert_eq!(found.is_some(), meets, "{delay_s} s: {found:?}");
        if let Some(found) = found {
            assert!((found.time_s - expected_s).abs() < 1e-9, "{delay_s} s: {} is not {expected_s}", found.time_s);
        }
    }
}

#[test]
fn a_formation_of_one_dragon_touches_where_the_dragon_does() {
    let dragon = Arc::new(paper_dragon());
    let timetable = Timetable::new(1.0, None, 0.0, dragon.end_travel_m());
    let contact = first_contact(&dragon, 0.0, dragon.end_travel_m()).expect("little work").expect("a contact");
    let formation = Formation::new(vec![Planned { dragon, timetable }]);
    let meeting = first_meeting(&formation, 0.0, 0.0, 442.0).expect("little work");
    let expected = Meeting { time_s: contact.travel_m, benches: contact.benches, point: contact.point };
    assert_eq!(meeting, Some(expected));
    assert_eq!(expected.benches, [0, 8]);
}

/// Whether the least clearance stays above 0 between two times, with boards that close at most at `closing_mps`.
fn stays_apart(formation: &Formation, [from_s, to_s]: [f64; 2], closing_mps: f64) -> Result<(), TestCaseError> {
    let middle_s = 0.5 * (from_s + to_s);
    let clearance_m = least_clearance_m(formation, middle_s, true);
    prop_assert!(clearance_m > -1e-9, "overlap of {clearance_m} m at {middle_s} s");
    if clearance_m > 0.5 * (to_s - from_s) * closing_mps || to_s - from_s < 1e-4 {
        return Ok(());
    }
    stays_apart(formation, [from_s, middle_s], closing_mps)?;
    stays_apart(formation, [middle_s, to_s], closing_mps)
}

proptest! {
    #![proptest_config(random_cases(24))]

    #[test]
    fn the_first_meeting_of_random_formations_is_that_of_all_pairs(formation in formations_of(2..5)) {
        let end_s = formation.dragons().iter().map(|planned| planned.timetable.end_s()).fold(0.0, f64::max);
        let found = first_meeting(&formation, 0.0, 0.0, end_s).expect("no limit of work");
        let closing_mps = 8.0 * formation.dragons().iter().map(|planned| planned.timetable.speed_mps(1e9).max(2.0)).sum::<f64>();
        let until_s = found.map_or(end_s, |meeting| meeting.time_s);
        if until_s > 0.0 {
            stays_apart(&formation, [0.0, until_s], closing_mps)?;
        }
        if let Some(Meeting { time_s, benches, .. }) = found {
            let boards: Vec<Board> = boards_at(&formation, time_s).concat();
            let clearance_m = boards[benches[0]].clearance(&boards[benches[1]]);
            prop_assert!(if time_s == 0.0 { clearance_m <= 1e-9 } else { clearance_m.abs() <= 1e-9 }, "{clearance_m} m at {time_s} s");
        }
    }
}
