//! The task `poses`: positions and speeds of all handles from 0 to 300 s, in steps of 1 s.

use bench_dragon_geometry::dragon::ChainSolver;
use serde::Deserialize;
use test_support::dragons::paper_dragon_of;

use crate::process::{solve, timed_output};
use crate::race::Answer;

const LAST_S: usize = 300;
const HANDLES: usize = 224;
/// Largest allowed difference of a position in metres, and of a speed in metres per second: one unit of the sixth decimal, to
/// which tables of such answers are printed.
const LARGEST_DIFFERENCE: f64 = 1e-6;

/// Positions and speeds of all handles, one row per second.
#[derive(Debug, Deserialize, PartialEq)]
pub struct Poses {
    x_m: Vec<Vec<f64>>,
    y_m: Vec<Vec<f64>>,
    speed_mps: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
struct Printed {
    poses: Vec<PrintedPose>,
}

#[derive(Deserialize)]
struct PrintedPose {
    handles: Vec<PrintedHandle>,
}

#[derive(Deserialize)]
struct PrintedHandle {
    x_m: f64,
    y_m: f64,
    speed_mps: f64,
}

impl Answer for Poses {
    const TASK: &'static str = "poses";
    const MEASURES: [&'static str; 2] = ["max_difference_m", "max_difference_mps"];

    fn question(_from_s: &str) -> Vec<&str> {
        vec!["poses"]
    }

    fn solved() -> Self {
        let dragon = paper_dragon_of(HANDLES - 1);
        let mut solver = ChainSolver::new(&dragon);
        let mut poses = Self::with_room();
        for second in 0..=LAST_S {
            let handles = solver.solve(&dragon, second as f64).expect("the travel is within the run");
            poses.x_m.push(handles.iter().map(|handle| handle.position.x).collect());
            poses.y_m.push(handles.iter().map(|handle| handle.position.y).collect());
            // The head walks at 1 m/s.
            poses.speed_mps.push(handles.iter().map(|handle| handle.speed_ratio).collect());
        }
        poses
    }

    fn printed() -> (f64, Self) {
        let (seconds, stdout) =
            timed_output(&mut solve(&["poses", "--from", "0", "--to", &LAST_S.to_string(), "--step", "1"]));
        let printed: Printed = serde_json::from_slice(&stdout).expect("the program prints its answer as JSON");
        let mut poses = Self::with_room();
        for PrintedPose { handles } in printed.poses {
            poses.x_m.push(handles.iter().map(|handle| handle.x_m).collect());
            poses.y_m.push(handles.iter().map(|handle| handle.y_m).collect());
            poses.speed_mps.push(handles.iter().map(|handle| handle.speed_mps).collect());
        }
        (seconds, poses)
    }

    fn assert_known(&self) {
        let positions = [
            (0, 0, 8.800_000, 0.000_000),
            (60, 0, 5.799_209, -5.771_092),
            (120, 0, -4.084_887, -6.304_479),
            (180, 0, -2.963_609, 6.094_780),
            (240, 0, 2.594_494, -5.356_743),
            (300, 0, 4.420_274, 2.320_429),
            (300, 1, 2.459_489, 4.402_476),
            (300, 223, 1.785_033, 9.301_164),
        ];
        for (second, handle, x_m, y_m) in positions {
            let at = (self.x_m[second][handle], self.y_m[second][handle]);
            let known = is(at.0, x_m) && is(at.1, y_m);
            assert!(known, "handle {handle} is at {at:?} at {second} s, not at ({x_m}, {y_m})");
        }
        for (handle, known_mps) in [(0, 1.0), (1, 0.999_709), (223, 0.996_478)] {
            let speed_mps = self.speed_mps[300][handle];
            assert!(is(speed_mps, known_mps), "handle {handle} moves at {speed_mps} m/s, not {known_mps}");
        }
    }

    fn measures(&self, script: &Self) -> [f64; 2] {
        let x_m = largest_difference(&self.x_m, &script.x_m);
        let y_m = largest_difference(&self.y_m, &script.y_m);
        let speed_mps = largest_difference(&self.speed_mps, &script.speed_mps);
        let largest = x_m.max(y_m).max(speed_mps);
        assert!(
            largest <= LARGEST_DIFFERENCE,
            "the script differs by {x_m} m in x, {y_m} m in y and {speed_mps} m/s, must be at most {LARGEST_DIFFERENCE}"
        );
        [x_m.max(y_m), speed_mps]
    }
}

impl Poses {
    fn with_room() -> Self {
        let rows = || Vec::with_capacity(LAST_S + 1);
        Self { x_m: rows(), y_m: rows(), speed_mps: rows() }
    }
}

/// Whether two values are equal to half of the sixth decimal, plus the rounding of the comparison.
fn is(value: f64, known: f64) -> bool {
    (value - known).abs() <= 5.001e-7
}

fn largest_difference(rows: &[Vec<f64>], others: &[Vec<f64>]) -> f64 {
    assert_eq!((rows.len(), others.len()), (LAST_S + 1, LAST_S + 1), "one row per second");
    let mut largest = 0.0_f64;
    for (row, other) in rows.iter().zip(others) {
        assert_eq!((row.len(), other.len()), (HANDLES, HANDLES), "one value per handle");
        largest = row.iter().zip(other).fold(largest, |largest, (value, other)| largest.max((value - other).abs()));
    }
    largest
}
