//! How long the planner's questions take on one core. Each answer is held against its published value first.
#![allow(missing_docs, reason = "criterion's macros make public functions")]

use std::hint::black_box;
use std::sync::Arc;

use bench_dragon::dragon::{ChainSolver, Dimensions, Dragon, first_contact};
use bench_dragon::plan::smallest_pitch;
use bench_dragon::route::Spiral;
use criterion::{Criterion, criterion_group, criterion_main};

fn paper_dimensions() -> Dimensions {
    Dimensions::new(223, 3.41, 2.20, 0.30, 0.275).expect("the paper's benches are valid")
}

fn paper_dragon() -> Dragon {
    let spiral = Spiral::new(0.55, 16.0).expect("the paper's spiral is valid");
    Dragon::new(paper_dimensions(), Arc::new(spiral)).expect("the paper's dragon stands on its spiral")
}

/// From the measures to the first contact: the run's end is found too.
fn contact(criterion: &mut Criterion) {
    let first = || {
        let dragon = paper_dragon();
        first_contact(&dragon, 0.0, dragon.end_travel_m()).expect("the paper's dragon touches itself")
    };
    let contact = first();
    assert_eq!(contact.benches, [0, 8]);
    assert!((contact.travel_m - 412.473_838).abs() <= 5.001e-7, "{contact:?}");
    criterion.bench_function("first contact of the paper's dragon", |bencher| bencher.iter(first));
}

fn pitch(criterion: &mut Criterion) {
    let dimensions = paper_dimensions();
    let smallest = || smallest_pitch(black_box(&dimensions), 16.0, 9.0).expect("there is a smallest pitch");
    assert!((smallest().pitch_m - 0.450_337).abs() <= 5.001e-7, "{:?}", smallest());
    criterion.bench_function("smallest pitch to a circle of 9 m", |bencher| bencher.iter(smallest));
}

fn chain(criterion: &mut Criterion) {
    let dragon = paper_dragon();
    let mut solver = ChainSolver::new(&dragon);
    let mut tail = |travel_m| solver.solve(&dragon, travel_m).expect("within the run")[223];
    assert!((tail(300.0).position.y - 9.301_164).abs() <= 5.001e-7);
    criterion.bench_function("chain of 224 handles", |bencher| bencher.iter(|| tail(black_box(300.0))));
}

criterion_group!(planner, contact, pitch, chain);
criterion_main!(planner);
