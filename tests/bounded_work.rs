//! For every valid dragon, each question of the planner and each frame of the monitor stays within bounds of work and memory.
//! Work is counted in steps and memory in bytes, so the load of the machine does not matter.
//!
//! `tests/stress` runs the program itself with many more dragons, and measures seconds and memory.

use std::fs;
use std::hint::black_box;

use allocation_counter::measure;
use bench_dragon::config::Config;
use bench_dragon::safety::alerts::ALERT_BURST;
use bench_dragon::safety::monitor::Monitor;
use bench_dragon_geometry::clearance::{first_contact, first_within};
use bench_dragon_geometry::dragon::{ChainSolver, Dragon, Meter};
use bench_dragon_geometry::planner::{
    Parameter, PlannedTurn, QuickestRun, RunLimits, Sensitivity, Setting, Staging, clearance_profile,
    largest_speed_ratio, least_clearance, near_misses, on_one_core, passage_through, shortest_turn,
    shortest_turn_with_line, smallest_pitch, smallest_pitch_on, walk_through,
};
use bench_dragon_ipc::{FrameHeader, HandleState};
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};
use test_support::property::random_cases;

/// Greatest number of steps of an answer.
const MOST_STEPS: u64 = 2_000_000;
/// Parts that are not interrupted take at most this many steps per handle, for example to refine a near miss, and at most
/// [`STEPS_BESIDES`] in total, for example for lists of near pairs.
const STEPS_PER_HANDLE: u64 = 1_000;
const STEPS_BESIDES: u64 = 40_000_000;
/// Greatest memory of an answer at any time, in bytes. Lists of near pairs alone may take 150 MB.
const MOST_BYTES: u64 = 400 << 20;
/// Times between successive frames, in show seconds. The long ones are as after lost frames.
const FRAME_GAPS_S: [f64; 3] = [0.001, 1.0, 1000.0];

/// Configurations near the bounds of work, and at the limits of the valid ranges.
const EXTREMES: &[&str] = &[
    "",
    "[dragon]\nbenches = 100000\n[route]\nstart_turns = 10000\n",
    "[dragon]\nbenches = 100000\n[route]\npitch_m = 0.31\nstart_turns = 2000\n[monitor]\nnear_m = 10\n",
    "[dragon]\nbenches = 3\n[route]\nstart_turns = 10000\n",
    "[route]\npitch_m = 1000\n",
    "[route]\npitch_m = 1000\nstart_turns = 10000\n[dragon]\nbenches = 100000\n",
    // Boards overlap from the start.
    "[dragon]\nhole_offset_m = 1.0\n",
    "[dragon]\nbenches = 100000\nhole_offset_m = 1.0\n[route]\nstart_turns = 1000\n",
    // The shortest links.
    "[dragon]\nhead_length_m = 0.02\nbody_length_m = 0.02\nwidth_m = 0.01\nhole_offset_m = 0.005\n[route]\npitch_m = 0.011\n",
    "[dragon]\nbenches = 100000\nhead_length_m = 0.02\nbody_length_m = 0.02\nwidth_m = 0.01\nhole_offset_m = 0.005\n\
     [route]\npitch_m = 0.011\nstart_turns = 1000\n[monitor]\nnear_m = 10\n",
    "[dragon]\nhead_length_m = 100\nbody_length_m = 0.2\nwidth_m = 0.2\nhole_offset_m = 0.095\nwidth_m = 1\n[route]\npitch_m = 1.1\n",
    "[route]\nkind = \"turnaround\"\nstart_s = -1e6\nend_s = 1e6\n[head]\nspeed_mps = 10\n",
    "[route]\nkind = \"turnaround\"\npitch_m = 0.31\nturn_diameter_m = 6000\n[dragon]\nbenches = 1000\n",
    // Inclined planes: the paper's spiral and turnaround.
    "[ground]\nrise_x = 0.3\nrise_y = -0.2\n",
    "[route]\nkind = \"turnaround\"\n[ground]\nrise_x = 0.3\nrise_y = -0.2\n",
    // A ring of many laps, and a dragon that stands on five hundred of them.
    "[dragon]\nbenches = 10000\n[route]\nkind = \"path\"\nclosed = true\nlaps = 10000\n[[route.segments]]\nkind = \"arc\"\n\
     radius_m = 5\nturn_deg = 360\n",
    // The longest path, and a spiral with a thousand turns.
    "[route]\nkind = \"path\"\n[[route.segments]]\nkind = \"line\"\nlength_m = 1e5\n[[route.segments]]\n\
     kind = \"spiral\"\nstart_radius_m = 1000\nend_radius_m = 0\nturn_deg = -36000\n",
    "[dragon]\nbenches = 3\n[route]\nkind = \"path\"\n[[route.segments]]\nkind = \"spiral\"\nstart_radius_m = 300\n\
     end_radius_m = 1\nturn_deg = 360000\n",
];

