//! Two simulations of the same show are equal to the last bit.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use bench_dragon::source::server::Simulation;
use bench_dragon::source::server::motion::{MotionPlan, MotionSettings};
use bench_dragon_geometry::dragon::Dragon;
use bench_dragon_ipc::{HandleState, Request};
use test_support::dragons::{paper_dragon, plain_formation, turning_dragon};

/// Plays a show with some commands, and returns the hash of all frames.
fn play(dragon: Dragon) -> u64 {
    let (first_s, last_s) = (dragon.start_travel_m(), dragon.end_travel_m());
    let plan = MotionPlan::new(MotionSettings::plain(1e-3, first_s, last_s)).expect("a tick and two travels in order");
    let mut handles = vec![HandleState::default(); dragon.dimensions().handles()];
    let mut simulation = Simulation::new(plain_formation(dragon), plan, 1000, 1.0);
    let mut hasher = DefaultHasher::new();
    let commands = [
        (2_000, Request::Pause),
        (2_100, Request::Resume),
        (5_000, Request::Speed { speed_mps: 2.5 }),
        (9_000, Request::Seek { show_time_s: 0.5 * (first_s + last_s) }),
        (12_000, Request::Hold),
        (12_050, Request::Release),
        (20_000, Request::Speed { speed_mps: 0.0 }),
        (20_010, Request::Speed { speed_mps: 10.0 }),
    ];
    for tick in 0..40_000 {
        for (_, command) in commands.iter().filter(|(at, _)| *at == tick) {
            simulation.request(*command).expect("the command is allowed");
        }
        simulation.tick(0, &mut ());
        simulation.write(&mut handles);
        for value in handles.iter().flat_map(|handle| handle.position_m.into_iter().chain(handle.velocity_mps)) {
            value.to_bits().hash(&mut hasher);
        }
    }
    hasher.finish()
}

#[test]
fn the_same_show_is_the_same_to_the_last_bit() {
    assert_eq!(play(paper_dragon()), play(paper_dragon()));
    assert_eq!(play(turning_dragon()), play(turning_dragon()));
}
