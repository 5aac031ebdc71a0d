//! The delays at which two dragons meet, compared with a closed form and with searches of single plans.

mod common;

use std::f64::consts::FRAC_PI_2;

use bench_dragon_geometry::clearance::{DragonPair, first_between};
use bench_dragon_geometry::dragon::Meter;
use bench_dragon_geometry::formation::{DelaySet, Formation, Planned};
use glam::DVec2;
use proptest::prelude::*;
use test_support::property::random_cases;

use common::{formations_of, least_clearance_m, planned, straight};

/// How much further than the clearance boards may be at a delay of a zone, in metres.
const NEAR_M: f64 = 0.002;

fn delays_of(pair: &DragonPair) -> DelaySet {
    let mut delays = DelaySet::default();
    for zone in pair.zones().expect("no limit of work") {
        delays.extend(&zone.delays);
    }
    delays
}

/// A dragon along the x axis at 1 m/s, and one up the line x = 20 from 30 m below at 1.5 m/s.
fn crossing(accel_mps2: Option<f64>) -> [Planned; 2] {
    let gold = planned(12, &straight(DVec2::ZERO, 0.0, 60.0), [0.0, 1.0], None).expect("a line");
    let up = straight(DVec2::new(20.0, -30.0), FRAC_PI_2, 60.0);
    [gold, planned(9, &up, [0.0, 1.5], accel_mps2).expect("a line")]
}

#[test]
fn two_straight_dragons_meet_at_the_delays_of_the_closed_form() {
    for (accel_mps2, clearance_m) in [(None, 0.0), (None, 0.4), (Some(0.5), 0.0), (Some(0.2), 0.25)] {
        let [gold, silver] = crossing(accel_mps2);
        let links_m = [&gold, &silver].map(|planned| planned.dragon.dimensions().links_m());
        let silver_time = |walked_m: f64| walked_m / 1.5 + accel_mps2.map_or(0.0, |a| 1.5 / (2.0 * a));
        // Boards are 0.25 m wide and reach 0.1 m over their hinges. Two edges are apart by the clearance at most if they are
        // within it along both axes, or at corners: there the first one to leave is nearer by less than the clearance.
        let reach_m = 0.125 + 0.1 + clearance_m;
        let gold_s = [20.0 - reach_m, 20.0 + reach_m + links_m[0]];
        let silver_s = [30.0 - reach_m, 30.0 + reach_m + links_m[1]].map(silver_time);
        let expected_s = [gold_s[0] - silver_s[1], gold_s[1] - silver_s[0]];
        let pair = DragonPair::new([&gold, &silver], clearance_m);
        let zones = pair.zones().expect("no limit of work");
        let [zone] = &zones[..] else { panic!("one zone: {zones:?}") };
        let [[low_s, high_s]] = *zone.delays.intervals() else { panic!("one interval: {:?}", zone.delays) };
        // With a clearance, boards pass each other at their corners.
        let corner_s = 2.0 * clearance_m;
        for (found_s, outer_s, sign) in [(low_s, expected_s[0], 1.0), (high_s, expected_s[1], -1.0)] {
            let inside_s = sign * (found_s - outer_s);
            assert!(
                (-1e-3..=corner_s + 1e-9).contains(&inside_s),
                "{found_s} s is not {outer_s} s for {clearance_m} m"
            );
        }
        if clearance_m == 0.0 {
            assert_eq!(zone.tips.map(|tip| tip.map(|tip| tip.benches)), [Some([0, 8]), Some([11, 0])]);
        }
    }
}

#[test]
fn a_dragon_that_ends_in_the_way_of_another_one_meets_it_at_all_later_delays() {
    let gold = planned(4, &straight(DVec2::new(-10.0, 0.0), 0.0, 10.0), [0.0, 1.0], None).expect("a line");
    let up = straight(DVec2::new(0.0, -10.0), FRAC_PI_2, 20.0);
    let silver = planned(4, &up, [0.0, 1.0], None).expect("a line");
    let delays = delays_of(&DragonPair::new([&gold, &silver], 0.0));
    // Gold's front edge reaches silver's lane after 10 − 0.225 m; silver's tail has left gold's lane after 10 + 0.225 m and itself.
    let expected_s = (10.0 - 0.225) - (10.0 + 0.225 + silver.dragon.dimensions().links_m());
    let [[low_s, high_s]] = *delays.intervals() else { panic!("one interval: {delays:?}") };
    assert!((low_s - expected_s).abs() < 1e-3 && high_s == f64::INFINITY, "{delays:?} is not from {expected_s} s");
}

#[test]
fn dragons_that_stand_in_each_other_at_both_ends_meet_at_all_delays() {
    let [gold, _] = crossing(None);
    assert!(delays_of(&DragonPair::new([&gold, &gold], 0.0)).is_all());
}