/// A path of random segments, many of them too tight for the dragon.
fn paths() -> impl Strategy<Value = String> {
    let log = |low: f64, high: f64| (low.ln()..high.ln()).prop_map(f64::exp);
    let turn = (1.0..720.0_f64, any::<bool>()).prop_map(|(turn, left)| if left { turn } else { -turn });
    let segment = prop_oneof![
        log(0.001, 1000.0).prop_map(|length_m| format!("kind = \"line\"\nlength_m = {length_m}\n")),
        (log(0.01, 1000.0), turn.clone())
            .prop_map(|(radius_m, turn)| format!("kind = \"arc\"\nradius_m = {radius_m}\nturn_deg = {turn}\n")),
        (log(0.1, 100.0), log(0.1, 100.0), turn).prop_map(|(from_m, to_m, turn)| format!(
            "kind = \"spiral\"\nstart_radius_m = {from_m}\nend_radius_m = {to_m}\nturn_deg = {turn}\n"
        )),
    ];
    (log(3.0, 10_000.0), prop::collection::vec(segment, 1..20)).prop_map(|(benches, segments)| {
        let segments = segments.iter().flat_map(|segment| ["[[route.segments]]\n", segment]).collect::<String>();
        format!("[dragon]\nbenches = {}\n[route]\nkind = \"path\"\n{segments}", benches as u64)
    })
}

/// Configurations of random numbers within the valid ranges. Many of them are refused nevertheless, since the values contradict
/// each other.
fn configs() -> impl Strategy<Value = String> {
    let log = |low: f64, high: f64| (low.ln()..high.ln()).prop_map(f64::exp);
    let dragon = (log(3.0, 100_000.0), log(0.02, 100.0), log(0.02, 100.0), log(0.01, 10.0), 0.0..0.5_f64);
    let route = (log(1.01, 1000.0), log(1.0, 10_000.0), log(1.0, 1000.0), log(0.1, 10.0), any::<bool>());
    let others = (log(0.001, 10.0), 0.0..10.0_f64);
    (dragon, route, others).prop_map(|((benches, head_m, body_m, width_m, hole), route, (speed_mps, near_m))| {
        let (widths, turns, diameter_m, ratio, turns_round) = route;
        let route = if turns_round {
            format!("kind = \"turnaround\"\nturn_diameter_m = {diameter_m}\nradius_ratio = {ratio}\n")
        } else {
            format!("start_turns = {turns}\n")
        };
        format!(
            "[dragon]\nbenches = {}\nhead_length_m = {head_m}\nbody_length_m = {body_m}\nwidth_m = {width_m}\n\
             hole_offset_m = {}\n[route]\npitch_m = {}\n{route}[head]\nspeed_mps = {speed_mps}\n\
             [monitor]\nnear_m = {near_m}\n",
            benches as u64,
            hole * f64::min(head_m, body_m),
            widths * width_m,
        )
    })
}

/// Runs a question on this thread alone, whose memory is counted, and checks the bounds of its work and memory.
fn ask(what: &str, text: &str, handles: usize, question: impl FnOnce(&Meter)) {
    let meter = Meter::of(MOST_STEPS);
    let allocations = measure(|| on_one_core(|| question(&meter)));
    let (steps, bytes) = (meter.done(), allocations.bytes_max);
    let most = MOST_STEPS + STEPS_BESIDES + STEPS_PER_HANDLE * handles as u64;
    assert!(steps <= most, "{what} takes {steps} steps, over {most}:\n{text}");
    assert!(bytes <= MOST_BYTES, "{what} takes {bytes} bytes:\n{text}");
}

