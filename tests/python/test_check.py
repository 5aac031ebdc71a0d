"""`solve check` finds tables that are right, and names the mistakes of tables that scipy has computed with a mistake.

Run by the Rust test `check::tables_of_scipy_are_right_and_their_mistakes_have_names`, which passes the program in the environment.
"""

import json
import math
import os
import subprocess
import zipfile

import openpyxl
import pytest

from contest import LINKS, NAMES, chain, inward, pose, speeds, turnaround, write_at_end, write_by_time

PROGRAM = os.environ["BENCH_DRAGON"]
TIMES = range(0, 301, 60)
TURN_TIMES = range(-100, 101, 25)
CONTACT = 412.4738376821


def solve(*args):
    done = subprocess.run([PROGRAM, "solve", *map(str, args)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def check(path, *args):
    answer = json.loads(solve("check", path, "--format", "json", *args))
    return answer, [mistake["mistake"] for mistake in answer["mistakes"]]


def assert_right(path, values):
    answer, mistakes = check(path)
    assert answer["right"] and mistakes == []
    for name, count in zip(("positions", "speeds"), values):
        assert (answer[name]["values"], answer[name]["right"]) == (count, count), answer[name]
        assert answer[name]["largest"]["difference"] < 5.1e-7
    return answer


def test_exact_tables_are_right(tmp_path):
    write_by_time(tmp_path / "result1.xlsx", TIMES, [pose(inward, time) for time in TIMES])
    assert_right(tmp_path / "result1.xlsx", (2 * 224 * len(TIMES), 224 * len(TIMES)))
    write_at_end(tmp_path / "result2.xlsx", pose(inward, CONTACT))
    answer = assert_right(tmp_path / "result2.xlsx", (2 * 224, 224))
    assert answer["contact"]["time_s"] == pytest.approx(CONTACT, abs=2e-6)
    assert answer["contact"]["exact_s"] == pytest.approx(CONTACT, abs=1e-8)
    write_by_time(tmp_path / "result4.xlsx", TURN_TIMES, [pose(turnaround(), time) for time in TURN_TIMES])
    assert_right(tmp_path / "result4.xlsx", (2 * 224 * len(TURN_TIMES), 224 * len(TURN_TIMES)))


def test_the_programs_own_tables_have_the_contests_labels_and_are_right(tmp_path):
    files = {name: tmp_path / f"{name}.xlsx" for name in ("result1", "result2", "result4")}
    config = tmp_path / "turnaround.toml"
    config.write_text('[route]\nkind = "turnaround"\n')
    solve("poses", "--from", 0, "--to", 300, "--contest", files["result1"])
    solve("contact", "--contest", files["result2"])
    solve("poses", "--config", config, "--from", -100, "--to", 100, "--contest", files["result4"])
    for name, times in (("result1", range(301)), ("result4", range(-100, 101))):
        book = openpyxl.load_workbook(files[name])
        assert book.sheetnames == ["位置", "速度"]
        for sheet in book:
            assert [cell.value for cell in sheet[1]] == [None, *(f"{time} s" for time in times)]
        labels = [row[0].value for row in book["位置"].iter_rows(min_row=2)]
        assert labels == [f"{name}{axis} (m)" for name in NAMES for axis in "xy"]
        assert [row[0].value for row in book["速度"].iter_rows(min_row=2)] == [f"{name} (m/s)" for name in NAMES]
        assert_right(files[name], (2 * 224 * len(times), 224 * len(times)))
    sheet = openpyxl.load_workbook(files["result2"]).active
    assert [cell.value for cell in sheet[1]] == [None, "横坐标x (m)", "纵坐标y (m)", "速度 (m/s)"]
    assert [row[0].value for row in sheet.iter_rows(min_row=2)] == NAMES
    assert_right(files["result2"], (2 * 224, 224))


def test_csv_and_workbooks_of_poses_are_right(tmp_path):
    csv = tmp_path / "poses.csv"
    csv.write_text(solve("poses", "--at", "0,60,412", "--format", "csv"))
    assert_right(csv, (2 * 224 * 3, 224 * 3))
    solve("poses", "--at", "0,60,412", "--xlsx", tmp_path / "poses.xlsx")
    assert_right(tmp_path / "poses.xlsx", (2 * 224 * 3, 224 * 3))


def test_a_wrong_number_is_found_at_its_place(tmp_path):
    poses = [pose(inward, time) for time in TIMES]
    places = poses[2][0]
    places[51] = (places[51][0] + 0.004, places[51][1])
    write_by_time(tmp_path / "result1.xlsx", TIMES, poses)
    answer, mistakes = check(tmp_path / "result1.xlsx")
    assert not answer["right"] and mistakes == []
    largest = answer["positions"]["largest"]
    assert (largest["time_s"], largest["handle"], largest["name"], largest["quantity"]) == (120, 51, "第51节龙身", "x_m")
    assert largest["difference"] == pytest.approx(0.004, abs=1e-6)
    assert answer["positions"]["right"] == answer["positions"]["values"] - 1
    assert answer["speeds"]["right"] == answer["speeds"]["values"]


def arc_for_chord(route, time):
    lengths = [time]
    for link in LINKS:
        lengths.append(lengths[-1] - link)
    return [route(s)[0] for s in lengths], [1.0] * 224


def chain_ahead(time):
    lengths = chain(inward, time, direction=1)
    return [inward(s)[0] for s in lengths], speeds(inward, lengths)


def counter_clockwise(time):
    places, of_speeds = pose(inward, time)
    return [(x, -y) for x, y in places], of_speeds


def exit_not_turned(time):
    exact = turnaround()
    lengths = chain(exact, time)
    return [turnaround(exit_turn=1)(s)[0] for s in lengths], speeds(exact, lengths)


@pytest.mark.parametrize(
    ("name", "times", "wrong"),
    [
        ("arc_for_chord", TIMES, lambda time: arc_for_chord(inward, time)),
        ("arc_for_chord", TURN_TIMES, lambda time: arc_for_chord(turnaround(), time)),
        ("chain_ahead", range(0, 61, 20), chain_ahead),
        ("counter_clockwise", TIMES, counter_clockwise),
        ("exit_not_turned", TURN_TIMES, exit_not_turned),
        ("arcs_swapped", TURN_TIMES, lambda time: pose(turnaround(ratio=0.5), time)),
    ],
)
def test_a_mistake_in_positions_has_its_name(tmp_path, name, times, wrong):
    path = tmp_path / "wrong.xlsx"
    write_by_time(path, times, [wrong(time) for time in times])
    answer, mistakes = check(path)
    assert not answer["right"] and mistakes == [name]


@pytest.mark.parametrize("way", ["before", "after", "both"])
def test_speeds_from_differences_have_their_name(tmp_path, way):
    places = {time: pose(inward, time)[0] for time in range(-1, 9) if time >= 0}
    times = range(1, 8)
    ends = {"before": (-1, 0), "after": (0, 1), "both": (-1, 1)}[way]

    def differences(time):
        first, last = (places[time + end] for end in ends)
        return [math.dist(*two) / (ends[1] - ends[0]) for two in zip(first, last)]

    path = tmp_path / "result1.xlsx"
    write_by_time(path, times, [(places[time], differences(time)) for time in times])
    answer, mistakes = check(path)
    assert not answer["right"] and mistakes == ["speeds_from_differences"]
    assert answer["positions"]["right"] == answer["positions"]["values"]


@pytest.mark.parametrize(
    ("name", "time"), [("narrow_boards", 412.849997), ("narrow_boards", 412.85), ("neighbours_touch", 0.0)]
)
def test_a_wrong_first_contact_has_its_name(tmp_path, name, time):
    path = tmp_path / "result2.xlsx"
    write_at_end(path, pose(inward, time))
    answer, mistakes = check(path)
    assert not answer["right"] and mistakes == [name]
    assert answer["contact"]["time_s"] == pytest.approx(time, abs=2e-6)
    # The poses are right for their own time.
    assert answer["positions"]["right"] >= answer["positions"]["values"] - 12
    assert answer["contact"]["at_contact"]["positions"]["right"] < 10


def test_a_wrong_contact_of_a_wrong_chain_has_both_names(tmp_path):
    path = tmp_path / "result2.xlsx"
    write_at_end(path, arc_for_chord(inward, 412.849997))
    assert check(path)[1] == ["arc_for_chord", "narrow_boards"]


def test_a_table_of_some_handles_is_enough(tmp_path):
    path = tmp_path / "paper.xlsx"
    book = openpyxl.Workbook()
    times = range(0, 301, 60)
    poses = [arc_for_chord(inward, time) for time in times]
    book.active.append(["表1"])
    book.active.append([None, *times])
    for handle in (0, 1, 51, 101, 151, 201, 223):
        for axis, letter in enumerate("xy"):
            book.active.append([f"{NAMES[handle]} {letter}（m）", *(places[handle][axis] for places, _ in poses)])
    book.save(path)
    answer, mistakes = check(path)
    assert mistakes == ["arc_for_chord"] and answer["positions"]["values"] == 2 * 7 * len(times)
    assert answer["speeds"]["values"] == 0 and answer["speeds"]["largest"] is None


SHEET = '<?xml version="1.0"?><worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'


def hostile(path, rows, strings=()):
    """A workbook of these rows, and of shared strings."""
    empty = path.with_name("empty.xlsx")
    openpyxl.Workbook().save(empty)
    with zipfile.ZipFile(empty) as source, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as book:
        for name in source.namelist():
            if name not in ("xl/worksheets/sheet1.xml", "xl/sharedStrings.xml"):
                book.writestr(name, source.read(name))
        with book.open("xl/worksheets/sheet1.xml", "w", force_zip64=True) as sheet:
            for part in (SHEET, *rows, "</sheetData></worksheet>"):
                sheet.write(part.encode())
        with book.open("xl/sharedStrings.xml", "w", force_zip64=True) as shared:
            shared.write(b'<?xml version="1.0"?><sst xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><si><t>')
            for part in strings:
                shared.write(part)
            shared.write(b"</t></si></sst>")


@pytest.mark.parametrize(
    ("rows", "strings", "reason"),
    [
        (['<row r="1"><c r="B1"><v>0</v></c></row><row r="1048576"><c r="XFD1048576"><v>1</v></c></row>'], (), "row 1048576"),
        (['<row r="1">' + '<c r="A1"><v>1</v></c>' * 100_000 + "</row>"] * 41, (), "more than 4000000 cells"),
        ([], [b"a" * (1 << 24)] * 80, "more than 1024 MiB of memory"),
    ],
    ids=["far", "many", "long"],
)
def test_a_hostile_workbook_is_refused_in_one_line(tmp_path, rows, strings, reason):
    path = tmp_path / "hostile.xlsx"
    hostile(path, rows, strings)
    done = subprocess.run([PROGRAM, "solve", "check", str(path)], capture_output=True, text=True)
    assert done.returncode == 2 and done.stdout == ""
    assert reason in done.stderr and done.stderr.count("\n") == 1, done.stderr