#[test]
fn dragons_on_one_street_follow_each_other_at_their_length_and_the_clearance() {
    // The second one starts 40 m behind, so that neither stands in the other. They end 40 m apart, too.
    let gold = planned(10, &straight(DVec2::ZERO, 0.0, 100.0), [0.0, 1.0], None).expect("a line");
    let silver = planned(10, &straight(DVec2::new(-40.0, 0.0), 0.0, 100.0), [0.0, 1.0], None).expect("a line");
    let delays = delays_of(&DragonPair::new([&gold, &silver], 0.5));
    // Silver's head is 0.5 m behind gold's tail if it leaves this much before gold.
    let expected_s = -(40.0 - gold.dragon.dimensions().links_m() - 0.2 - 0.5);
    let [[low_s, high_s]] = *delays.intervals() else { panic!("one interval: {delays:?}") };
    assert!(low_s == f64::NEG_INFINITY && (high_s - expected_s).abs() < 2e-3, "{delays:?} is not to {expected_s} s");
}

proptest! {
    #![proptest_config(random_cases(48))]

    #[test]
    fn a_plan_meets_exactly_at_the_delays_of_a_zone(
        formation in formations_of(2..3),
        clearance_m in prop_oneof![Just(0.0), 0.0..0.6_f64],
        shares in prop::collection::vec(-1.1..1.1_f64, 6),
    ) {
        let [first, second] = formation.dragons() else { unreachable!("two dragons") };
        let pair = DragonPair::new([first, second], clearance_m);
        let delays = delays_of(&pair);
        let ends_s = pair.ends_s();
        let near_ends = delays.intervals().iter().flatten().flat_map(|&end_s| [end_s - 1e-6, end_s + 1e-6]);
        let near_ends: Vec<f64> = near_ends.filter(|delay_s| delay_s.is_finite()).take(8).collect();
        let random = shares.iter().map(|share| if *share < 0.0 { share * ends_s[1] } else { share * ends_s[0] });
        for delay_s in random.chain(near_ends) {
            let starts_s = [(-delay_s).max(0.0), delay_s.max(0.0)];
            let plan = formation.leaving_at(&starts_s);
            let end_s = (starts_s[0] + ends_s[0]).max(starts_s[1] + ends_s[1]);
            // Within a zone, boards come as near as the clearance, to what they move within the resolution of delays.
            let is_known = delays.around(delay_s).is_some();
            let limit_m = if is_known { clearance_m + NEAR_M } else { clearance_m };
            let meeting = first_between(&plan, limit_m, 0.0, end_s).expect("no limit of work");
            prop_assert_eq!(meeting.is_some(), is_known, "{} s: {:?}, but the delays are {:?}", delay_s, meeting, delays);
        }
    }

    #[test]
    fn a_search_without_enough_work_has_no_zones(
        formation in formations_of(2..3),
        clearance_m in prop_oneof![Just(0.0), 0.0..0.6_f64],
        share in 0.0..1.0_f64,
        missing in 0..200_u64,
    ) {
        /// The zones found with this work, and the work done.
        fn found(formation: &Formation, clearance_m: f64, most: u64) -> (Option<Vec<DelaySet>>, u64) {
            let meter = Meter::of(most);
            let formation = formation.metered(&meter);
            let [first, second] = formation.dragons() else { unreachable!("two dragons") };
            let zones = DragonPair::new([first, second], clearance_m).zones();
            (zones.map(|zones| zones.into_iter().map(|zone| zone.delays).collect()), most - meter.left())
        }
        let (all, work) = found(&formation, clearance_m, 1 << 40);
        for limit in [(share * work as f64) as u64, work.saturating_sub(missing), work] {
            if limit > 0 {
                let (zones, _) = found(&formation, clearance_m, limit);
                prop_assert_eq!(zones, None, "with {} steps of {}", limit, work);
            }
        }
        prop_assert_eq!(found(&formation, clearance_m, work + 1).0, all);
    }

    #[test]
    fn the_least_clearance_of_a_plan_is_that_of_all_pairs(formation in formations_of(2..3)) {
        let [first, second] = formation.dragons() else { unreachable!("two dragons") };
        let pair = DragonPair::new([first, second], 0.0);
        let (starts_s, ends_s) = ([first, second].map(|planned| planned.timetable.start_s()), pair.ends_s());
        let delay_s = starts_s[1] - starts_s[0];
        let until_s = ends_s[0].max(delay_s + ends_s[1]);
        let from_s = delay_s.min(0.0);
        let least = pair.least_clearance(delay_s, [from_s, until_s]);
        let boards_apart = Formation::new(vec![first.clone(), second.clone()]);
        for step in 0..=400 {
            let time_s = from_s + (until_s - from_s) * f64::from(step) / 400.0;
            let clearance_m = least_clearance_m(&boards_apart, starts_s[0] + time_s, false);
            let bound_m = least.approach.clearance_m - (0.01 * least.approach.clearance_m.abs()).max(0.002);
            prop_assert!(clearance_m >= bound_m, "{clearance_m} m at {time_s} s is below {least:?}");
        }
        let there_m = least_clearance_m(&boards_apart, starts_s[0] + least.times_s[0], false);
        prop_assert!((there_m - least.approach.clearance_m).abs() < 1e-9, "{there_m} m is not {least:?}");
    }
}