/// Checks all questions about a configuration. Returns whether the configuration is valid.
fn is_bounded(text: &str) -> bool {
    let Ok(config) = Config::from_toml(text) else { return false };
    let dragon = config.lead();
    let (start_m, end_m, handles) = (dragon.start_travel_m(), dragon.end_travel_m(), dragon.dimensions().handles());
    let ask = |what: &str, question: &dyn Fn(&Meter)| ask(what, text, handles, question);
    ask("the first contact", &|meter| {
        let _ = black_box(first_contact(&dragon.metered(meter), start_m, end_m));
    });
    ask("the first clearance", &|meter| {
        let _ = black_box(first_within(&dragon.metered(meter), 0.05, start_m, end_m));
    });
    ask("the profile", &|meter| {
        let travels_m: Vec<f64> = (0..1000).map(|i| start_m + (end_m - start_m) * f64::from(i) / 1000.0).collect();
        clearance_profile(&dragon.metered(meter), &travels_m, || ());
    });
    ask("the near misses", &|meter| {
        near_misses(&dragon.metered(meter), start_m, end_m, config.tables().monitor.near_m, |_| ());
    });
    ask("the least clearance", &|meter| {
        let _ = black_box(least_clearance(&dragon.metered(meter), start_m, end_m, |_| ()));
    });
    ask("the speed limit", &|meter| {
        let _ = black_box(largest_speed_ratio(&dragon.metered(meter)));
    });
    if !dragon.route().is_on_ground() {
        let limits = RunLimits { handle_mps: 2.0, head_mps: 2.0, accel_mps2: 0.5 };
        ask("the quickest run", &|meter| {
            let _ = black_box(QuickestRun::of(&dragon.metered(meter), &limits, &[], 0.01));
        });
    }
    ask("the pitch", &|meter| {
        let _ = black_box(smallest_pitch(dragon.dimensions(), 16.0, 9.0, 0.0, meter));
    });
    ask("the smallest pitch on the ground", &|meter| {
        let _ = black_box(smallest_pitch_on(config.route(), dragon.dimensions(), 16.0, 9.0, 0.0, meter));
    });
    // Neighbours of neighbours are nearer than that at every pitch.
    ask("a pitch on the ground that no spiral has", &|meter| {
        let _ = black_box(smallest_pitch_on(config.route(), dragon.dimensions(), 16.0, 9.0, 10.0, meter));
    });
    ask("the smallest pitch with a clearance", &|meter| {
        let _ = black_box(smallest_pitch(dragon.dimensions(), 16.0, 9.0, 0.05, meter));
    });
    let turnaround = config.route().planned_turnaround(config.tables().head.speed_mps);
    if let Some(turnaround) = turnaround.expect("a valid configuration has a route") {
        let turn = || PlannedTurn::on(turnaround, config.route().ground.clone());
        let dimensions = *dragon.dimensions();
        ask("the passage", &|meter| {
            let _ = black_box(passage_through(turn(), dimensions, meter));
        });
        ask("the turn", &|meter| {
            black_box(walk_through(turn(), dimensions, Staging::LIMITLESS, meter, |_| ()));
        });
        let staging = Staging { clearance_m: 0.05, speed_ratio: 2.0 };
        ask("the turn within limits", &|meter| {
            black_box(walk_through(turn(), dimensions, staging, meter, |_| ()));
        });
        ask("the shortest turn within limits", &|meter| {
            let _ = black_box(shortest_turn(turn(), dimensions, staging, meter, |_| ()));
        });
        ask("the shortest turn with a line", &|meter| {
            let _ = black_box(shortest_turn_with_line(turn(), dimensions, staging, None, meter, |_| ()));
        });
        ask("the shortest turn", &|meter| {
            let _ = black_box(shortest_turn(turn(), dimensions, Staging::LIMITLESS, meter, |_| ()));
        });
    }
    let setting = Setting {
        dimensions: *dragon.dimensions(),
        route: config.route().clone(),
        speed_mps: config.tables().head.speed_mps,
        accel_mps2: config.tables().head.accel_mps2,
    };
    let parameters = vec![Parameter::Pitch, Parameter::Width];
    let study = Sensitivity { setting, turn_diameter_m: 9.0, range: 0.05, steps: 1, parameters };
    ask("the sensitivity", &|meter| {
        black_box(study.study(meter, || ()));
    });
    watch(&config, text);
    true
}

