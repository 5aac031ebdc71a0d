//! Measures the planner's questions. Each answer is first compared with its published value.
#![allow(missing_docs, reason = "criterion's macros make public functions")]

mod shared;

use std::hint::black_box;
use std::sync::Arc;

use bench_dragon_geometry::clearance::{
    ContactSearch, DragonPair, ProvenTravel, first_contact, first_possible_touch, first_touching_pose,
};
use bench_dragon_geometry::dragon::{ChainSolver, Dragon, Meter};
use bench_dragon_geometry::formation::{DelaySet, Planned};
use bench_dragon_geometry::planner::{
    Parameter, Sensitivity, Setting, Staging, guaranteed_pitch, largest_speed_ratio, least_clearance, near_misses,
    passage_through, shortest_turn, shortest_turn_with_line, smallest_pitch,
};
use bench_dragon_geometry::route::{Route, SpiralSpec, Turnaround};
use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec2;
use test_support::dragons::{paper_benches, paper_dragon};

/// From the dimensions to the first contact, including the end of the run.
fn contact(criterion: &mut Criterion) {
    let first = || {
        let dragon = paper_dragon();
        first_contact(&dragon, 0.0, dragon.end_travel_m())
            .expect("no limit")
            .expect("the paper's dragon touches itself")
    };
    let contact = first();
    assert_eq!(contact.benches, [0, 8]);
    assert!((contact.travel_m - 412.473_838).abs() <= 5.001e-7, "{contact:?}");
    criterion.bench_function("first contact of the paper's dragon", |bencher| bencher.iter(first));
}

/// From the dimensions to the first contact of 100,000 benches on the paper's spiral, which reaches further out for them.
fn contact_of_many(criterion: &mut Criterion) {
    let first = || {
        let route = Arc::new(Route::spiral(0.55, 400.0).expect("the paper's pitch is valid"));
        let dragon = Dragon::new(paper_benches(100_000), route).expect("the dragon stands on the spiral");
        first_contact(&dragon, 0.0, dragon.end_travel_m())
            .expect("no limit")
            .expect("the paper's dragon touches itself")
    };
    assert_eq!(first().benches, [0, 8]);
    criterion.bench_function("first contact of 100,000 benches", |bencher| bencher.iter(first));
}

/// From the route to the first contact, or to the end of its run, on routes of 1 km.
fn contact_on_a_path(criterion: &mut Criterion) {
    for (name, route) in [("a street and two spirals", shared::mixed()), ("a winding street", shared::winding(670))] {
        assert!((900.0..1100.0).contains(&route.end_travel_m()), "{name} is {} m long", route.end_travel_m());
        let route = Arc::new(route);
        let first = || {
            let dragon = Dragon::new(paper_benches(223), Arc::clone(&route)).expect("the dragon stands");
            (dragon.end_travel_m(), first_contact(&dragon, 0.0, dragon.end_travel_m()).expect("no limit"))
        };
        assert_eq!(
            first().1.is_some(),
            name.ends_with("spirals"),
            "the last straight of the street crosses the spirals"
        );
        criterion.bench_function(&format!("first contact on 1 km of {name}"), |bencher| bencher.iter(first));
    }
}

fn pitch(criterion: &mut Criterion) {
    let dimensions = paper_benches(223);
    let smallest = || {
        smallest_pitch(black_box(&dimensions), 16.0, 9.0, 0.0, &Meter::unlimited()).expect("there is a smallest pitch")
    };
    assert!((smallest().pitch_m - 0.450_337).abs() <= 5.001e-7, "{:?}", smallest());
    criterion.bench_function("smallest pitch to a circle of 9 m", |bencher| bencher.iter(smallest));
}

/// From the dimensions to the largest ratio on the whole passage of all benches.
fn speed_limit(criterion: &mut Criterion) {
    let turnaround = Turnaround::new(1.7, 9.0, 2.0).expect("the paper's turnaround is valid");
    let largest = || {
        let dragon = passage_through(black_box(turnaround), paper_benches(223), &Meter::unlimited())
            .expect("the paper's dragon passes");
        largest_speed_ratio(&dragon).expect("every handle walks")
    };
    assert!((2.0 / largest().ratio - 1.246_266).abs() <= 5.001e-7, "{:?}", largest());
    criterion.bench_function("speed limit of the paper's turnaround", |bencher| bencher.iter(largest));
}

