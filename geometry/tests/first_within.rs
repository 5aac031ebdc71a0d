//! The first travel at which some pair comes within a clearance, compared with all pairs at every step of a fine walk.

use std::sync::Arc;

use bench_dragon_geometry::clearance::{ClearanceSearch, ContactSearch, PairEvent, first_contact, first_within};
use bench_dragon_geometry::dragon::{Dimensions, Dragon, Meter};
use bench_dragon_geometry::route::{Route, Turnaround};
use proptest::prelude::*;
use test_support::dragons::{boards_at, clearance_at, pairs_within, paper_benches, paper_dragon};
use test_support::property::random_cases;

/// Step of the walks, in metres.
const STEP_M: f64 = 0.005;

fn benches() -> impl Strategy<Value = Dimensions> {
    let sizes = (3_usize..40, 1.0..4.0_f64, 1.0..2.5_f64, 0.1..0.4_f64, 0.0..0.3_f64);
    sizes.prop_filter_map("not valid", |(count, head_m, body_m, width_m, hole_m)| {
        Dimensions::new(count, head_m, body_m, width_m, hole_m).ok()
    })
}

/// Routes short enough to walk in small steps, on which boards come near each other.
fn routes() -> impl Strategy<Value = Arc<Route>> {
    let spirals = (0.15..0.8_f64, 2.0..8.0_f64)
        .prop_filter_map("not valid", |(pitch_m, turns)| Route::spiral(pitch_m, turns).ok().map(Arc::new));
    let turnarounds = (0.6..2.0_f64, 4.0..9.0_f64, 0.5..2.0_f64, 15.0..40.0_f64).prop_filter_map(
        "not valid",
        |(pitch_m, diameter_m, ratio, end_m)| {
            let turnaround = Turnaround::new(pitch_m, diameter_m, ratio).ok()?.between(-5.0, end_m).ok()?;
            Some(Arc::new(turnaround.route()))
        },
    );
    prop_oneof![spirals, turnarounds]
}

fn dragons() -> impl Strategy<Value = Dragon> {
    (benches(), routes()).prop_filter_map("cannot stand", |(dimensions, route)| Dragon::new(dimensions, route).ok())
}

proptest! {
    #![proptest_config(random_cases(64))]

    #[test]
    fn no_pair_of_a_walk_is_within_the_clearance_before(dragon in dragons(), clearance_m in 0.0..0.4_f64) {
        let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
        let found = first_within(&dragon, clearance_m, start_m, end_m).expect("no limit");
        let steps = ((end_m - start_m) / STEP_M) as u32;
        let walked_m = (0..=steps)
            .map(|step| start_m + f64::from(step) * STEP_M)
            .find(|&travel_m| !pairs_within(&dragon, travel_m, clearance_m).is_empty());
        let Some(found) = found else {
            prop_assert_eq!(walked_m, None);
            return Ok(());
        };
        prop_assert!(walked_m.is_none_or(|walked_m| found.travel_m <= walked_m), "{found:?} after {walked_m:?}");
        let met_m = clearance_at(&dragon, found.travel_m, found.benches);
        if found.travel_m == start_m {
            prop_assert!(met_m <= clearance_m);
        } else {
            prop_assert!((met_m - clearance_m).abs() < 1e-10, "{met_m} m at {found:?}, not {clearance_m} m");
            prop_assert!(pairs_within(&dragon, found.travel_m - 2e-11, clearance_m).is_empty(), "{found:?} is late");
        }
    }

    /// A pair comes within a greater clearance no later than within a smaller one.
    #[test]
    fn a_greater_clearance_is_reached_no_later(dragon in dragons(), clearances_m in [0.0..0.4_f64, 0.0..0.4_f64]) {
        let [less_m, more_m] = [clearances_m[0].min(clearances_m[1]), clearances_m[0].max(clearances_m[1])];
        let first = |clearance_m| {
            let found = first_within(&dragon, clearance_m, dragon.start_travel_m(), dragon.end_travel_m());
            found.expect("no limit").map_or(f64::INFINITY, |found| found.travel_m)
        };
        prop_assert!(first(more_m) <= first(less_m) + 1e-10);
    }

    #[test]
    fn sweeps_report_every_pair_that_comes_within_and_leaves(
        dragon in dragons(),
        clearance_m in 0.000_1..0.3_f64,
        begin in 0.0..1.0_f64,
        frames_m in prop::collection::vec(0.001..0.4_f64, 1..40),
    ) {
        let mut search = ContactSearch::within(&dragon, clearance_m);
        let mut travel_m = dragon.start_travel_m() + begin * (dragon.end_travel_m() - dragon.start_travel_m());
        let mut within = pairs_within(&dragon, travel_m, clearance_m);
        for frame_m in frames_m {
            let next_m = (travel_m + frame_m).min(dragon.end_travel_m());
            for event in search.sweep(travel_m, next_m).events {
                let contact = event.contact();
                let changed = match event {
                    PairEvent::Touch(_) => within.insert(contact.benches),
                    PairEvent::Part(_) => within.remove(&contact.benches),
                };
                prop_assert!(changed, "{event:?} changes nothing");
                let met_m = clearance_at(&dragon, contact.travel_m, contact.benches);
                prop_assert!((met_m - clearance_m).abs() < 1e-10, "{met_m} m at {event:?}, not {clearance_m} m");
            }
            prop_assert_eq!(&within, &pairs_within(&dragon, next_m, clearance_m), "at {} m", next_m);
            travel_m = next_m;
        }
    }
}

