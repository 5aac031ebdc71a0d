"""Stock readers read what `hand-over` has written: openpyxl, ezdxf, csv, json, and the headers of PDF and PNG.

Run by the Rust test `hand_over::stock_readers_read_the_files_of_a_show_with_two_dragons`, which passes the folder in the environment.
"""

import csv
import json
import math
import os
import re
import struct
from html.parser import HTMLParser
from pathlib import Path

import ezdxf
import openpyxl
import pytest

FOLDER = Path(os.environ["HAND_OVER"])
POSES = json.loads((FOLDER / "solved.json").read_text())["poses"]
# A3 across, in millimetres.
SHEET = (420, 297)
DRAGONS = {"gold": 12, "silver": 7}


def table(name):
    with (FOLDER / name).open(newline="") as file:
        return list(csv.DictReader(file))


def solved(time_s, dragon, index):
    [pose] = [pose for pose in POSES if abs(pose["time_s"] - time_s) < 1e-9]
    [handle] = [handle for handle in pose["handles"] if (handle["dragon"], handle["index"]) == (dragon, index)]
    return handle


def test_the_floor_has_every_handle_at_every_moment():
    rows = table("floor.csv")
    assert len(rows) == len(POSES) * sum(count + 1 for count in DRAGONS.values())
    for row in rows:
        handle = solved(float(row["time_s"]), row["dragon"], int(row["handle"]))
        assert (float(row["x_m"]), float(row["y_m"])) == (handle["x_m"], handle["y_m"])
    assert list(dict.fromkeys(row["moment"] for row in rows)) == ["start", "slow <b>", "10 s", "bow", "end"]


def test_cad_reads_the_same_handles_in_metres():
    drawing = ezdxf.readfile(FOLDER / "floor.dxf")
    assert not drawing.audit().errors
    assert drawing.units == 6
    space = drawing.modelspace()
    rows = table("floor.csv")
    for layer in dict.fromkeys(row["layer"] for row in rows):
        points = [point.dxf.location for point in space.query(f'POINT[layer=="{layer}"]')]
        expected = [(float(row["x_m"]), float(row["y_m"])) for row in rows if row["layer"] == layer]
        assert [(point.x, point.y) for point in points] == expected
        texts = [text.dxf.text for text in space.query(f'TEXT[layer=="{layer}"]')]
        # Head, every tenth handle, and the tail.
        assert [text.split(" (")[0] for text in texts] == ["gold 0", "gold 10", "gold 12", "silver 0", "silver 7"]
        for text in texts:
            name, x, y = re.fullmatch(r"(\w+ \d+) \((-?[\d.]+), (-?[\d.]+)\) m", text).groups()
            dragon, index = name.split()
            [row] = [row for row in rows if (row["layer"], row["dragon"], row["handle"]) == (layer, dragon, index)]
            assert (float(x), float(y)) == pytest.approx((float(row["x_m"]), float(row["y_m"])), abs=5.1e-4)
    layers = {entity.dxf.layer for entity in space.query("POLYLINE")}
    assert layers == {"SWEPT", "OUTLINE", "CROWD"}


def test_each_bench_has_a_sheet_with_its_places():
    rows = table("benches.csv")
    assert len(rows) == len(POSES) * sum(DRAGONS.values())
    for row in rows:
        front, rear = [solved(float(row["time_s"]), row["dragon"], int(row["bench"]) + end) for end in (0, 1)]
        places = [float(row[key]) for key in ("front_x_m", "front_y_m", "rear_x_m", "rear_y_m")]
        assert places == [front["x_m"], front["y_m"], rear["x_m"], rear["y_m"]]
        assert float(row["speed_mps"]) == pytest.approx(front["speed_mps"], abs=1e-12)
        heading = math.degrees(math.atan2(front["y_m"] - rear["y_m"], front["x_m"] - rear["x_m"]))
        assert float(row["heading_deg"]) == pytest.approx(heading, abs=1e-9)


class Sheets(HTMLParser):
    """The headings and the rows of the sheets."""

    def __init__(self):
        super().__init__()
        self.headings, self.rows, self.inside = [], [], None

    def handle_starttag(self, tag, attributes):
        self.inside = tag
        if tag == "h2":
            self.headings.append("")
        elif tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_data(self, data):
        if self.inside == "h2":
            self.headings[-1] += data
        elif self.inside in ("td", "th"):
            self.rows[-1][-1] += data

    def handle_endtag(self, tag):
        self.inside = None


