//! Schedules of formations, compared with searches of whole plans.

mod common;

use std::f64::consts::{FRAC_PI_2, PI};

use bench_dragon_geometry::clearance::first_between;
use bench_dragon_geometry::formation::{Formation, Planned};
use bench_dragon_geometry::planner::{Blocked, Schedule};
use glam::DVec2;
use proptest::prelude::*;
use test_support::property::random_cases;

use common::{formations_of, planned, straight};

fn street(from: [f64; 2], heading_rad: f64, length_m: f64) -> Planned {
    planned(4, &straight(DVec2::from(from), heading_rad, length_m), [0.0, 1.0], None).expect("a line")
}

/// A dragon along the x axis, and one up the line x = 10, which gets there at the same time.
fn crossing() -> Vec<Planned> {
    vec![street([0.0, 0.0], 0.0, 30.0), street([10.0, -10.0], FRAC_PI_2, 30.0)]
}

fn end_s(formation: &Formation) -> f64 {
    formation.dragons().iter().map(|planned| planned.timetable.end_s()).fold(0.0, f64::max)
}

#[test]
fn the_second_of_two_straight_dragons_waits_until_the_first_has_passed() {
    let formation = Formation::new(crossing());
    let schedule = Schedule::new(&formation, 0.0).expect("no limit of work");
    let links_m = formation.dragons()[0].dragon.dimensions().links_m();
    // Gold's tail leaves silver's lane after 10 + 0.225 m and its length; silver's head reaches gold's after 10 − 0.225 m.
    let expected_s = links_m + 2.0 * 0.225;
    let starts_s = schedule.in_order(&[0, 1]).expect("it can wait");
    assert!(
        starts_s[0] == 0.0 && (0.0..2e-3).contains(&(starts_s[1] - expected_s)),
        "{starts_s:?} is not {expected_s}"
    );
    let [passing] = schedule.passings(&starts_s)[..] else { panic!("one crossing") };
    assert_eq!((passing.dragons, passing.first), ([0, 1], Some(0)));
    assert!((passing.passes_s.expect("a time") - (10.225 + links_m)).abs() < 2e-3, "{passing:?}");
    assert!((0.0..2e-3).contains(&passing.slack_s) && passing.nearest.approach.clearance_m.abs() < 2e-3, "{passing:?}");
    // Ten seconds later, it may leave ten seconds earlier, and as late as it likes.
    let [early_s, late_s] = schedule.slack_s(1, &[0.0, starts_s[1] + 10.0]).expect("they do not meet");
    assert!((early_s - 10.0).abs() < 2e-3 && late_s == f64::INFINITY, "{early_s} s, {late_s} s");
    // As configured, both meet, and the delay has to change by that time.
    let [meeting] = schedule.passings(&[0.0, 0.0])[..] else { panic!("one crossing") };
    assert!(meeting.first.is_none() && (meeting.slack_s + expected_s).abs() < 2e-3, "{meeting:?}");
    assert_eq!(schedule.slack_s(1, &[0.0, 0.0]), None);
}

#[test]
fn the_order_decides_which_dragon_waits() {
    // The first dragon ends on the lane of the second one, which has to pass before.
    let formation = Formation::new(vec![street([0.0, 0.0], 0.0, 10.0), street([10.0, -10.0], FRAC_PI_2, 30.0)]);
    let schedule = Schedule::new(&formation, 0.3).expect("no limit of work");
    let links_m = formation.dragons()[0].dragon.dimensions().links_m();
    let latest_s = -(links_m + 2.0 * 0.225 + 0.3);
    let Err(Blocked::InOrder { dragon: 1, by: 0, latest_s: found_s }) = schedule.in_order(&[0, 1]) else {
        panic!("the second dragon cannot follow")
    };
    assert!((found_s - latest_s).abs() < 0.31, "{found_s} s is not {latest_s} s");
    let (order, starts_s) = schedule.best_order().expect("the other order");
    assert_eq!((order, starts_s[1]), (vec![1, 0], 0.0));
    assert!((starts_s[0] + found_s).abs() < 2e-3, "{starts_s:?}");
}

