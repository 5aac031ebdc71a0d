//! The quickest run, compared with closed forms, and its cues with a dense walk of the reference solver.

#![allow(clippy::print_stdout, reason = "a test prints its figures")]

use bench_dragon_geometry::dragon::{ChainSolver, Dimensions, Dragon, Meter};
use bench_dragon_geometry::planner::{
    Infeasible, QuickestRun, RunLimits, SpeedCue, largest_speed_ratio, passage_through,
};
use bench_dragon_geometry::route::{PathSegment, PathSpec, RouteSpec, Turnaround};
use proptest::prelude::*;
use test_support::dragons::{dragon_on, paper_benches, paper_turnaround, wide_paths};
use test_support::property::random_cases;

/// A head that follows cues: it ramps to each planned speed from its instant on, and brakes for the end.
struct Head<'a> {
    cues: &'a [SpeedCue],
    accel_mps2: f64,
    end_m: f64,
}

/// Time, travel and speed.
type State = [f64; 3];

impl Head<'_> {
    /// The state after `time_s` with a planned speed.
    fn towards(&self, [from_s, from_m, from_mps]: State, target_mps: f64, time_s: f64) -> State {
        let accel_mps2 = self.accel_mps2 * (target_mps - from_mps).signum();
        let (after_s, ramp_s) = (time_s - from_s, (target_mps - from_mps).abs() / self.accel_mps2);
        let ramped_s = after_s.min(ramp_s);
        let ramped_m = (from_mps + 0.5 * accel_mps2 * ramped_s) * ramped_s;
        let speed_mps = if after_s < ramp_s { from_mps + accel_mps2 * after_s } else { target_mps };
        [time_s, from_m + ramped_m + target_mps * (after_s - ramped_s), speed_mps]
    }

    /// The state at a time, without braking for the end.
    fn unbraked(&self, start_m: f64, time_s: f64) -> State {
        let mut state = [self.cues[0].at_s, start_m, 0.0];
        for (number, cue) in self.cues.iter().enumerate().take_while(|(_, cue)| cue.at_s <= time_s) {
            let until_s = self.cues.get(number + 1).map_or(time_s, |next| next.at_s.min(time_s));
            state = self.towards(state, cue.speed_mps, until_s);
        }
        state
    }

    /// The state at which the head begins to brake.
    fn braking(&self, start_m: f64) -> State {
        let left_m =
            |[_, travel_m, speed_mps]: State| self.end_m - travel_m - speed_mps * speed_mps / (2.0 * self.accel_mps2);
        let [mut low_s, mut long_s] = [self.cues[0].at_s, 1.0];
        while left_m(self.unbraked(start_m, low_s + long_s)) > 0.0 {
            long_s *= 2.0;
        }
        let mut high_s = low_s + long_s;
        for _ in 0..200 {
            let middle_s = 0.5 * (low_s + high_s);
            *if left_m(self.unbraked(start_m, middle_s)) > 0.0 { &mut low_s } else { &mut high_s } = middle_s;
        }
        self.unbraked(start_m, low_s)
    }
}

/// Walks the cues in dense steps. Fails if a handle or the head is too fast, or the run takes another time.
fn check_walk(dragon: &Dragon, limits: &RunLimits, run: &QuickestRun, steps: u32) -> Result<(), TestCaseError> {
    let [start_m, end_m] = [dragon.start_travel_m(), dragon.end_travel_m()];
    let head = Head { cues: &run.cues, accel_mps2: limits.accel_mps2, end_m };
    let braking = head.braking(start_m);
    let [start_s, end_s] = [run.cues[0].at_s, braking[0] + braking[2] / limits.accel_mps2];
    let duration_s = end_s - start_s;
    prop_assert!((duration_s - run.duration_s).abs() < 1e-6, "{duration_s} s, but {run:?}");
    let cues_are_used = run.cues.iter().all(|cue| cue.at_s <= braking[0]);
    prop_assert!(
        cues_are_used && (start_s * run.cues[0].speed_mps - start_m).abs() < 1e-9,
        "braking at {} s: {:?}",
        braking[0],
        run.cues
    );
    let mut solver = ChainSolver::new(dragon);
    for step in 0..=steps {
        let time_s = start_s + duration_s * f64::from(step) / f64::from(steps);
        let [_, travel_m, speed_mps] = if time_s <= braking[0] {
            head.unbraked(start_m, time_s)
        } else {
            let left_s = end_s - time_s;
            [time_s, end_m - 0.5 * limits.accel_mps2 * left_s * left_s, limits.accel_mps2 * left_s]
        };
        let handles = solver.solve(dragon, travel_m.clamp(start_m, end_m)).expect("within the run");
        let ratio = handles.iter().map(|handle| handle.speed_ratio).fold(0.0, f64::max);
        prop_assert!(speed_mps <= limits.head_mps * (1.0 + 1e-9), "the head at {time_s} s: {speed_mps} m/s");
        let fastest_mps = speed_mps * ratio;
        prop_assert!(fastest_mps <= limits.handle_mps * (1.0 + 1e-9), "{fastest_mps} m/s at {time_s} s, {travel_m} m");
        prop_assert!(fastest_mps <= run.largest_mps * (1.0 + 1e-9), "{fastest_mps} m/s over {}", run.largest_mps);
    }
    Ok(())
}