def test_the_printable_sheets_have_the_same_numbers():
    sheets = Sheets()
    sheets.feed((FOLDER / "benches.html").read_text())
    names = [f"{dragon} bench {bench}" for dragon, count in DRAGONS.items() for bench in range(count)]
    assert sheets.headings == ["How to read", *names]
    numbers = [row for row in sheets.rows if row[0] != "moment"]
    rows = table("benches.csv")
    assert len(numbers) == len(rows)
    for shown, row in zip(numbers, rows):
        assert shown[0] == row["moment"]
        keys = ("time_s", "front_x_m", "front_y_m", "rear_x_m", "rear_y_m", "heading_deg", "speed_mps")
        for cell, key, half in zip(shown[1:], keys, (0.051, *[0.0051] * 4, 0.51, 0.0051)):
            assert float(cell) == pytest.approx(float(row[key]), abs=half)


def test_the_workbook_and_the_csv_have_the_same_poses():
    rows = table("poses.csv")
    times = list(dict.fromkeys(float(row["time_s"]) for row in rows))
    assert times[:3] == [0.0, 1.0, 2.0]
    book = openpyxl.load_workbook(FOLDER / "poses.xlsx")
    assert book.sheetnames == ["positions", "speeds"]
    positions = {row[0].value: [cell.value for cell in row[1:]] for row in book["positions"].iter_rows(min_row=2)}
    assert len(positions) == 2 * sum(count + 1 for count in DRAGONS.values())
    names = {("gold", 0): "gold head", ("gold", 12): "gold tail rear", ("silver", 3): "silver bench 3"}
    for (dragon, index), name in names.items():
        of_handle = [row for row in rows if (row["dragon"], int(row["handle"])) == (dragon, index)]
        for axis in "xy":
            expected = [float(row[f"{axis}_m"]) for row in of_handle]
            assert positions[f"{name} {axis} (m)"] == pytest.approx(expected, abs=5.1e-7)


@pytest.mark.parametrize("name", ["plan", "floor"])
def test_the_plans_fill_a_sheet(name):
    png = (FOLDER / f"{name}.png").read_bytes()
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = struct.unpack(">II", png[16:24])
    assert sorted((width, height)) == pytest.approx(sorted(round(side / 25.4 * 300) for side in SHEET), abs=1)
    svg = (FOLDER / f"{name}.svg").read_text()
    sides = [float(side) for side in re.match(r'<svg [^>]*?width="([\d.]+)mm" height="([\d.]+)mm"', svg).groups()]
    assert sorted(sides) == pytest.approx(sorted(SHEET), abs=0.01)


@pytest.mark.parametrize(("name", "pages"), [("plan", 1), ("floor", 1), ("moments", len(POSES))])
def test_a_pdf_has_its_pages_and_every_object_at_its_place(name, pages):
    pdf = (FOLDER / f"{name}.pdf").read_bytes()
    assert pdf.startswith(b"%PDF-1.4\n") and pdf.endswith(b"%%EOF\n")
    table_at = int(re.search(rb"startxref\n(\d+)\n%%EOF\n$", pdf).group(1))
    assert pdf[table_at:].startswith(b"xref\n0 ")
    places = [int(place) for place in re.findall(rb"^(\d{10}) 00000 n $", pdf[table_at:], re.MULTILINE)]
    assert len(places) == 3 + 2 * pages
    for number, place in enumerate(places, start=1):
        assert pdf[place:].startswith(b"%d 0 obj\n" % number)
    boxes = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", pdf)
    assert len(boxes) == pages
    for box in boxes:
        assert sorted(float(side) * 25.4 / 72 for side in box) == pytest.approx(sorted(SHEET), abs=0.01)
    for length, start in re.findall(rb"/Length (\d+) >>\nstream\n()", pdf):
        assert int(length) > 1000
    for found in re.finditer(rb"/Length (\d+) >>\nstream\n", pdf):
        assert pdf[found.end() + int(found.group(1)) :].startswith(b"endstream")


def test_the_page_has_everything_in_it():
    page = (FOLDER / "show.html").read_text()
    assert "default-src 'none'" in page
    assert not re.search(r"https?://|<link|<img|@import|url\(", page)
    assert "<b>" not in page and "slow \\u003cb>" in page
