//! Grants of a guard: how far the head may walk, and where it may be repositioned.

use bench_dragon::source::server::motion::{Motion, MotionSettings};
use bench_dragon_ipc::{Refusal, Request, ShowState};

use crate::{after, grant, guarded, plan, start};

/// Returns a guarded head at this travel.
fn guarded_at(travel_m: f64) -> Motion {
    start(MotionSettings { start_s: travel_m, start_travel_m: travel_m, ..guarded() })
}

#[test]
fn a_guarded_head_starts_held_and_walks_exactly_as_far_as_it_was_granted() {
    let mut motion = after(start(guarded()), 10);
    assert_eq!((motion.head().state, motion.head().show_time_ns), (ShowState::Held, 0));
    grant(&mut motion, 0.0, 0.012_345_6).expect("the grant covers the head");
    assert_eq!(after(motion.clone(), 12).head().state, ShowState::Running);
    let head = after(motion.clone(), 20).head();
    assert_eq!((head.state, head.travel_m, head.show_time_ns), (ShowState::Held, 0.012_345_6, 12_345_600));
    let mut motion = after(motion, 50);
    grant(&mut motion, 0.01, 1.0).expect("the grant covers the head");
    assert_eq!(after(motion, 1).head().show_time_ns, 13_345_600, "one step from the place of rest");
}

#[test]
fn without_a_grant_the_head_stays_where_it_is() {
    assert_eq!(guarded_at(12.5).limits().granted_to_m, Some(12.5));
}

#[test]
fn grants_are_joined_and_never_shrink() {
    let mut motion = guarded_at(1.5);
    for (from_m, to_m, limit_m) in [(0.0, 2.0, 2.0), (0.0, 5.0, 5.0), (1.0, 3.0, 5.0)] {
        grant(&mut motion, from_m, to_m).expect("the grant is for this run");
        assert_eq!(motion.limits().granted_to_m, Some(limit_m));
    }
}

#[test]
fn the_permanent_end_is_known_with_its_grant_and_then_stays() {
    let mut motion = guarded_at(1.5);
    for (to_m, is_final, end_m) in [
        (2.0, false, None),
        (4.0, false, None),
        (5.0, true, Some(5.0)),
        (3.0, false, Some(5.0)),
        (5.0, false, Some(5.0)),
        (6.0, false, None),
    ] {
        motion.request(Request::Grant { run_id: 7, from_m: 0.0, to_m, is_final }).expect("the grant is for this run");
        assert_eq!(motion.limits().end_m, end_m);
    }
}

#[test]
fn neither_release_nor_resume_lifts_a_guards_stop() {
    let mut motion = start(guarded());
    assert_eq!(motion.request(Request::Release), Err(Refusal::HeldByGuard));
    assert_eq!(motion.request(Request::Resume), Err(Refusal::HeldByGuard));
    motion.request(Request::Hold).expect("hold is always accepted");
    motion.request(Request::Release).expect("the release is accepted");
    assert_eq!(after(motion, 5).head().state, ShowState::Held);
}

#[test]
fn a_paused_head_at_the_end_of_its_grant_is_held() {
    let mut motion = start(guarded());
    grant(&mut motion, 0.0, 0.01).expect("the grant covers the head");
    let mut motion = after(motion, 20);
    motion.request(Request::Pause).expect("pause is always accepted");
    assert_eq!(after(motion, 5).head().state, ShowState::Held);
}

#[test]
fn a_grant_does_not_lift_a_hold() {
    let mut motion = start(MotionSettings { is_held: true, ..guarded() });
    grant(&mut motion, 0.0, 10.0).expect("the grant covers the head");
    assert_eq!(after(motion.clone(), 5).head().state, ShowState::Held);
    motion.request(Request::Release).expect("the release is accepted");
    assert_eq!(after(motion, 5).head().travel_m, 0.005);
}

#[test]
fn a_guarded_head_is_repositioned_only_where_its_guard_has_proved_it() {
    let mut motion = start(guarded());
    let seek = Request::Seek { show_time_s: 300.0 };
    assert_eq!((motion.request(seek), motion.limits().asked_m), (Err(Refusal::NotProved), Some(300.0)));
    grant(&mut motion, 300.0, 300.5).expect("the grant begins at the target of the seek");
    assert_eq!((motion.head().travel_m, motion.limits().granted_to_m), (0.0, Some(0.0)));
    motion.request(seek).expect("the target is proved");
    assert_eq!((motion.limits().granted_to_m, motion.limits().asked_m), (Some(300.5), None));
    assert_eq!(after(motion, 2000).head().travel_m, 300.5);
}

#[test]
fn the_target_of_a_refused_seek_is_asked_for_until_a_grant_contains_it() {
    let mut motion = start(guarded());
    for elsewhere_m in [150.0, 350.0] {
        assert_eq!(motion.request(Request::Seek { show_time_s: 100.0 }), Err(Refusal::NotProved));
        assert_eq!(motion.limits().asked_m, Some(100.0));
        grant(&mut motion, 200.0, 200.5).expect("the grant is for this run");
        assert_eq!(motion.limits().asked_m, Some(100.0));
        grant(&mut motion, 100.0, 100.5).expect("the grant is for this run");
        assert_eq!(motion.limits().asked_m, None);
        // A later grant elsewhere replaces it.
        grant(&mut motion, elsewhere_m, elsewhere_m + 0.5).expect("the grant is for this run");
    }
}

#[test]
fn grants_for_a_seek_are_joined_where_they_touch_and_otherwise_the_last_one_counts() {
    for (grants, show_time_s, granted_to_m) in [
        ([[100.0, 200.0], [200.0, 300.0]], 150.0, Some(300.0)),
        ([[200.0, 300.0], [100.0, 200.0]], 250.0, Some(300.0)),
        ([[200.0, 300.0], [100.0, 200.0]], 100.0, Some(300.0)),
        ([[100.0, 200.0], [201.0, 300.0]], 150.0, None),
        ([[100.0, 200.0], [201.0, 300.0]], 200.5, None),
        ([[201.0, 300.0], [100.0, 200.0]], 250.0, None),
        ([[201.0, 300.0], [100.0, 200.0]], 150.0, Some(200.0)),
    ] {
        let mut motion = start(guarded());
        for [from_m, to_m] in grants {
            grant(&mut motion, from_m, to_m).expect("the grant is for this run");
        }
        let outcome = motion.request(Request::Seek { show_time_s });
        let limits = outcome.map(|()| motion.limits().granted_to_m);
        assert_eq!(limits, granted_to_m.map(Some).ok_or(Refusal::NotProved), "{grants:?}, to {show_time_s} s");
    }
}

#[test]
fn grants_of_an_unguarded_head_for_another_run_and_outside_the_run_are_refused() {
    let grant = |run_id, from_m, to_m| Request::Grant { run_id, from_m, to_m, is_final: false };
    assert_eq!(start(plan()).request(grant(7, 0.0, 1.0)), Err(Refusal::NotGuarded));
    let mut motion = start(guarded());
    assert_eq!(motion.request(grant(8, 0.0, 1.0)), Err(Refusal::OtherRun));
    for (from_m, to_m) in
        [(2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::NAN), (0.0, f64::INFINITY), (0.0, 401.0), (-1.0, 1.0)]
    {
        let refusal = motion.request(grant(7, from_m, to_m));
        assert!(matches!(refusal, Err(Refusal::OutOfRange { .. })), "{from_m} to {to_m}: {refusal:?}");
    }
    assert_eq!(motion.limits().granted_to_m, Some(0.0));
}
