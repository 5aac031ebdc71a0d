"""toppra, a library for the time-optimal parametrisation of paths, finds the optimum of `solve profile`.

It gets the same largest acceleration, and the largest speed of the head that follows from the planner's poses.

Run by the Rust test `profile::toppra_finds_the_same_optimum`.
"""

import json
import os
import subprocess

import numpy as np
import pytest
import toppra
from toppra.algorithm import TOPPRA
from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraintVarying

TURN = "[dragon]\nbenches = 24\n[route]\nkind = \"turnaround\"\nstart_s = -10\nend_s = 60\n"
PATH = """[dragon]
benches = 9
[route]
kind = "path"
segments = [
  { kind = "line", length_m = 12 },
  { kind = "arc", radius_m = 3.5, turn_deg = 200 },
  { kind = "spiral", start_radius_m = 3.5, end_radius_m = 6, turn_deg = -160 },
  { kind = "line", length_m = 15 },
]
"""
STEP_M = 0.01


def solve(config, *args):
    command = [os.environ["BENCH_DRAGON"], "solve", *args, "--config", str(config), "--format", "json"]
    return json.loads(subprocess.run(command, capture_output=True, check=True).stdout)


def shortest_duration(travels_m, caps_mps, accel_mps2):
    """Seconds from rest to rest by toppra, for a head whose largest speed is known at these travels."""
    walked_m = travels_m - travels_m[0]
    knots = np.linspace(0, walked_m[-1], 5)
    line = toppra.SplineInterpolator(knots, knots[:, None])
    speed = JointVelocityConstraintVarying(lambda at: np.array([[-1, 1]]) * np.interp(at, walked_m, caps_mps))
    acceleration = JointAccelerationConstraint(np.array([[-accel_mps2, accel_mps2]]))
    grid = np.linspace(0, walked_m[-1], 20_001)
    found = TOPPRA([speed, acceleration], line, gridpoints=grid, solver_wrapper="seidel")
    found.compute_parameterization(0, 0)
    speeds_mps = found.problem_data.sd_vec
    return np.sum(2 * np.diff(grid) / (speeds_mps[1:] + speeds_mps[:-1]))


@pytest.mark.parametrize("config", [TURN, PATH], ids=["turnaround", "path"])
@pytest.mark.parametrize("limit, speed, accel", [(2.0, 2.0, 0.5), (1.3, 1.2, 0.15)])
def test_durations_are_equal_to_a_thousandth(tmp_path, config, limit, speed, accel):
    file = tmp_path / "asked.toml"
    file.write_text(config)
    # At the configured 1 m/s, times are travels.
    end_m = solve(file, "route")["run_end_m"]
    start_m = -10.0 if config is TURN else 0.0
    to = f"{np.floor(end_m / STEP_M) * STEP_M:.2f}"
    poses = solve(file, "poses", "--from", str(start_m), "--to", to, "--step", str(STEP_M))["poses"]
    travels_m = np.array([pose["time_s"] for pose in poses])
    ratios = np.array([max(handle["speed_mps"] for handle in pose["handles"]) for pose in poses])
    if end_m > travels_m[-1]:
        travels_m, ratios = np.append(travels_m, end_m), np.append(ratios, ratios[-1])
    by_toppra = shortest_duration(travels_m, np.minimum(speed, limit / ratios), accel)
    asked = ["--limit", str(limit), "--speed", str(speed), "--accel", str(accel)]
    found = solve(file, "profile", *asked)
    assert found["optimum_s"] == pytest.approx(by_toppra, rel=1e-3)
    # The optimum is a time that is reached; toppra's is between the samples of the limit.
    assert found["least_s"] <= found["optimum_s"] <= found["duration_s"] <= 1.01 * found["optimum_s"]
    even = asked[:2] + ["--speed", str(found["constant_speed_mps"]), "--accel", str(accel)]
    assert solve(file, "profile", *even)["optimum_s"] == pytest.approx(found["constant_s"], rel=1e-4)