#[test]
fn the_paper_dragon_comes_within_five_centimetres_before_it_touches() {
    let dragon = paper_dragon();
    let near = first_within(&dragon, 0.05, 0.0, dragon.end_travel_m()).expect("no limit").expect("benches come near");
    assert!((clearance_at(&dragon, near.travel_m, near.benches) - 0.05).abs() < 1e-11, "{near:?}");
    let mut search = ClearanceSearch::default();
    let before = (0..=2_000).map(|step| near.travel_m - 1e-9 - 0.02 * f64::from(step));
    for travel_m in before {
        let nearest = search.nearest(&boards_at(&dragon, travel_m)).expect("pairs");
        assert!(nearest.clearance_m > 0.05, "{nearest:?} at {travel_m} m, before {near:?}");
    }
}

#[test]
fn a_clearance_of_zero_is_the_first_contact_to_the_bit() {
    let dragon = paper_dragon();
    let contact = first_contact(&dragon, 0.0, dragon.end_travel_m()).expect("no limit");
    assert_eq!(first_within(&dragon, 0.0, 0.0, dragon.end_travel_m()).expect("no limit"), contact);
    assert!((contact.expect("benches touch").travel_m - 412.473_838).abs() < 5.001e-7);
}

/// The near miss has a clearance of 0.865 mm. A search for more ends there, a search for less at the contact.
#[test]
fn only_a_clearance_above_the_near_miss_ends_there() {
    let dragon = paper_dragon();
    let first = |clearance_m| {
        first_within(&dragon, clearance_m, 405.0, dragon.end_travel_m()).expect("no limit").expect("benches touch")
    };
    let (under, over) = (first(0.000_86), first(0.000_87));
    assert_eq!((under.benches, over.benches), ([0, 8], [0, 11]));
    assert!((over.travel_m - 409.832).abs() < 0.05 && under.travel_m > 412.0, "{under:?} {over:?}");
}

/// A search for a clearance costs about as much work as one for a contact, so it uses all bounds.
#[test]
fn a_clearance_takes_about_as_much_work_as_a_contact() {
    let steps = |clearance_m| {
        let meter = Meter::of(u64::MAX);
        let dragon = paper_dragon().metered(&meter);
        let _ = first_within(&dragon, clearance_m, 380.0, 412.4).expect("no limit");
        meter.done()
    };
    let (contact, clearance) = (steps(0.0), steps(0.0005));
    assert!(contact > 0 && clearance < 2 * contact, "{clearance} steps, and {contact} for a contact");
}

/// Every pair is within 5 m at the start. No pair of the short dragon comes within 1 mm.
#[test]
fn extreme_clearances_are_found_at_once_or_never() {
    let dragon = paper_dragon();
    let near = first_within(&dragon, 5.0, 0.0, dragon.end_travel_m()).expect("no limit").expect("pairs are near");
    assert_eq!(near.travel_m, 0.0);
    let short = paper_benches(3);
    let spiral = Arc::new(Route::spiral(0.55, 16.0).expect("a valid spiral"));
    let short = Dragon::new(short, spiral).expect("the dragon stands");
    assert_eq!(first_within(&short, 0.001, 0.0, 300.0), Ok(None));
}
