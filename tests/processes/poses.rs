//! The published poses are the poses that the planner computes.

use bench_dragon::config::Config;
use bench_dragon_geometry::dragon::ChainSolver;
use bench_dragon_ipc::ShowState;
use glam::DVec2;
use serde_json::Value;
use test_support::process::Process;

use crate::periods::{assert_no_frame_missing, period};
use crate::reader::{Reader, Shot, assert_whole};
use crate::stage::{Stage, program};

/// Plays a short show of this many periods, and returns all its frames.
fn play(stage: &Stage, periods: u64, args: &[&str]) -> Vec<Shot> {
    let server = stage.serve(&[&["--readers", "1"], args].concat());
    let shots = Reader::join(stage).read_to_end();
    assert_whole(&shots, server.run_id);
    let summary = server.summary();
    assert_eq!(summary["frames"], shots.len());
    assert_no_frame_missing(&summary, periods);
    shots
}

/// Fails if the two differ by more than rounding.
pub(crate) fn assert_near(live: [f64; 3], solved: DVec2) {
    let off = (live[0] - solved.x).abs().max((live[1] - solved.y).abs());
    assert!(off < 1e-12 && live[2] == 0.0, "{live:?} is not {solved:?}");
}

#[test]
fn every_handle_of_every_frame_equals_the_solution() {
    let stage = Stage::new();
    let shots = play(&stage, 178, &["--start-at", "123.4", "--time-scale", "1000", "--until", "300"]);
    let dragon = Config::from_toml("").expect("the paper's dragon").lead().clone();
    let mut solver = ChainSolver::new(&dragon);
    for Shot { header, handles, .. } in &shots {
        let chain = solver.solve(&dragon, header.head_travel_m).expect("the travel is in the run");
        assert_eq!(handles.len(), chain.len());
        for (live, solved) in handles.iter().zip(chain) {
            let velocity = solved.tangent * (solved.speed_ratio * header.head_speed_mps);
            assert_near(live.position_m, solved.position);
            assert_near(live.velocity_mps, velocity);
        }
    }
}

#[test]
fn the_planner_prints_the_published_numbers() {
    let stage = Stage::new();
    let shots = play(&stage, 28, &["--start-at", "17.3", "--rate", "7", "--time-scale", "100", "--until", "400"]);
    let times: Vec<String> = shots.iter().map(|shot| shot.header.head_travel_m.to_string()).collect();
    let solve = program(&["solve", "poses", "--format", "json", "--at", &times.join(",")]);
    let answer = Process::start(solve).end().expect_clean().last_json();
    let poses = answer["poses"].as_array().expect("an array of poses");
    assert_eq!(poses.len(), shots.len());
    for (Shot { header, handles, .. }, pose) in shots.iter().zip(poses) {
        assert_eq!(pose["time_s"], header.head_travel_m, "at 1 m/s the travel is the time");
        let solved: Vec<[&Value; 2]> = pose["handles"]
            .as_array()
            .expect("an array")
            .iter()
            .map(|handle| [&handle["x_m"], &handle["y_m"]])
            .collect();
        assert_eq!(solved.len(), handles.len());
        for (live, [x, y]) in handles.iter().zip(solved) {
            let [x_m, y_m] = [x, y].map(|value| value.as_f64().expect("a number"));
            assert_near(live.position_m, DVec2::new(x_m, y_m));
        }
    }
}

#[test]
fn show_time_is_counted_in_whole_steps_from_the_start() {
    let stage = Stage::new();
    let shots = play(&stage, 52, &["--rate", "7", "--time-scale", "60", "--until", "432", "--catch-up", "10"]);
    let (last, walked) = shots.split_last().expect("the frames of a show");
    for shot in walked {
        assert_eq!(shot.state(), ShowState::Running);
        let show_time_s = period(&shots[0].header, &shot.header, 7) as f64 * (60.0 / 7.0);
        assert_eq!(shot.header.show_time_ns, (show_time_s * 1e9).round() as i64, "tick {}", shot.header.tick);
        assert_eq!(shot.header.head_travel_m, show_time_s);
    }
    assert_eq!((last.state(), last.header.show_time_ns), (ShowState::Ended, 432_000_000_000));
}

#[test]
fn every_frame_is_due_a_whole_number_of_periods_after_the_first() {
    let stage = Stage::new();
    let shots = play(&stage, 151, &["--rate", "300", "--until", "0.5"]);
    let epoch_ns = shots[0].header.scheduled_ns;
    let mut last_period = None;
    for Shot { header, .. } in &shots {
        let period = ((header.scheduled_ns - epoch_ns) * 300).div_ceil(1_000_000_000);
        assert_eq!(header.scheduled_ns, epoch_ns + period * 1_000_000_000 / 300, "tick {}", header.tick);
        assert!(header.published_ns >= header.scheduled_ns, "no frame is sent before it is due");
        assert!(last_period < Some(period), "periods are skipped and never repeated");
        last_period = Some(period);
    }
}

#[test]
fn the_summarys_overruns_are_the_missed_periods() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "1000", "--until", "0.2", "--readers", "1"]);
    let shots = Reader::join(&stage).read_to_end();
    let (first, last) = (shots[0].header, shots[shots.len() - 1].header);
    let periods = (last.scheduled_ns - first.scheduled_ns) / 1_000_000;
    assert_eq!(server.summary()["overruns"], periods - last.tick);
}
