"""csv and openpyxl read from exported tables the values that the stock MCAP reader reads from the recording, bit for bit.

Run by the Rust test `export::python_finds_the_recording_in_its_tables`, which records two runs and exports them.
"""

import csv
import math
import os
from datetime import datetime
from pathlib import Path

import openpyxl
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

FOLDER = Path(os.environ["EXPORT_FOLDER"])
EVERY_NS = 500_000_000


def messages(topic):
    with open(FOLDER / "a.mcap", "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return [item.decoded_message for item in reader.iter_decoded_messages(topics=[topic], log_time_order=False)]


FRAMES = messages("/dragon/frames")


def sampled():
    """Returns the first frame of each run, and the first frame of each half second of show time."""
    last, chosen = None, []
    for frame in FRAMES:
        step = (frame.run_id, frame.show_time_ns // EVERY_NS)
        if step != last:
            chosen.append(frame)
        last = step
    return chosen


def table(name):
    with open(FOLDER / name, newline="") as stream:
        return list(csv.DictReader(stream))


def when(row):
    return int(row["run_id"]), int(row["tick"]), float(row["time_s"])


def expected_when(frame):
    return frame.run_id, frame.tick, frame.show_time_ns / 1e9


def walls(topic):
    """Returns the wall times at which the messages of a topic were sent or received, in nanoseconds."""
    with open(FOLDER / "a.mcap", "rb") as stream:
        return [message.log_time for _, _, message in make_reader(stream).iter_messages([topic], log_time_order=False)]


def wall_ns(row):
    """Returns the wall time of a row in nanoseconds."""
    text = row["wall_time"]
    assert text.endswith("Z")
    seconds, _, digits = text[:-1].partition(".")
    whole = datetime.fromisoformat(f"{seconds}+00:00").timestamp()
    return int(whole) * 1_000_000_000 + int(digits.ljust(9, "0") or 0)


def numbers(row, names):
    return [float(row[name]) for name in names]


@pytest.mark.parametrize("name, frames", [("all.csv", FRAMES), ("some.csv", sampled())])
def test_every_handle_is_there_with_every_bit(name, frames):
    rows = iter(table(name))
    for frame in frames:
        for index, handle in enumerate(frame.handles):
            row = next(rows)
            assert when(row) == expected_when(frame) and int(row["handle"]) == index
            vector = numbers(row, ["x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps"])
            assert vector == [*handle.position_m, *handle.velocity_mps]
            assert math.isclose(float(row["speed_mps"]), math.hypot(*handle.velocity_mps), rel_tol=1e-15)
    assert next(rows, None) is None


def test_benches_lie_midway_between_their_handles():
    rows = iter(table("benches.csv"))
    for frame in sampled():
        for index, (front, rear) in enumerate(zip(frame.handles, frame.handles[1:])):
            row = next(rows)
            assert when(row) == expected_when(frame) and int(row["bench"]) == index
            centre = [(a + b) / 2 for a, b in zip(front.position_m, rear.position_m)]
            assert numbers(row, ["x_m", "y_m", "z_m"]) == pytest.approx(centre, rel=1e-15)
            across, along = (front.position_m[axis] - rear.position_m[axis] for axis in (0, 1))
            assert float(row["heading_rad"]) == pytest.approx(math.atan2(along, across), rel=1e-14)
    assert next(rows, None) is None


def test_frames_and_alerts_have_a_row_each():
    rows = table("frames.csv")
    assert [when(row) for row in rows] == [expected_when(frame) for frame in sampled()]
    for row, frame in zip(rows, sampled(), strict=True):
        head = [frame.head_travel_m, frame.head_speed_mps, frame.time_scale]
        assert numbers(row, ["head_travel_m", "head_speed_mps", "time_scale"]) == head
        assert row["state"] == ["running", "paused", "held", "finished", "stopping", "ended", "ready"][frame.state]
    when_sent = {(frame.run_id, frame.tick): wall for frame, wall in zip(FRAMES, walls("/dragon/frames"), strict=True)}
    for name in ["frames.csv", "benches.csv", "all.csv"]:
        rows = table(name)
        assert rows and all(wall_ns(row) == when_sent[int(row["run_id"]), int(row["tick"])] for row in rows)
    alerts = messages("/dragon/alerts")
    rows = table("alerts.csv")
    assert [wall_ns(row) for row in rows] == walls("/dragon/alerts")
    assert len(rows) == len(alerts) > 0
    for row, alert in zip(rows, alerts, strict=True):
        assert when(row) == expected_when(alert)
        kinds = "near contact parted held fault restarted outside inside keep_out too_near clear".split()
        assert row["kind"] == kinds[alert.kind]
        if row["bench_a"]:
            assert (int(row["bench_a"]), int(row["bench_b"])) == (alert.bench_a, alert.bench_b)
            assert numbers(row, ["clearance_m", "x_m", "y_m"]) == [alert.clearance_m, *alert.point_m]


def test_the_record_of_commands_is_there_with_wall_times():
    events = messages("/dragon/commands")
    assert [event.kind for event in events] == [10, 11, 10, 11], "each run starts and ends"
    rows = table("commands.csv")
    for row, event in zip(rows, events, strict=True):
        assert when(row) == expected_when(event)
        assert row["wall_time"].endswith("Z")
        wall = datetime.fromisoformat(row["wall_time"])
        assert abs(wall.timestamp() - event.wall_ns / 1e9) < 1e-5
        assert (row["sender"], int(row["number"]), int(row["overruns"])) == ("server", event.number, event.overruns)
        assert (row["command"], row["outcome"]) == ({10: "start", 11: "end"}[event.kind], "")


def sheet(book, name):
    titles, *rows = [[cell.value for cell in row] for row in book[name].iter_rows()]
    return titles, rows


def columns(book, name):
    """Returns a sheet without its labels, as columns, one per frame."""
    titles, rows = sheet(book, name)
    return titles[1:], list(zip(*(row[1:] for row in rows)))


def test_a_workbook_has_a_column_for_each_frame():
    book = openpyxl.load_workbook(FOLDER / "handles.xlsx")
    assert book.sheetnames == ["frames", "positions", "speeds", "alerts", "commands", "configuration"]
    _, frames = sheet(book, "frames")
    assert [tuple(row[:3]) for row in frames] == [expected_when(frame) for frame in sampled()]
    titles, positions = columns(book, "positions")
    runs = list(dict.fromkeys(frame.run_id for frame in sampled()))
    for title, column, frame in zip(titles, positions, sampled(), strict=True):
        run = runs.index(frame.run_id) + 1
        assert title.startswith("run 2, " if run == 2 else f"{frame.show_time_ns / 1e9:g}")
        expected = [value for handle in frame.handles for value in handle.position_m[:2]]
        assert [value for value in column if value is not None] == expected
    _, speeds = columns(book, "speeds")
    for column, frame in zip(speeds, sampled(), strict=True):
        expected = [math.hypot(*handle.velocity_mps) for handle in frame.handles]
        assert [value for value in column if value is not None] == pytest.approx(expected, rel=1e-15)
    assert book["positions"]["B2"].number_format == "0.000000"
    _, alerts = sheet(book, "alerts")
    assert len(alerts) == len(messages("/dragon/alerts"))
    titles, commands = sheet(book, "commands")
    assert titles == list(table("commands.csv")[0]) and len(commands) == 4
    _, keys = sheet(book, "configuration")
    benches = [(run_id, value) for run_id, key, value in keys if key == "dragon.benches"]
    assert benches == [(runs[0], "223"), (runs[1], "5")]


def test_a_workbook_of_benches_has_their_headings():
    book = openpyxl.load_workbook(FOLDER / "benches.xlsx")
    assert book.sheetnames == ["frames", "positions", "headings", "speeds", "alerts", "commands", "configuration"]
    rows = iter(table("benches.csv"))
    _, headings = columns(book, "headings")
    for column in headings:
        for value in (value for value in column if value is not None):
            assert value == float(next(rows)["heading_rad"])
    assert next(rows, None) is None