/// Compares the speeds over the travel with the reference solver, and with each other.
fn check_speeds(dragon: &Dragon, limits: &RunLimits, run: &QuickestRun, steps: u32) -> Result<(), TestCaseError> {
    let [start_m, end_m] = [dragon.start_travel_m(), dragon.end_travel_m()];
    let mut solver = ChainSolver::new(dragon);
    for step in 0..=steps {
        let travel_m = (start_m + (end_m - start_m) * f64::from(step) / f64::from(steps)).min(end_m);
        let handles = solver.solve(dragon, travel_m).expect("within the run");
        let ratio = handles.iter().map(|handle| handle.speed_ratio).fold(0.0, f64::max);
        let [cap_mps, optimum_mps, walk_mps] =
            [run.cap_mps(travel_m), run.optimum_mps(travel_m), run.walk_mps(travel_m)];
        prop_assert!(cap_mps * ratio <= limits.handle_mps * (1.0 + 1e-9), "{cap_mps} × {ratio} at {travel_m}");
        let over = |mps: f64, most_mps: f64| mps > most_mps * (1.0 + 1e-9) + 1e-6;
        prop_assert!(!over(optimum_mps, cap_mps.min(limits.head_mps)), "{optimum_mps} over {cap_mps} at {travel_m}");
        prop_assert!(!over(walk_mps, optimum_mps), "{walk_mps} over {optimum_mps} at {travel_m}: {:?}", run.cues);
    }
    prop_assert!(run.largest_mps <= limits.handle_mps * (1.0 + 1e-9), "largest {}", run.largest_mps);
    Ok(())
}

fn run_of(dragon: &Dragon, limits: &RunLimits, within: f64) -> QuickestRun {
    QuickestRun::of(dragon, limits, &[], within).expect("the dragon walks its whole route")
}

fn on_path(segments: Vec<PathSegment>, benches: usize) -> Dragon {
    let dimensions = Dimensions::new(benches, 1.2, 0.9, 0.25, 0.1).expect("small benches");
    let spec = PathSpec { segments, laps: None };
    dragon_on(RouteSpec::from(spec).build(1.0, dimensions.links_m()).expect("a valid path"), dimensions)
}

/// Seconds from rest to rest at a largest speed.
fn trapezoid_s(length_m: f64, speed_mps: f64, accel_mps2: f64) -> f64 {
    let top_mps = speed_mps.min((accel_mps2 * length_m).sqrt());
    length_m / top_mps + top_mps / accel_mps2
}

#[test]
fn the_quickest_run_on_a_line_is_a_trapezoid() {
    for (length_m, handle_mps, head_mps) in [(50.0, 2.0, 1.5), (50.0, 1.2, 1.5), (3.0, 9.0, 9.0)] {
        let dragon = on_path(vec![PathSegment::Line { length_m }], 4);
        let limits = RunLimits { handle_mps, head_mps, accel_mps2: 0.5 };
        let run = run_of(&dragon, &limits, 0.01);
        let exact_s = trapezoid_s(length_m, handle_mps.min(head_mps), 0.5);
        assert!((run.optimum_s - exact_s).abs() < 1e-9 * exact_s && run.least_s <= run.optimum_s, "{run:?}");
        assert!((run.duration_s / exact_s - 1.0).abs() < 1e-5 && run.cues.len() == 1, "{run:?}");
    }
}

#[test]
fn on_an_arc_all_handles_are_as_fast_as_the_head() {
    // The tail is on the line behind the arc at first, where no handle is faster than the head.
    let dragon = on_path(vec![PathSegment::Arc { radius_m: 6.0, turn: 5.0 }], 3);
    let limits = RunLimits { handle_mps: 1.25, head_mps: 3.0, accel_mps2: 0.25 };
    let run = run_of(&dragon, &limits, 0.01);
    let exact_s = trapezoid_s(30.0, 1.25, 0.25);
    assert!(
        (run.optimum_s / exact_s - 1.0).abs() < 1e-4 && run.optimum_s >= exact_s * (1.0 - 1e-12),
        "{run:?} {exact_s}"
    );
    assert!(run.largest_mps <= 1.25 * (1.0 + 1e-9) && run.largest_mps > 1.2499, "{run:?}");
}

