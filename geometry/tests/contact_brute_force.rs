//! First contacts and sweeps, compared with two references: all pairs at every step of a fine walk, and a search without the
//! coil of the route.

use std::collections::BTreeSet;
use std::sync::Arc;

use bench_dragon_geometry::clearance::{ContactSearch, PairEvent, first_contact, first_within};
use bench_dragon_geometry::dragon::{Dimensions, Dragon};
use bench_dragon_geometry::route::{Route, Turnaround};
use proptest::prelude::*;
use test_support::dragons::{boards_at, clearance_at, pairs, paper_dragon};
use test_support::property::{case_count, random_cases};

/// The same dragon on a turnaround, with and without the coil of the route.
fn turning_twins() -> impl Strategy<Value = [Dragon; 2]> {
    let benches = (3_usize..50, 0.8..3.0_f64, 0.8..2.5_f64, 0.1..0.4_f64, 0.0..0.3_f64);
    let turns = (0.5..2.5_f64, 4.0..9.0_f64, 0.5..2.0_f64, 20.0..90.0_f64);
    (benches, turns).prop_filter_map("cannot stand", |((count, head_m, body_m, width_m, hole_m), turn)| {
        let (pitch_m, diameter_m, ratio, end_m) = turn;
        let dimensions = Dimensions::new(count, head_m, body_m, width_m, hole_m).ok()?;
        let turnaround = Turnaround::new(pitch_m, diameter_m, ratio).ok()?.between(-5.0, end_m).ok()?;
        let route = turnaround.route();
        let known = Dragon::new(dimensions, Arc::new(route.clone())).ok()?;
        Some([known, Dragon::new(dimensions, Arc::new(route.without_spiral_bounds())).ok()?])
    })
}

/// The same dragon on a spiral, with and without the coil of the route.
fn twin_dragons() -> impl Strategy<Value = [Dragon; 2]> {
    let benches = (3_usize..80, 0.8..4.0_f64, 0.8..2.5_f64, 0.1..0.4_f64, 0.0..0.3_f64);
    let spirals = (1.02..2.5_f64, 2.0..16.0_f64);
    (benches, spirals).prop_filter_map("cannot stand", |((count, head_m, body_m, width_m, hole_m), (pitch, turns))| {
        let dimensions = Dimensions::new(count, head_m, body_m, width_m, hole_m).ok()?;
        let spiral = Route::spiral(pitch * width_m, turns).ok()?;
        let known = Dragon::new(dimensions, Arc::new(spiral.clone())).ok()?;
        Some([known, Dragon::new(dimensions, Arc::new(spiral.without_spiral_bounds())).ok()?])
    })
}

/// Dragons with boards near each other, on routes short enough to walk in small steps.
fn crowded_dragons() -> impl Strategy<Value = Dragon> {
    let benches = (3_usize..40, 1.0..4.0_f64, 1.0..2.5_f64, 0.1..0.4_f64, 0.0..0.3_f64);
    let spirals = (1.05..2.0_f64, 2.0..8.0_f64);
    (benches, spirals).prop_filter_map("cannot stand", |((count, head_m, body_m, width_m, hole_m), (pitch, turns))| {
        let dimensions = Dimensions::new(count, head_m, body_m, width_m, hole_m).ok()?;
        Dragon::new(dimensions, Arc::new(Route::spiral(pitch * width_m, turns).ok()?)).ok()
    })
}

fn touching_at(dragon: &Dragon, travel_m: f64) -> BTreeSet<[usize; 2]> {
    let boards = boards_at(dragon, travel_m);
    pairs(boards.len()).filter(|&[first, second]| boards[first].overlaps(&boards[second])).collect()
}

/// The first step of a walk through the run at which some pair overlaps.
fn first_overlap(dragon: &Dragon, step_m: f64) -> Option<f64> {
    let steps = (dragon.end_travel_m() / step_m) as u32;
    (0..=steps).map(|step| f64::from(step) * step_m).find(|&travel_m| !touching_at(dragon, travel_m).is_empty())
}

