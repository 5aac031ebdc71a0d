"""Figures, read by a stock reader of XML and PNG: well-formed, 160 mm wide, to scale, and without fonts.

Run by the Rust test `a_stock_reader_finds_everything_that_a_printer_needs`, which draws the
figures and passes their folder in the environment.
"""

import math
import os
import re
import struct
import zlib
from pathlib import Path
from xml.etree import ElementTree

import pytest

FOLDER = Path(os.environ["FIGURES"])
NAMES = sorted(path.stem for path in FOLDER.glob("*.svg"))
# Some of the labels that each figure has.
LABELS = {
    "plan": ["x (m)", "y (m)"],
    "turnaround": ["x (m)", "y (m)", "turning circle", "nearest pair"],
    "contact": ["x (m)", "y (m)", "bench 0, head", "bench 8"],
    "clearance": ["show time (s)", "clearance (m)", "clearance (mm)", "contact at 412.473838 s", "benches 0 and 11"],
    "speeds": ["show time (s)", "speed (m/s)", "all handles"],
    "profile": ["travel (m)", "speed (m/s)", "limit", "quickest", "cues"],
    "sensitivity": ["change (%)", "first contact (s)", "smallest pitch (m)"],
}
SVG = "{http://www.w3.org/2000/svg}"
DOTS_PER_MM = 300 / 25.4


def root(name):
    return ElementTree.parse(FOLDER / f"{name}.svg").getroot()


def labels(name):
    return [path.get("aria-label") for path in root(name).iter(f"{SVG}path") if path.get("aria-label")]


def size_mm(name):
    left, top, width, height = map(float, root(name).get("viewBox").split())
    assert (left, top) == (0, 0)
    return width, height


def chunks(name):
    """Yields the chunks of a PNG file, and checks their checksums."""
    data = (FOLDER / f"{name}.png").read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at = 8
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        [checksum] = struct.unpack(">I", data[at + 8 + length : at + 12 + length])
        assert zlib.crc32(kind + body) == checksum
        yield kind, body
        at += 12 + length
    assert kind == b"IEND"


@pytest.mark.parametrize("name", NAMES)
def test_a_vector_figure_is_a_page_wide_and_refers_to_nothing_outside_it(name):
    width, height = size_mm(name)
    assert width == 160 and 50 < height < 240
    assert root(name).get("width") == "160mm"
    assert float(root(name).get("height").removesuffix("mm")) == height
    assert {element.tag for element in root(name).iter()} <= {SVG + tag for tag in ("svg", "title", "path", "clipPath")}
    for element in root(name).iter():
        assert not any("font" in key or "href" in key or key == "style" for key in element.keys())


@pytest.mark.parametrize("name", NAMES)
def test_the_axes_have_their_units(name):
    assert set(LABELS[name]) <= set(labels(name))


@pytest.mark.parametrize("name", NAMES)
def test_a_pixel_figure_has_300_dots_per_inch_and_states_it(name):
    parts = list(chunks(name))
    kind, header = parts[0]
    width, height, depth, colour, _, _, interlace = struct.unpack(">IIBBBBB", header)
    assert (kind, depth, colour, interlace) == (b"IHDR", 8, 2, 0)
    assert (width, height) == tuple(round(length * DOTS_PER_MM) for length in size_mm(name))
    assert dict(parts)[b"pHYs"] == struct.pack(">IIB", 11811, 11811, 1)
    pixels = zlib.decompress(b"".join(body for kind, body in parts if kind == b"IDAT"))
    assert len(pixels) == height * (1 + 3 * width)


def board(path):
    """Returns length and width of a drawn rectangle that begins at its front left corner."""
    corners = [(float(x), float(y)) for x, y in re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", path.get("d"))]
    return math.dist(corners[0], corners[1]), math.dist(corners[1], corners[2])


@pytest.mark.parametrize("name", ["plan", "turnaround", "contact"])
def test_a_metre_is_as_long_in_every_direction(name):
    drawn = [path for path in root(name).iter(f"{SVG}path") if re.fullmatch(r"bench \d+", path.get("aria-label", ""))]
    boards = [path for path in drawn if path.get("clip-path") == "url(#clip0)"]
    assert len(boards) == 223
    lengths = {bench: board(path) for path in boards for bench in [int(path.get("aria-label").split()[1])]}
    mm_per_m = lengths[0][0] / 3.41
    for bench, (length, width) in lengths.items():
        # Corners are written to a micrometre.
        assert length == pytest.approx((3.41 if bench == 0 else 2.20) * mm_per_m, abs=0.003)
        assert width == pytest.approx(0.30 * mm_per_m, abs=0.003)