#[test]
fn the_papers_dragon_turns_much_quicker_than_at_an_even_speed() {
    let dragon = passage_through(paper_turnaround(2.0), paper_benches(223), &Meter::unlimited()).expect("it passes");
    let limits = RunLimits { handle_mps: 2.0, head_mps: 2.0, accel_mps2: 0.5 };
    let run = run_of(&dragon, &limits, 0.01);
    let even_mps = 2.0 / largest_speed_ratio(&dragon).expect("it passes").ratio;
    let length_m = dragon.end_travel_m() - dragon.start_travel_m();
    let even_s = trapezoid_s(length_m, even_mps, 0.5);
    println!(
        "{} s, optimum {} to {} s, even {even_s} s, {} cues",
        run.duration_s,
        run.least_s,
        run.optimum_s,
        run.cues.len()
    );
    assert!(run.optimum_s / run.least_s - 1.0 < 3e-4, "{} {}", run.optimum_s, run.least_s);
    assert!(run.duration_s < 0.75 * even_s, "{} {even_s}", run.duration_s);
    check_speeds(&dragon, &limits, &run, 20_000).expect("the cap is safe");
    check_walk(&dragon, &limits, &run, 20_000).expect("no handle is too fast");
}

#[test]
fn with_rests_the_quickest_run_is_that_of_each_piece_after_the_other() {
    let limits = RunLimits { handle_mps: 2.0, head_mps: 1.5, accel_mps2: 0.5 };
    let line = on_path(vec![PathSegment::Line { length_m: 50.0 }], 4);
    let run = QuickestRun::of(&line, &limits, &[3.0, 20.0], 0.01).expect("the dragon walks its whole route");
    let exact_s: f64 = [3.0, 17.0, 30.0].into_iter().map(|length_m| trapezoid_s(length_m, 1.5, 0.5)).sum();
    assert!((run.optimum_s - exact_s).abs() < 1e-9 * exact_s, "{run:?} {exact_s}");
    assert_eq!(run.cues.iter().map(|cue| cue.leaves_rest).collect::<Vec<_>>(), [false, true, true]);

    // Each part of a turn as a run of its own.
    let ends_m = [-40.0, -3.0, 5.0, 60.0];
    let part = |from_m: f64, to_m: f64| {
        dragon_on(paper_turnaround(2.0).between(from_m, to_m).expect("two travels").route(), paper_benches(20))
    };
    let whole = part(ends_m[0], ends_m[3]);
    let run = QuickestRun::of(&whole, &limits, &ends_m[1..3], 0.01).expect("no handle jumps");
    let parts: Vec<QuickestRun> =
        ends_m.windows(2).map(|ends_m| run_of(&part(ends_m[0], ends_m[1]), &limits, 0.01)).collect();
    let [optimum_s, least_s] = [|run: &QuickestRun| run.optimum_s, |run: &QuickestRun| run.least_s]
        .map(|time_s: fn(&QuickestRun) -> f64| parts.iter().map(time_s).sum::<f64>());
    println!("{} s, of {} parts {optimum_s} s, without rests less", run.optimum_s, parts.len());
    assert!((run.optimum_s / optimum_s - 1.0).abs() < 1e-4 && (run.least_s / least_s - 1.0).abs() < 1e-4, "{run:?}");
    assert!(run.duration_s <= 1.01 * run.optimum_s && run.least_s <= run.optimum_s, "{run:?}");
    assert!(run_of(&whole, &limits, 0.01).optimum_s < run.least_s, "rests cost time");
    for rest_m in &ends_m[1..3] {
        assert_eq!([run.optimum_mps(*rest_m), run.walk_mps(*rest_m)], [0.0; 2]);
        let leaves = run.cues.iter().find(|cue| cue.leaves_rest && (cue.at_s - run.time_s(*rest_m)).abs() < 1e-9);
        assert!(leaves.is_some(), "{rest_m} m: {:?}", run.cues);
    }
    assert!((run.time_s(ends_m[3]) - run.cues[0].at_s - run.duration_s).abs() < 1e-9, "{run:?}");
    check_speeds(&whole, &limits, &run, 20_000).expect("the cap is safe");
}

#[test]
fn a_run_that_ends_with_a_fault_has_no_quickest_one() {
    let dragon = dragon_on(paper_turnaround(3.0).route(), paper_benches(223));
    let limits = RunLimits { handle_mps: 2.0, head_mps: 2.0, accel_mps2: 0.5 };
    let fault = QuickestRun::of(&dragon, &limits, &[], 0.01).expect_err("handle 1 stops");
    assert!(matches!(fault, Infeasible::Fault { .. }), "{fault}");
    let dragon = dragon_on(paper_turnaround(2.0).route(), paper_benches(223));
    let spent = QuickestRun::of(&dragon.metered(&Meter::of(100_000)), &limits, &[], 0.01).expect_err("too little work");
    assert!(matches!(spent, Infeasible::TooMuchWork(_)), "{spent}");
}