/// Clearances to search for: contact, and some between boards.
fn clearances() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), 0.000_1..0.4_f64]
}

/// Checks that the first contacts within a clearance are the same on both routes, from the start and from a later travel.
fn assert_same_contacts([known, plain]: &[Dragon; 2], clearance_m: f64, begin: f64) -> Result<(), TestCaseError> {
    let (start_m, end_m) = (known.start_travel_m(), known.end_travel_m());
    for from_m in [start_m, start_m + begin * (end_m - start_m)] {
        let first = |dragon| first_within(dragon, clearance_m, from_m, end_m).expect("no limit");
        let [ours, theirs] = [known, plain].map(first);
        prop_assert_eq!(ours.is_some(), theirs.is_some());
        let Some((ours, theirs)) = ours.zip(theirs) else { continue };
        prop_assert!((ours.travel_m - theirs.travel_m).abs() < 1e-9, "{ours:?} but {theirs:?}");
        // On an arc, all pairs with the same number of benches between them are equally near. Rounding decides which is
        // nearest.
        prop_assert!(ours.travel_m == from_m || ours.benches == theirs.benches, "{ours:?} but {theirs:?}");
    }
    Ok(())
}

#[test]
fn heads_that_start_where_they_barely_follow_have_the_same_contacts_with_and_without_the_bounds() {
    // Behind the start of a tight spiral, the head's link has other positions that lead to the same handle 1.
    let mut random = fastrand::Rng::with_seed(7);
    let (cases, mut searched) = (case_count(2000), 0);
    for _ in 0..cases {
        let mut between = |low: f64, high: f64| low + (high - low) * random.f64();
        let lengths = [between(2.0, 4.0), between(0.8, 1.3), between(0.1, 0.3), between(0.0, 0.25)];
        let [pitch, turns] = [between(1.02, 2.0), between(2.0, 4.0)];
        let [head_m, body_m, width_m, hole_m] = lengths;
        let Ok(dimensions) = Dimensions::new(random.usize(3..30), head_m, body_m, width_m, hole_m) else { continue };
        let spiral = Route::spiral(pitch * width_m, turns).expect("a valid spiral");
        let plain = Dragon::new(dimensions, Arc::new(spiral.clone().without_spiral_bounds()));
        let (Ok(known), Ok(plain)) = (Dragon::new(dimensions, Arc::new(spiral)), plain) else { continue };
        assert_same_contacts(&[known, plain], 0.0, 0.5).expect("the same contacts");
        searched += 1;
    }
    assert!(searched > cases / 2, "only {searched} dragons stand");
}