/// Checks a monitor of some frames with increasing gaps.
fn watch(config: &Config, text: &str) {
    let dragon = config.lead();
    let mut solver = ChainSolver::new(dragon);
    let mut header =
        FrameHeader { run_id: 1, bench_count: dragon.dimensions().benches() as u32, ..FrameHeader::default() };
    let (mut travel_m, mut monitor) = (dragon.start_travel_m(), Monitor::new(config));
    for gap_s in FRAME_GAPS_S {
        header = next_header(&header, config, travel_m, gap_s);
        let handles = frame(&mut solver, dragon, travel_m);
        let allocations = measure(|| {
            black_box(monitor.observe(&header, &handles, None));
        });
        let alerts = monitor.alerts().len();
        assert!(alerts <= ALERT_BURST as usize, "{alerts} alerts of one frame:\n{text}");
        let bytes = allocations.bytes_max;
        assert!(bytes <= MOST_BYTES, "a frame takes {bytes} bytes:\n{text}");
        travel_m = (travel_m + gap_s * config.tables().head.speed_mps).min(dragon.end_travel_m());
    }
}

fn next_header(last: &FrameHeader, config: &Config, travel_m: f64, gap_s: f64) -> FrameHeader {
    let ticks = (gap_s / config.tick_s()).round().max(1.0);
    FrameHeader {
        tick: last.tick + ticks as u64,
        show_time_ns: last.show_time_ns + (ticks * config.tick_s() * 1e9) as i64,
        scheduled_ns: last.scheduled_ns + (gap_s * 1e9) as u64,
        head_travel_m: travel_m,
        head_speed_mps: config.tables().head.speed_mps,
        time_scale: config.tables().serve.time_scale,
        ..*last
    }
    .of_one_dragon()
}

fn frame(solver: &mut ChainSolver, dragon: &Dragon, travel_m: f64) -> Vec<HandleState> {
    let handles = solver.solve(dragon, travel_m).expect("within the run");
    let state = |at: &bench_dragon_geometry::dragon::Handle| HandleState {
        position_m: [at.position.x, at.position.y, 0.0],
        ..HandleState::default()
    };
    handles.iter().map(state).collect()
}

#[test]
fn extreme_configurations_take_bounded_work_and_memory() {
    let valid = EXTREMES.iter().filter(|text| is_bounded(text)).count();
    assert!(valid + 2 >= EXTREMES.len(), "nearly all are valid: {valid} of {}", EXTREMES.len());
}

#[test]
fn links_that_are_too_short_are_refused_with_the_smallest_allowed_length() {
    let text = "[dragon]\nhead_length_m = 1e-7\nbody_length_m = 1e-7\nwidth_m = 1e-8\nhole_offset_m = 0\n";
    let error = Config::from_toml(text).expect_err("too small").to_string();
    assert_eq!(error, "[dragon] head_length_m is 1e-7, must be from 0.02 to 100");
    let text = "[dragon]\nhole_offset_m = 1.09999995\n";
    let error = Config::from_toml(text).expect_err("hinges on each other").to_string();
    assert!(error.contains("body_length_m 2.2 are ") && error.contains(" m apart, must be at least 0.11"), "{error}");
}

#[test]
fn a_long_link_in_a_tight_turn_takes_bounded_work() {
    let text = "[dragon]\nbenches = 3\nhead_length_m = 0.4434254132248732\nbody_length_m = 45.79440183417507\n\
                width_m = 1\nhole_offset_m = 0\n[route]\npitch_m = 1.01\nkind = \"turnaround\"\n\
                turn_diameter_m = 1\nradius_ratio = 1\n[head]\nspeed_mps = 1\n[monitor]\nnear_m = 0\n";
    assert!(is_bounded(text), "a valid configuration");
}

#[test]
fn any_dragon_takes_bounded_work_and_memory() {
    // The dragons are the same in each run. A larger number of cases adds more.
    let mut runner = TestRunner::new_with_rng(random_cases(24), TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let outcome = runner.run(&prop_oneof![configs(), paths()], |text| {
        prop_assume!(is_bounded(&text));
        Ok(())
    });
    if let Err(error) = outcome {
        // The file allows to repeat the failing case.
        let _ = fs::write(std::env::temp_dir().join("bounded_work.txt"), error.to_string());
        panic!("{error}");
    }
}