/// The least clearance of all benches on the way to the paper's circle: most of a sensitivity's work, which asks for it 21 times.
fn clearance_to_the_circle(criterion: &mut Criterion) {
    let route = Arc::new(SpiralSpec::default().to_circle(9.0).expect("the spiral starts outside"));
    let dragon = Dragon::new(paper_benches(223), route).expect("the dragon stands");
    let least = || {
        let [from_m, to_m] = black_box([dragon.start_travel_m(), dragon.end_travel_m()]);
        least_clearance(&dragon, from_m, to_m, |_| ()).expect("no limit").expect("three benches")
    };
    assert!((least().pair.clearance_m - 0.099_448).abs() <= 5.001e-7, "{:?}", least());
    criterion.bench_function("least clearance on the way to a circle of 9 m", |bencher| bencher.iter(least));
}

/// The near misses of the paper's dragon up to its first contact, as the planner's page shows them.
fn misses(criterion: &mut Criterion) {
    const NEAR_M: f64 = 0.02;
    let dragon = paper_dragon();
    let all = || near_misses(&dragon, black_box(0.0), 412.473_8, NEAR_M, |_| ()).approaches;
    let known = [402.115_621, 406.846_569, 409.831_991];
    let is_known = all().iter().zip(known).all(|(miss, known_m)| (miss.travel_m - known_m).abs() < 1e-6);
    assert!(is_known && all().len() == known.len(), "{:?}", all());
    criterion.bench_function("near misses of the paper's dragon", |bencher| bencher.iter(all));
}

/// Hinges with poles of 50 mm in holes of 55 mm: the first possible contact, and a pose that touches; for 223 and for 10,000 benches.
fn play(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("play");
    group.sample_size(10);
    for benches in [223, 10_000] {
        let dimensions = paper_benches(benches).with_poles(0.055, 0.050).expect("valid poles");
        let route = Arc::new(Route::spiral(0.55, 16.0).expect("the paper's spiral"));
        let contact = || {
            let dragon = Dragon::new(black_box(dimensions), Arc::clone(&route)).expect("the dragon stands");
            let end_m = dragon.end_travel_m();
            let possible = first_possible_touch(&dragon, 0.0, 0.0, end_m).expect("no limit").expect("boards may touch");
            let pose = first_touching_pose(&dragon, 0.0, possible.travel_m, end_m).expect("no limit");
            (possible, pose.expect("a pose touches"))
        };
        let (possible, pose) = contact();
        assert!((possible.travel_m - 405.878).abs() < 2e-3 && pose.travel_m < 406.2, "{possible:?}, {pose:?}");
        group.bench_function(format!("contact of {benches} benches"), |bencher| bencher.iter(contact));
    }
    let dimensions = paper_benches(223).with_poles(0.055, 0.050).expect("valid poles");
    let meter = Meter::unlimited();
    let nominal = smallest_pitch(&dimensions, 16.0, 9.0, 0.0, &meter).expect("there is a smallest pitch");
    let plan = SpiralSpec::default().into();
    let pitch =
        || guaranteed_pitch(&plan, black_box(&dimensions), 16.0, 9.0, 0.0, &nominal, &meter).expect("a wider pitch");
    assert!((pitch() - 0.459_634).abs() < 2e-5, "{}", pitch());
    group.bench_function("smallest pitch to a circle of 9 m", |bencher| bencher.iter(pitch));
    group.finish();
}

/// The shortest S of two arcs within the default limits.
fn turn(criterion: &mut Criterion) {
    let turnaround = Turnaround::new(1.7, 9.0, 2.0).expect("the paper's turnaround is valid");
    let staging = Staging { clearance_m: 0.05, speed_ratio: 2.0 };
    let shortest = || {
        let found = shortest_turn(black_box(turnaround), paper_benches(223), staging, &Meter::unlimited(), |_| ());
        found.expect("no limit").expect("there is a shortest turn").turnaround.turn_length_m()
    };
    assert!((shortest() - 8.660_191).abs() <= 5.001e-7, "{}", shortest());
    let with_line = || {
        let meter = Meter::unlimited();
        let found = shortest_turn_with_line(black_box(turnaround), paper_benches(223), staging, None, &meter, |_| ());
        found.expect("no limit").expect("there is a shortest turn").turnaround.turn_length_m()
    };
    assert!((with_line() - 8.530_694).abs() <= 5e-6, "{}", with_line());
    let mut group = criterion.benchmark_group("turn");
    group.sample_size(10);
    group.bench_function("shortest turn of two arcs", |bencher| bencher.iter(shortest));
    group.bench_function("shortest turn with a line", |bencher| bencher.iter(with_line));
    group.finish();
}