#[test]
fn a_fine_tolerance_on_a_tight_turn_has_its_walk() {
    let ratio = 2.146_461_769_964_030_3 / 0.929_959_111_334_613;
    let turnaround = Turnaround::new(0.876_462_215_131_832_3, 2.0 * 3.073_256_751_367_725, ratio).expect("a turn");
    let turnaround = turnaround.between(-5.0, 5.0).expect("two times");
    let benches = dimensions((7, 1.0, 2.380_466_202_924_300_2, 0.269_485_699_075_808_55)).expect("benches");
    let dragon = passage_through(turnaround, benches, &Meter::unlimited()).expect("it passes");
    let limits = RunLimits {
        handle_mps: 1.961_670_967_917_137_1,
        head_mps: 2.226_215_956_914_654,
        accel_mps2: 0.360_948_926_548_192_6,
    };
    for within in [0.004, 0.01, 0.03, 0.1] {
        let run = QuickestRun::of(&dragon, &limits, &[], within).expect("no handle jumps");
        assert!(
            run.duration_s <= run.optimum_s * (1.0 + within),
            "{within}: {} s, {} s",
            run.duration_s,
            run.optimum_s
        );
    }
}

/// Short dragons on turns and on paths.
fn dragons() -> impl Strategy<Value = Dragon> {
    let benches = (1_usize..25, 1.0..4.0_f64, 1.0..2.5_f64, 0.0..0.4_f64);
    let turns = (0.5..2.0_f64, 3.0..16.0_f64, 0.3..3.0_f64);
    let passages =
        (benches.clone(), turns).prop_filter_map("cannot pass", |(benches, (pitch_m, diameter_m, ratio))| {
            let turnaround = Turnaround::new(pitch_m, diameter_m, ratio).ok()?.between(-5.0, 5.0).ok()?;
            passage_through(turnaround, dimensions(benches)?, &Meter::unlimited()).ok()
        });
    let paths = (benches, wide_paths(1..5_usize)).prop_filter_map("cannot pass", |(benches, spec)| {
        let dimensions = dimensions(benches)?;
        let route = RouteSpec::from(spec).build(1.0, dimensions.links_m()).ok()?;
        let dragon = Dragon::new(dimensions, std::sync::Arc::new(route)).ok()?;
        dragon.tight_spot().is_none().then_some(dragon)
    });
    prop_oneof![passages, paths]
}

fn dimensions((count, head_m, body_m, hole_m): (usize, f64, f64, f64)) -> Option<Dimensions> {
    Dimensions::new(count, head_m, body_m, 0.3, hole_m).ok()
}

proptest! {
    #![proptest_config(random_cases(48))]

    #[test]
    fn no_handle_is_too_fast_with_the_cues_and_the_run_is_nearly_the_quickest(
        dragon in dragons(),
        [handle_mps, head_mps] in [0.5..3.0_f64, 0.5..3.0_f64],
        accel_mps2 in 0.05..2.0_f64,
        within in 0.004..0.1_f64,
    ) {
        // Excludes jumps too short to end the run.
        let Ok(largest) = largest_speed_ratio(&dragon) else { return Ok(()) };
        let limits = RunLimits { handle_mps, head_mps, accel_mps2 };
        let run = QuickestRun::of(&dragon, &limits, &[], within).expect("no handle jumps");
        check_speeds(&dragon, &limits, &run, 3000)?;
        check_walk(&dragon, &limits, &run, 3000)?;
        prop_assert!(run.duration_s >= run.optimum_s, "{run:?}");
        prop_assert!(run.duration_s <= run.optimum_s * (1.0 + within), "{} s, {} s: {:?}", run.duration_s, run.optimum_s, run.cues);
        prop_assert!(run.least_s <= run.optimum_s && run.optimum_s <= run.least_s * 1.002, "{} {}", run.least_s, run.optimum_s);
        let length_m = dragon.end_travel_m() - dragon.start_travel_m();
        let even_s = trapezoid_s(length_m, head_mps.min(handle_mps / largest.ratio), accel_mps2);
        prop_assert!(run.optimum_s <= even_s * (1.0 + 2e-4), "{} {even_s}", run.optimum_s);
// The search knows the largest ratio to 10⁻⁴, and leaves a hundredth of the extra time for rounding.
        let is_tight = even_s * 1.0002 > (1.0 + 0.99 * within) * run.optimum_s;
        prop_assert!(is_tight || run.cues.len() == 1, "{even_s} {:?}", run.cues);
    }
}
