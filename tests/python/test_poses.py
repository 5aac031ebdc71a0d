"""openpyxl reads the planner's numbers from the workbook of poses, in the layout of the paper.

Run by the Rust test `poses_files::openpyxl_reads_the_workbook_back`, which lets the planner write the workbook
and JSON for the same times.
"""

import json
import os
from pathlib import Path

import openpyxl
import pytest

WORKBOOK = openpyxl.load_workbook(os.environ["POSES_XLSX"])
POSES = json.loads(Path(os.environ["POSES_JSON"]).read_text())["poses"]
NAMES = ["head", *(f"bench {bench}" for bench in range(1, 223)), "tail rear"]
# Half of the last decimal, plus the rounding of the comparison itself.
TOLERANCE = 5.001e-7


def rows(sheet):
    return [[cell.value for cell in row] for row in WORKBOOK[sheet].iter_rows(min_row=2)]


def value(sheet, label, time_s):
    [row] = [row for row in rows(sheet) if row[0] == label]
    return row[1 + time_s]


def assert_shown(sheet, expected):
    """Fails unless each number is exact to half of its last decimal, rounded to six decimals, and shown with six."""
    for row, numbers in zip(WORKBOOK[sheet].iter_rows(min_row=2, min_col=2), expected, strict=True):
        for cell, number in zip(row, numbers, strict=True):
            assert abs(cell.value - number) <= TOLERANCE, cell.coordinate
            assert cell.value == round(cell.value, 6), cell.coordinate
            assert cell.number_format == "0.000000", cell.coordinate


def test_there_is_a_sheet_of_positions_and_one_of_speeds():
    assert WORKBOOK.sheetnames == ["positions", "speeds"]


@pytest.mark.parametrize("sheet", ["positions", "speeds"])
def test_the_header_has_the_times_and_stays_in_view(sheet):
    header = [cell.value for cell in WORKBOOK[sheet][1]]
    assert header == ["handle", *(f"{second} s" for second in range(301))]
    assert WORKBOOK[sheet].freeze_panes == "B2"


def test_every_handle_has_a_row_of_x_and_one_of_y_and_one_of_its_speed():
    assert [row[0] for row in rows("positions")] == [f"{name} {axis} (m)" for name in NAMES for axis in "xy"]
    assert [row[0] for row in rows("speeds")] == [f"{name} (m/s)" for name in NAMES]


def test_every_position_is_the_planners():
    assert len(POSES) == 301
    keys = [(index, key) for index in range(len(NAMES)) for key in ("x_m", "y_m")]
    assert_shown("positions", [[pose["handles"][index][key] for pose in POSES] for index, key in keys])


def test_every_speed_is_the_planners():
    indices = range(len(NAMES))
    assert_shown("speeds", [[pose["handles"][index]["speed_mps"] for pose in POSES] for index in indices])


def test_the_known_values_at_300_seconds_are_exact_to_the_last_decimal():
    known = {
        ("positions", "head x (m)"): 4.420274,
        ("positions", "head y (m)"): 2.320429,
        ("positions", "bench 1 x (m)"): 2.459489,
        ("positions", "bench 1 y (m)"): 4.402476,
        ("positions", "tail rear x (m)"): 1.785033,
        ("positions", "tail rear y (m)"): 9.301164,
        ("speeds", "head (m/s)"): 1.0,
        ("speeds", "bench 1 (m/s)"): 0.999709,
        ("speeds", "tail rear (m/s)"): 0.996478,
    }
    assert {place: value(*place, 300) for place in known} == known
