"""The paper's method as a plain script: `dragon.py poses` and `dragon.py contact FROM_S`. It prints its answer as JSON.

The head's angle at a time is a root of the arc-length equation. Each following angle is a root of the chord-length
equation, at most half a turn behind. Speeds follow from rigid links: both ends have the same speed along the link.
Boards are rectangles; a separating-axis test detects an overlap of two boards. At every step the script tests all pairs,
except neighbours and boards that are too far apart to touch. The answer's `seconds` count the work alone, without the
interpreter's start, imports and printing.
"""

import json
import sys
import time
from math import asinh, cos, pi, sqrt

import numpy as np
from scipy.optimize import brentq

BENCHES = 223
LINKS_M = np.array([3.41 - 2 * 0.275] + [2.20 - 2 * 0.275] * (BENCHES - 1))
HALF_LENGTHS_M = np.array([3.41 / 2] + [2.20 / 2] * (BENCHES - 1))
HALF_WIDTH_M = 0.30 / 2
REACHES_M = np.hypot(HALF_LENGTHS_M, HALF_WIDTH_M)
GROWTH_M = 0.55 / (2 * pi)  # growth of the radius per radian
START_ANGLE = 32 * pi
SPEED_MPS = 1.0
FIRST, SECOND = np.triu_indices(BENCHES, k=2)


def arc_length_m(angle):
    """Arc length from the spiral's centre."""
    return GROWTH_M / 2 * (angle * sqrt(1 + angle * angle) + asinh(angle))


def head_angle(time_s):
    remaining_m = arc_length_m(START_ANGLE) - SPEED_MPS * time_s
    return brentq(lambda angle: arc_length_m(angle) - remaining_m, 0, START_ANGLE)


def angle_behind(front, link_m):
    front_m = GROWTH_M * front

    def excess(rear):
        rear_m = GROWTH_M * rear
        return front_m**2 + rear_m**2 - 2 * front_m * rear_m * cos(rear - front) - link_m**2

    return brentq(excess, front, front + pi)


def chain(time_s):
    """The angles of all handles."""
    angles = [head_angle(time_s)]
    for link_m in LINKS_M.tolist():
        angles.append(angle_behind(angles[-1], link_m))
    return np.array(angles)


def positions_m(angles):
    return GROWTH_M * angles[:, None] * np.column_stack((np.cos(angles), np.sin(angles)))


def links(points):
    """The unit vectors from each handle to the handle in front of it."""
    ahead = points[:-1] - points[1:]
    return ahead / np.linalg.norm(ahead, axis=1)[:, None]


def speeds_mps(angles, points):
    sines, cosines = np.sin(angles), np.cos(angles)
    tangents = np.column_stack((angles * sines - cosines, -sines - angles * cosines))
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    ahead = links(points)
    front = np.sum(tangents[:-1] * ahead, axis=1)
    rear = np.sum(tangents[1:] * ahead, axis=1)
    return SPEED_MPS * np.concatenate(([1.0], np.cumprod(front / rear)))


def touching_benches(time_s):
    """The first pair of boards that overlap; None if there is no such pair."""
    points = positions_m(chain(time_s))
    along = links(points)
    across = np.column_stack((-along[:, 1], along[:, 0]))
    centres = (points[:-1] + points[1:]) / 2
    distances_m = np.linalg.norm(centres[SECOND] - centres[FIRST], axis=1)
    near = distances_m <= REACHES_M[FIRST] + REACHES_M[SECOND]
    first, second = FIRST[near], SECOND[near]
    apart = np.zeros(len(first), dtype=bool)
    for one, other in ((first, second), (second, first)):
        offset = centres[other] - centres[one]
        # The angle between two boards is the same for both axes.
        cosine = np.abs(np.sum(along[one] * along[other], axis=1))
        sine = np.abs(np.sum(along[one] * across[other], axis=1))
        length = HALF_LENGTHS_M[one] + HALF_LENGTHS_M[other] * cosine + HALF_WIDTH_M * sine
        width = HALF_WIDTH_M + HALF_LENGTHS_M[other] * sine + HALF_WIDTH_M * cosine
        apart |= np.abs(np.sum(offset * along[one], axis=1)) > length
        apart |= np.abs(np.sum(offset * across[one], axis=1)) > width
    touching = np.flatnonzero(~apart)
    return [int(first[touching[0]]), int(second[touching[0]])] if len(touching) else None


def poses():
    """Positions and speeds of all handles from 0 to 300 s, one row per second."""
    x_m, y_m, speed_mps = [], [], []
    for second in range(301):
        angles = chain(second)
        points = positions_m(angles)
        x_m.append(points[:, 0])
        y_m.append(points[:, 1])
        speed_mps.append(speeds_mps(angles, points))
    return {"x_m": x_m, "y_m": y_m, "speed_mps": speed_mps}


def contact(from_s):
    """The first step at which boards overlap, in steps of 0.1 s, then of 0.01 s from the last step without an overlap on."""
    tenth = round(10 * float(from_s))
    while touching_benches(tenth / 10) is None:
        tenth += 1
        if tenth % 500 == 0:
            print(f"  no overlap up to {tenth // 10} s", file=sys.stderr)
    hundredth = 10 * (tenth - 1)
    while True:
        benches = touching_benches(hundredth / 100)
        if benches is not None:
            return {"time_s": hundredth / 100, "benches": benches}
        hundredth += 1


def main():
    question, *arguments = sys.argv[1:]
    begun = time.perf_counter()
    answer = {"poses": poses, "contact": contact}[question](*arguments)
    answer["seconds"] = time.perf_counter() - begun
    json.dump(answer, sys.stdout, default=np.ndarray.tolist)


main()
