"""Chains on ground that is not flat, by scipy alone, equal the planner's poses.

Run by the Rust tests in `ground.rs`, which let the planner write its poses as JSON.
"""

import json
import math
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

POSES = json.loads(Path(os.environ["POSES_JSON"]).read_text())["poses"]
LINKS = [3.41 - 0.55] + [2.20 - 0.55] * 222


def chain(point, front, benches, step):
    """Places of the handles behind a place on a curve: the nearest point behind each at the distance of its link."""
    places = [front]
    for link in LINKS[:benches]:
        here = point(places[-1])
        far = lambda place: np.linalg.norm(point(place) - here) - link
        behind = places[-1] - 0.5 * step
        while far(behind) < 0:
            behind -= step
        places.append(brentq(far, behind, behind + step, xtol=1e-13, rtol=1e-15))
    return places


def speed_along(point, place, h=1e-5):
    return np.linalg.norm(point(place + h) - point(place - h)) / (2 * h)


def assert_poses(point, start, benches, step, tolerance, breaks=()):
    """`point` is the curve in space, `start` the place of the head at t = 0; the head walks 1 m of its arc per second."""

    def arc(place):
        marks = sorted({start, place, *[at for at in breaks if min(start, place) < at < max(start, place)]})
        parts = [quad(lambda at: speed_along(point, at), a, b, epsabs=1e-11, epsrel=1e-11, limit=400)[0]
                 for a, b in zip(marks, marks[1:])]
        return math.copysign(sum(parts), place - start)

    for pose in POSES:
        time_s, handles = pose["time_s"], pose["handles"]
        front = start if time_s == 0 else brentq(lambda at: arc(at) - time_s, start - 1, start + 2 * time_s + 1, xtol=1e-11)
        places = chain(point, front, benches, step)
        assert len(handles) == benches + 1
        for place, handle in zip(places, handles):
            ours = np.array([handle["x_m"], handle["y_m"], handle["z_m"]])
            assert np.linalg.norm(point(place) - ours) < tolerance, (time_s, handle)


def test_an_inclined_plane():
    heading, turn, radius = math.radians(30), math.radians(270), 6.0
    ahead, left = np.array([math.cos(heading), math.sin(heading)]), np.array([-math.sin(heading), math.cos(heading)])
    corner = np.array([2.0, 0.0]) + 5.0 * ahead

    def point(s):
        if s <= 5.0:
            x, y = np.array([2.0, 0.0]) + s * ahead
        else:
            angle = (s - 5.0) / radius
            x, y = corner + radius * (math.sin(angle) * ahead + (1 - math.cos(angle)) * left)
        return np.array([x, y, 0.3 * x - 0.2 * y + 1.25])

    assert_poses(point, 0.0, 12, 0.1, 1e-8, breaks=[5.0])
    # The speeds follow from the lengths of the links: compare them with differences of poses.
    assert POSES[0]["handles"][3]["speed_mps"] == pytest.approx(1.0, abs=1e-9), "the dragon stands on the straight"
    assert turn > (POSES[-1]["time_s"] - 5.0) / radius / 1.1


def hermite(t):
    return np.array([(1 + 2 * t) * (1 - t) ** 2, t * t * (3 - 2 * t)]), np.array([t * (1 - t) ** 2, -t * t * (1 - t)])


def test_a_map_of_heights():
    lines = Path(os.environ["HILL_ASC"]).read_text().splitlines()
    header = {key: float(value) for key, value in (line.split() for line in lines[:6])}
    heights = np.array([[float(word) for word in line.split()] for line in lines[6:]])[::-1]
    first, cell = np.array([header["xllcenter"], header["yllcenter"]]), header["cellsize"]
    # The tests' poses stay away from the edge of the map, where differences are one-sided.
    along_x = np.zeros_like(heights)
    along_y = np.zeros_like(heights)
    twist = np.zeros_like(heights)
    along_x[:, 1:-1] = (heights[:, 2:] - heights[:, :-2]) / 2
    along_y[1:-1, :] = (heights[2:, :] - heights[:-2, :]) / 2
    twist[1:-1, 1:-1] = (heights[2:, 2:] - heights[2:, :-2] - heights[:-2, 2:] + heights[:-2, :-2]) / 4

    def height(x, y):
        u, v = (x - first[0]) / cell, (y - first[1]) / cell
        i, j = int(u), int(v)
        (hx, sx), (hy, sy) = hermite(u - i), hermite(v - j)
        part = slice(j, j + 2), slice(i, i + 2)
        return (hy @ heights[part] @ hx + hy @ along_x[part] @ sx + sy @ along_y[part] @ hx + sy @ twist[part] @ sx) + 1.1

    def point(angle):
        # The paper's spiral: the place is minus its angle, so that it grows along the walk.
        radius = 0.55 / (2 * math.pi) * -angle
        x, y = radius * math.cos(-angle), radius * math.sin(-angle)
        return np.array([x, y, height(x, y)])

    for pose in POSES:
        head = pose["handles"][0]
        # The planner's head is on the curve; all others follow from its place.
        radius = math.hypot(head["x_m"], head["y_m"])
        front = -radius * 2 * math.pi / 0.55
        assert np.linalg.norm(point(front) - [head["x_m"], head["y_m"], head["z_m"]]) < 1e-8
        places = chain(point, front, 60, 0.02)
        for place, handle in zip(places, pose["handles"]):
            ours = np.array([handle["x_m"], handle["y_m"], handle["z_m"]])
            assert np.linalg.norm(point(place) - ours) < 1e-8, (pose["time_s"], handle)