#[test]
fn dragons_that_meet_whenever_they_leave_are_named() {
    let opposite = [street([0.0, 0.0], 0.0, 30.0), street([30.0, 0.0], PI, 30.0)];
    let schedule = Schedule::new(&Formation::new(opposite.to_vec()), 0.0).expect("no limit of work");
    assert_eq!(schedule.best_order(), Err(Blocked::Always([0, 1])));
}

#[test]
fn a_cycle_of_waits_is_found() {
    // Each dragon's head is just before the body of the next one, which stands across its way, around a triangle.
    let corner = |k: u8| DVec2::from_angle(2.0 * PI * f64::from(k) / 3.0) * (2.0 / 3.0_f64.sqrt());
    let dragons = (0..3).map(|k| {
        let along = (corner(k + 1) - corner(k)).normalize();
        street((corner(k + 1) - 0.8 * along).to_array(), along.to_angle(), 30.0)
    });
    let schedule = Schedule::new(&Formation::new(dragons.collect()), 0.0).expect("no limit of work");
    let Err(Blocked::Cycle(mut cycle)) = schedule.best_order() else { panic!("no order exists") };
    cycle.sort_unstable();
    assert_eq!(cycle, [0, 1, 2]);
}

proptest! {
    #![proptest_config(random_cases(24))]

    #[test]
    fn a_schedule_keeps_the_clearance_and_no_dragon_may_leave_earlier(
        formation in formations_of(2..5),
        clearance_m in prop_oneof![Just(0.0), 0.0..0.5_f64],
    ) {
        let schedule = Schedule::new(&formation, clearance_m).expect("no limit of work");
        let order: Vec<usize> = (0..formation.dragons().len()).collect();
        let listed = schedule.in_order(&order);
        let best = schedule.best_order();
        if let Ok(starts_s) = &listed {
            let (_, best_s) = best.clone().expect("the order of the list is one of all");
            prop_assert!(schedule.end_s(&best_s) <= schedule.end_s(starts_s));
        }
        for starts_s in [listed.ok(), best.ok().map(|(_, starts_s)| starts_s)].into_iter().flatten() {
            let plan = formation.leaving_at(&starts_s);
            let meeting = first_between(&plan, clearance_m, 0.0, end_s(&plan)).expect("no limit of work");
            prop_assert_eq!(meeting, None, "with starts {:?}", starts_s);
            let earliest_s = schedule.earliest_s();
            if let Some((nearest, at)) = schedule.nearest(&starts_s).map(|(_, nearest, at)| (nearest, at)) {
                prop_assert!(nearest.approach.clearance_m > clearance_m - 1e-9 && at <= end_s(&plan) + 1e-9, "{nearest:?}");
            }
            for dragon in 0..starts_s.len() {
                prop_assert!(starts_s[dragon] >= earliest_s[dragon]);
                let [early_s, late_s] = schedule.slack_s(dragon, &starts_s).expect("no two dragons meet");
                for shift_s in [-early_s, late_s.min(50.0)].map(|shift_s| 0.999 * shift_s) {
                    let mut shifted_s = starts_s.clone();
                    shifted_s[dragon] += shift_s;
                    let plan = formation.leaving_at(&shifted_s);
                    let meeting = first_between(&plan, clearance_m, 0.0, end_s(&plan)).expect("no limit of work");
                    prop_assert_eq!(meeting, None, "dragon {} shifted by {} s of {:?}", dragon, shift_s, starts_s);
                }
            }
        }
        // In the order of the list, a dragon that waits meets one of those before it if it leaves a little earlier.
        if let Ok(starts_s) = schedule.in_order(&order) {
            for dragon in (1..order.len()).filter(|&dragon| starts_s[dragon] > schedule.earliest_s()[dragon] + 2e-3) {
                let mut earlier_s = starts_s[..=dragon].to_vec();
                earlier_s[dragon] -= 2e-3;
                let plan = Formation::new(formation.dragons()[..=dragon].to_vec()).leaving_at(&earlier_s);
                let meeting = first_between(&plan, clearance_m + 0.002, 0.0, end_s(&plan)).expect("no limit of work");
                prop_assert!(meeting.is_some(), "dragon {dragon} could leave earlier than in {starts_s:?}");
            }
        }
    }
}
