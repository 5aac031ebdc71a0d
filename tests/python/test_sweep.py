"""The area that boards sweep: shapely unites the boards of many poses, ezdxf and json read the files.

Run by the Rust test `sweep::stock_readers_find_the_area_that_boards_sweep`, which passes the folder of the files in the environment.
"""

import json
import math
import os
from pathlib import Path

import ezdxf
import pytest
from shapely.geometry import LineString, Polygon, shape
from shapely.ops import unary_union

FOLDER = Path(os.environ["SWEEP"])
ANSWER = json.loads((FOLDER / "sweep.json").read_text())
FEATURES = json.loads((FOLDER / "floor.geojson").read_text())["features"]
POSES = json.loads((FOLDER / "poses.json").read_text())["poses"]
AREA = shape(FEATURES[0]["geometry"])
# The paper's benches.
HOLE_OFFSET, WIDTH = 0.275, 0.30
CROWD = [[-2, -6], [15, -3], [14, 9]]
TOLERANCE = 0.02
# Twice what a board moves in half of the time between two poses.
BETWEEN_POSES = 0.03


def board(front, rear):
    """The rectangle of a bench between its hinges."""
    (x, y), (to_x, to_y) = [(handle["x_m"], handle["y_m"]) for handle in (front, rear)]
    link = math.hypot(to_x - x, to_y - y)
    along = ((x - to_x) / link, (y - to_y) / link)
    over = (HOLE_OFFSET * along[0], HOLE_OFFSET * along[1])
    across = (-0.5 * WIDTH * along[1], 0.5 * WIDTH * along[0])
    front, rear = (x + over[0], y + over[1]), (to_x - over[0], to_y - over[1])
    return Polygon(
        [
            (front[0] + across[0], front[1] + across[1]),
            (rear[0] + across[0], rear[1] + across[1]),
            (rear[0] - across[0], rear[1] - across[1]),
            (front[0] - across[0], front[1] - across[1]),
        ]
    )


BOARDS = [board(*ends) for pose in POSES for ends in zip(pose["handles"], pose["handles"][1:])]
UNION = unary_union(BOARDS)


def test_the_area_is_a_valid_shape_of_the_stated_size():
    assert AREA.is_valid and AREA.geom_type == "MultiPolygon"
    assert AREA.area == pytest.approx(ANSWER["area_m2"], abs=1e-6)
    assert AREA.bounds == pytest.approx(ANSWER["box_m"], abs=1e-9)


def test_no_board_is_outside_the_area():
    assert UNION.difference(AREA.buffer(1e-7)).area == 0


def test_the_area_is_larger_by_at_most_the_tolerance():
    assert AREA.difference(UNION.buffer(TOLERANCE + BETWEEN_POSES)).area == 0
    assert UNION.area < AREA.area < UNION.area + (TOLERANCE + BETWEEN_POSES) * UNION.length


def test_the_least_distance_from_the_crowd_is_that_of_the_poses():
    crowd = LineString(CROWD)
    nearest = min(board.distance(crowd) for board in BOARDS)
    assert ANSWER["crowd_m"] <= nearest + 1e-6
    assert ANSWER["crowd_m"] == pytest.approx(nearest, abs=1e-3)
    assert [feature["properties"]["kind"] for feature in FEATURES] == ["swept", "crowd"]
    assert shape(FEATURES[1]["geometry"]).equals(crowd)


def test_the_drawing_has_the_same_borders_on_its_layers():
    drawing = ezdxf.readfile(FOLDER / "floor.dxf")
    lines = list(drawing.modelspace().query("POLYLINE"))
    assert {line.dxf.layer for line in lines} == {"SWEPT", "CROWD"}
    rings = [Polygon([(at.x, at.y) for at in line.points()]) for line in lines if line.dxf.layer == "SWEPT"]
    assert all(line.is_closed for line in lines if line.dxf.layer == "SWEPT")
    outer, holes = [[ring for ring in rings if ring.exterior.is_ccw is side] for side in (True, False)]
    area = unary_union(outer).difference(unary_union(holes))
    assert area.symmetric_difference(AREA).area < 1e-9
    [crowd] = [line for line in lines if line.dxf.layer == "CROWD"]
    assert [(at.x, at.y) for at in crowd.points()] == [tuple(at) for at in CROWD] and not crowd.is_closed