/// How all answers change with all parameters, in two steps of 2.5 % to either side: 85 answers.
fn sensitivity(criterion: &mut Criterion) {
    let setting = Setting {
        dimensions: paper_benches(223),
        route: SpiralSpec::default().into(),
        speed_mps: 1.0,
        accel_mps2: None,
    };
    let parameters = Parameter::ALL.into_iter().filter(|parameter| setting.has(*parameter)).collect();
    let study = Sensitivity { setting, turn_diameter_m: 9.0, range: 0.05, steps: 2, parameters };
    let values = || study.study(&Meter::unlimited(), || ()).into_iter().map(|response| response.value);
    let known = [412.473_838, 0.099_448, 1.0, 0.450_337];
    let is_known = values().zip(known).all(|(value, known)| value.is_ok_and(|value| (value - known).abs() <= 5.001e-7));
    assert!(is_known, "{:?}", values().collect::<Vec<_>>());
    let mut group = criterion.benchmark_group("sensitivity");
    group.sample_size(10);
    group.bench_function("all answers and parameters", |bencher| bencher.iter(|| values().count()));
    group.finish();
}

/// The delays at which two large dragons come within half a metre of each other: of two whose ways cross, and of two that walk beside
/// each other and never meet.
fn delays(criterion: &mut Criterion) {
    let gold = shared::through_a_square(DVec2::new(-75.922, -12.145), 2.159);
    let crossing = shared::through_a_square(DVec2::new(-54.284, -54.451), 38.159);
    let beside = shared::through_a_square(DVec2::new(75.922, 12.145), 182.159);
    let delays = |other: &Planned| {
        let mut delays = DelaySet::default();
        for zone in DragonPair::new([&gold, other], black_box(0.5)).zones().expect("no limit") {
            delays.extend(&zone.delays);
        }
        delays
    };
    let known = [-263.848, 275.904];
    let found = delays(&crossing);
    let is_known = matches!(found.intervals(), [found] if (0..2).all(|end| (found[end] - known[end]).abs() < 1e-3));
    assert!(is_known, "{found:?}");
    assert_eq!(delays(&beside), DelaySet::default());
    let mut group = criterion.benchmark_group("formation");
    group.sample_size(10);
    group.bench_function("delays at which two dragons of 223 benches meet", |bencher| {
        bencher.iter(|| delays(&crossing));
    });
    group.bench_function("delays of two that walk beside each other", |bencher| bencher.iter(|| delays(&beside)));
    group.finish();
}

/// The work of guard and monitor during a show on a winding street: proofs of 100 and of 1,000 strides, and sweeps over the ways between
/// 1,000 frames. Each way is a millimetre.
fn watch(criterion: &mut Criterion) {
    const BEGIN_M: f64 = 100.0;
    const STRIDE_M: f64 = 0.4125;
    let route = Arc::new(shared::winding(670));
    let dragon = Dragon::new(paper_benches(223), route).expect("the dragon stands");
    for (strides, name) in [(100.0, "proof of 100"), (1000.0, "proof of 1,000")] {
        let end_m = BEGIN_M + strides * STRIDE_M;
        let proof = || {
            let mut proof = ProvenTravel::at(&dragon, black_box(0.1), BEGIN_M).expect("no benches are near");
            proof.extend(end_m, usize::MAX);
            proof.end_m()
        };
        assert_eq!(proof(), end_m);
        criterion.bench_function(&format!("{name} strides on a winding street"), |bencher| bencher.iter(proof));
    }
    let mut search = ContactSearch::new(&dragon);
    let mut sweeps = |from_m: f64| {
        let travel_m = |frame: u32| from_m + 1e-3 * f64::from(frame);
        (0..1000).map(|frame| search.sweep(travel_m(frame), travel_m(frame + 1)).events.len()).sum::<usize>()
    };
    assert_eq!(sweeps(BEGIN_M), 0);
    criterion.bench_function("sweeps of 1,000 frames on a winding street", |bencher| {
        bencher.iter(|| sweeps(black_box(BEGIN_M)));
    });
}

fn chain(criterion: &mut Criterion) {
    let dragon = paper_dragon();
    let mut solver = ChainSolver::new(&dragon);
    let mut tail = |travel_m| solver.solve(&dragon, travel_m).expect("within the run")[223];
    assert!((tail(300.0).position.y - 9.301_164).abs() <= 5.001e-7);
    criterion.bench_function("chain of 224 handles", |bencher| bencher.iter(|| tail(black_box(300.0))));
}

criterion_group!(
    planner,
    contact,
    contact_of_many,
    contact_on_a_path,
    pitch,
    speed_limit,
    clearance_to_the_circle,
    misses,
    play,
    turn,
    sensitivity,
    delays,
    watch,
    chain
);
criterion_main!(planner);