proptest! {
    #![proptest_config(random_cases(48))]

    #[test]
    fn first_contact_is_no_later_than_the_first_overlap_of_a_walk(dragon in crowded_dragons()) {
        let overlap_m = first_overlap(&dragon, 0.005);
        let contact = first_contact(&dragon, 0.0, dragon.end_travel_m()).expect("no limit");
        let Some(contact) = contact else {
            prop_assert_eq!(overlap_m, None);
            return Ok(());
        };
        prop_assert!(overlap_m.is_none_or(|overlap_m| contact.travel_m <= overlap_m), "{contact:?} after {overlap_m:?}");
        let clearance_m = clearance_at(&dragon, contact.travel_m, contact.benches);
        prop_assert!(contact.travel_m == 0.0 || clearance_m.abs() < 1e-10, "clearance {clearance_m} m at {contact:?}");
        prop_assert!(contact.travel_m == 0.0 || touching_at(&dragon, contact.travel_m - 2e-11).is_empty());
    }

    #[test]
    fn the_bounds_of_spirals_hide_and_move_no_contact(
        twins in twin_dragons(),
        clearance_m in clearances(),
        begin in 0.0..1.0_f64,
    ) {
        assert_same_contacts(&twins, clearance_m, begin)?;
    }

    #[test]
    fn the_bounds_of_turnarounds_hide_and_move_no_contact(
        twins in turning_twins(),
        clearance_m in clearances(),
        begin in 0.0..1.0_f64,
    ) {
        assert_same_contacts(&twins, clearance_m, begin)?;
    }

    #[test]
    fn a_search_in_pieces_finds_the_same_as_one_search(
        dragon in crowded_dragons(),
        clearance_m in clearances(),
        piece_m in 0.3..3.0_f64,
    ) {
        let mut search = ContactSearch::within(&dragon, clearance_m);
        let (mut contact, mut from_m) = (None, 0.0);
        while contact.is_none() && from_m < dragon.end_travel_m() {
            contact = search.first(from_m, from_m + piece_m).expect("no limit");
            from_m += piece_m;
        }
        let whole = first_within(&dragon, clearance_m, 0.0, dragon.end_travel_m()).expect("no limit");
        prop_assert_eq!(contact.map(|contact| contact.benches), whole.map(|contact| contact.benches));
        let apart_m = contact.zip(whole).map_or(0.0, |(ours, theirs)| (ours.travel_m - theirs.travel_m).abs());
        prop_assert!(apart_m < 1e-10, "{contact:?} but {whole:?}");
    }

    #[test]
    fn sweeps_report_every_beginning_and_end_of_a_contact(
        dragon in crowded_dragons(),
        begin in 0.0..1.0_f64,
        frames_m in prop::collection::vec(0.001..0.4_f64, 1..60),
    ) {
        let mut search = ContactSearch::new(&dragon);
        let mut travel_m = begin * dragon.end_travel_m();
        let mut touching = touching_at(&dragon, travel_m);
        for frame_m in frames_m {
            let next_m = (travel_m + frame_m).min(dragon.end_travel_m());
            for event in search.sweep(travel_m, next_m).events {
                let contact = event.contact();
                prop_assert!(contact.travel_m >= travel_m && contact.travel_m <= next_m, "{event:?}");
                let changed = match event {
                    PairEvent::Touch(_) => touching.insert(contact.benches),
                    PairEvent::Part(_) => touching.remove(&contact.benches),
                };
                prop_assert!(changed, "{event:?} changes nothing");
                let clearance_m = clearance_at(&dragon, contact.travel_m, contact.benches);
                prop_assert!(clearance_m.abs() < 1e-10, "clearance {clearance_m} m at {event:?}");
            }
            prop_assert_eq!(&touching, &touching_at(&dragon, next_m), "at {} m", next_m);
            travel_m = next_m;
        }
    }
}

/// Body benches touch before the head has reached the start position of the next handle. So the pair does not contain a leading
/// bench.
#[test]
fn body_benches_that_touch_first_are_found() {
    let dimensions = Dimensions::new(60, 2.20, 2.20, 0.30, 0.275).expect("valid benches");
    let spiral = Route::spiral(0.399_860_968_87, 13.9).expect("a valid spiral");
    let dragon = Dragon::new(dimensions, Arc::new(spiral)).expect("the dragon stands");
    let contact = first_contact(&dragon, 0.0, dragon.end_travel_m()).expect("no limit").expect("benches touch");
    assert_eq!(contact.benches, [6, 29]);
    assert!((contact.travel_m - 0.325).abs() < 5e-4, "touch at {} m", contact.travel_m);
    let overlap_m = first_overlap(&dragon, 1e-4).expect("benches overlap");
    assert!(contact.travel_m <= overlap_m && contact.travel_m > overlap_m - 1e-4, "{contact:?} but {overlap_m} m");
}

#[test]
fn contact_at_the_beginning_is_found_there() {
    let dragon = paper_dragon();
    let contact = first_contact(&dragon, 413.0, 420.0).expect("no limit").expect("the head touches");
    assert_eq!((contact.travel_m, contact.benches), (413.0, [0, 8]));
}

#[test]
fn a_search_outside_the_run_or_backwards_finds_no_contact() {
    let dragon = paper_dragon();
    let mut search = ContactSearch::new(&dragon);
    assert_eq!(search.first(500.0, 600.0), Ok(None));
    assert_eq!(search.first(-20.0, -10.0), Ok(None));
    assert!(search.sweep(413.0, 412.0).events.is_empty());
}
