"""svgelements, svgpathtools and ezdxf sample random drawings. The routes that follow these are within the tolerance, both ways.

Run by the Rust test `drawing::independent_libraries_measure_the_routes_of_random_drawings`.
"""

import math
import os
import random
import subprocess
import tomllib

import ezdxf
import numpy as np
import pytest
import svgelements
import svgpathtools
from scipy.spatial import cKDTree

# One short bench walks routes with tight arcs.
DRAGON = "[dragon]\nbenches = 1\nhead_length_m = 0.04\nbody_length_m = 0.04\nhole_offset_m = 0.01\nwidth_m = 0.01\n\n"
TOLERANCE_M = 0.005
CORNER_RADIUS_M = 0.1
# Samples stand for what is between them to within this.
SAMPLED_M = 2e-5
# Drawings of each kind.
SEEDS = range(int(os.environ["DRAWINGS"]))


def run(folder, drawing, **keys):
    """Runs the planner on a drawing."""
    values = {"kind": "drawing", "file": drawing.name, **keys}
    quoted = {key: f'"{value}"' if isinstance(value, str) else str(value) for key, value in values.items()}
    config = folder / "drawn.toml"
    config.write_text(DRAGON + "[route]\n" + "".join(f"{key} = {value}\n" for key, value in quoted.items()))
    command = [os.environ["BENCH_DRAGON"], "solve", "speed-limit", "--limit", "9"]
    saved = folder / "saved.toml"
    saved.unlink(missing_ok=True)
    command += ["--config", str(config), "--save-config", str(saved)]
    return subprocess.run(command, capture_output=True, text=True, check=False), saved


def route_of(folder, drawing, **keys):
    """The table `[route]` of the route that follows a drawing."""
    ended, saved = run(folder, drawing, **keys)
    assert ended.returncode == 0, ended.stderr
    return tomllib.loads(saved.read_text())["route"]


def points_of(route):
    """Points of a route every two millimetres, chained from its segments."""
    at, heading = complex(route["start_x_m"], route["start_y_m"]), math.radians(route["start_heading_deg"])
    points = [np.array([at])]
    for segment in route["segments"]:
        direction = complex(math.cos(heading), math.sin(heading))
        if segment["kind"] == "line":
            length = segment["length_m"]
            steps = np.linspace(0, 1, max(2, int(length / 0.002)))[1:]
            leads = steps * length * direction
        else:
            turn = math.radians(segment["turn_deg"])
            radius = math.copysign(segment["radius_m"], turn)
            steps = np.linspace(0, 1, max(8, int(abs(turn * radius) / 0.002), int(abs(turn) / 0.01)))[1:]
            leads = 2 * radius * np.sin(turn * steps / 2) * direction * np.exp(0.5j * turn * steps)
            heading += turn
        points.append(at + leads)
        at += leads[-1]
    return np.concatenate(points)


def distances(points, curve):
    """The distance of each point from a polyline."""
    _, near = cKDTree(np.column_stack([curve.real, curve.imag])).query(np.column_stack([points.real, points.imag]))
    best = np.full(len(points), np.inf)
    for shift in (-1, 0):
        begin = np.clip(near + shift, 0, len(curve) - 2)
        lead, edge = points - curve[begin], curve[begin + 1] - curve[begin]
        square = np.maximum(np.abs(edge) ** 2, 1e-30)
        part = np.clip((lead * edge.conjugate()).real / square, 0, 1)
        best = np.minimum(best, np.abs(lead - part * edge))
    return best


def assert_follows(route, drawn, corners=(), reach=0.0):
    """Fails if the route or the drawing is further from the other than the tolerance, except near corners."""
    followed = points_of(route)
    for points, curve in ((drawn, followed), (followed, drawn)):
        far = distances(points, curve)
        for corner in corners:
            far[np.abs(points - corner) < reach] = 0.0
        worst = int(np.argmax(far))
        assert far[worst] <= TOLERANCE_M + SAMPLED_M, f"{far[worst]} m apart at {points[worst]}"
    return len(route["segments"])


def sampled(segments, transform=lambda point: point):
    """Points of svgpathtools or svgelements segments, with y up."""
    points = []
    for segment in segments:
        for step in np.linspace(0, 1, 8000):
            point = transform(segment.point(step))
            x, y = (point.real, point.imag) if isinstance(point, complex) else (point.x, point.y)
            points.append(complex(x, -y))
    return np.array(points)


def document(body, head='viewBox="0 0 100 100"'):
    return f'<svg xmlns="http://www.w3.org/2000/svg" {head}>{body}</svg>'


def random_curve(source, count=6):
    """Data of a smooth path with curves of every kind, absolute and relative."""
    number = lambda low, high: source.uniform(low, high)  # noqa: E731
    data = f"M {number(0, 5):.4f} {number(0, 5):.4f} C 6 {number(-5, 5):.4f} {number(5, 9):.4f} 8 12 {number(6, 12):.4f}"
    for i in range(count):
        x, y = 12 + 8 * (i + 1), number(0, 20)
        data += f" S {x - number(3, 5):.4f} {y + number(-4, 4):.4f} {x:.4f} {y:.4f}"
    data += f" s {number(3, 5):.4f},{number(-4, 4):.4f} 8,{number(-5, 5):.4f}"
    return data


@pytest.mark.parametrize("seed", SEEDS)
def test_smooth_svg_curves_are_followed(tmp_path, seed):
    source = random.Random(seed)
    data = random_curve(source)
    drawing = tmp_path / "curve.svg"
    drawing.write_text(document(f'<path id="a" d="{data}"/>'))
    route = route_of(tmp_path, drawing)
    count = assert_follows(route, sampled(svgpathtools.parse_path(data)))
    print(f"seed {seed}: {count} segments")


def random_path(source):
    """Data of a path with all commands, absolute and relative, and its joints; none turns by more than 110 degrees."""
    at, data = complex(source.uniform(0, 5), source.uniform(0, 5)), ""
    written = lambda command, point: point - (at if command.islower() else 0)  # noqa: E731
    pair = lambda command, point: "{0.real:.4f} {0.imag:.4f}".format(written(command, point))  # noqa: E731
    data = "M " + pair("M", at)
    for command in source.sample("LlHhCcSsQqTtAaVv", 16):
        near = lambda x, y: at + complex(source.uniform(*x), source.uniform(*y))  # noqa: E731
        to = near((5, 7), (-4, 4))
        values = {
            "L": lambda c=command: pair(c, to),
            "C": lambda c=command: f"{pair(c, near((1, 3), (-3, 3)))}, {pair(c, to - near((1, 3), (-3, 3)) + at)}, {pair(c, to)}",
            "S": lambda c=command: f"{pair(c, to - near((1, 3), (-3, 3)) + at)} {pair(c, to)}",
            "Q": lambda c=command: f"{pair(c, near((2, 4), (-3, 3)))} {pair(c, to)}",
            "T": lambda c=command: pair(c, to),
            "A": lambda c=command: (
                f"{source.uniform(4, 9):.3f},{source.uniform(4, 9):.3f} {source.uniform(0, 180):.2f}"
                f" {source.randrange(2)}{source.randrange(2)}{pair(c, to)}"
            ),
        }
        if command in "HhVv":
            to = complex(to.real, at.imag) if command in "Hh" else complex(at.real, at.imag + source.uniform(4, 6))
            number = written(command, to)
            data += f"{command}{number.real if command in 'Hh' else number.imag:.4f}"
        else:
            data += f" {command} {values[command.upper()]()}"
        at = complex(round(to.real, 4), round(to.imag, 4))
    segments = svgpathtools.parse_path(data)
    for before, after in zip(segments[:-1], segments[1:], strict=True):
        turn = after.derivative(1e-6) / before.derivative(1 - 1e-6)
        if abs(math.degrees(math.atan2(turn.imag, turn.real))) > 110:
            return random_path(source)
    return data


@pytest.mark.parametrize("seed", SEEDS)
def test_svg_paths_of_all_commands_are_followed(tmp_path, seed):
    data = random_path(random.Random(seed))
    drawing = tmp_path / "path.svg"
    drawing.write_text(document(f'<path d="{data}"/>'))
    segments = svgpathtools.parse_path(data)
    joints = [segment.end.conjugate() for segment in segments[:-1]]
    assert_follows(route_of(tmp_path, drawing, corner_radius_m=CORNER_RADIUS_M), sampled(segments), joints, reach=0.3)


SHAPES = {
    "rect": '<rect {} x="10" y="5" width="30" height="12"/>',
    "rounded rect": '<rect {} x="1cm" y="5" width="30" height="12" rx="2" ry="4"/>',
    "circle": '<circle {} cx="20" cy="12" r="9"/>',
    "ellipse": '<ellipse {} cx="50%" cy="9" rx="20" ry="7"/>',
    "line": '<line {} x1="3" y1="4" x2="1in" y2="40"/>',
    "polyline": '<polyline {} points="0,0 20,3 25,20 60,30"/>',
    "polygon": '<polygon {} points="0 0 20 3 25 20 4 15"/>',
    "path": '<path {} d="M0 0h20v10a10 5 30 0 0 20 8l9 3"/>',
}
TRANSFORMS = {
    "none": "",
    "moved": "translate(10 -4)",
    "turned": "rotate(33 5 5)",
    "scaled": "scale(1.5)",
    "stretched": "scale(1.2 0.7)",
    "mirrored": "scale(-1 1)",
    "skewed": "skewX(20) translate(3)",
    "matrix": "matrix(0.8 0.3 -0.2 1.1 7 3)",
}


@pytest.mark.parametrize("transform", TRANSFORMS)
@pytest.mark.parametrize("shape", SHAPES)
def test_every_svg_shape_is_followed_in_every_transform(tmp_path, shape, transform):
    inner = SHAPES[shape].format(f'id="a" transform="{TRANSFORMS[transform]}"')
    text = document(
        f'<rect width="3" height="3"/><g transform="rotate(-20) scale(0.9)">{inner}</g>',
        'width="200" height="100" viewBox="0 0 100 100"',
    )
    drawing = tmp_path / "shape.svg"
    drawing.write_text(text)
    route = route_of(tmp_path, drawing, id="a", metres_per_unit=0.5, corner_radius_m=CORNER_RADIUS_M)
    parsed = svgelements.SVG.parse(drawing, reify=False, width=100, height=100)
    element = next(element for element in parsed.elements() if element.id == "a")
    # Points are transformed, not arcs: svgelements does not skew arcs.
    transform = svgelements.Matrix(element.transform)
    element.transform = svgelements.Matrix()
    pieces = [piece for piece in svgelements.Path(element) if not isinstance(piece, svgelements.Move)]
    pieces = [piece for piece in pieces if piece.length() > 1e-9]
    drawn = sampled(pieces, transform.point_in_matrix_space) * 0.5
    starts = [transform.point_in_matrix_space(piece.start) for piece in pieces]
    joints = [complex(start.x, -start.y) * 0.5 for start in starts]
    assert_follows(route, drawn, joints, reach=0.5)
    assert len(route["segments"]) <= 60
    if shape == "circle" and transform in ("none", "moved", "turned", "scaled", "mirrored"):
        assert len(route["segments"]) == 1


@pytest.mark.parametrize("nested", [False, True])
def test_used_paths_lie_where_their_transforms_and_units_put_them(tmp_path, nested):
    use = '<use id="a" href="#p" x="5" y="3" transform="rotate(10) scale(2)"/>'
    body = f'<svg x="4" y="6" width="50" height="25" viewBox="0 0 25 12.5">{use}</svg>' if nested else f"<g>{use}</g>"
    text = document(
        f'<defs><g><path id="p" style="display:inline" d="M1 2 Q 9 2 9 9"/></g></defs>{body}',
        'width="200mm" height="100mm" viewBox="0 0 100 50"',
    )
    drawing = tmp_path / "used.svg"
    drawing.write_text(text)
    route = route_of(tmp_path, drawing, id="a", metres_per_unit=0.1)
    rotation = complex(math.cos(math.radians(10)), math.sin(math.radians(10)))
    steps = np.linspace(0, 1, 8000)
    local = (1 + 2j) * (1 - steps) ** 2 + 2 * (9 + 2j) * (1 - steps) * steps + (9 + 9j) * steps**2 + (5 + 3j)
    placed = 2 * local * rotation
    placed = 4 + 6j + 2 * placed if nested else placed
    # Two millimetres are a unit of the viewBox, and 96 pixels an inch.
    drawn = (placed * 2 * 96 / 25.4 * 0.1).conjugate()
    assert_follows(route, drawn)


def dxf_points(entity):
    """Points of an entity. Those of splines and ellipses lie on the curve itself, not on ezdxf's approximation by cubics."""
    match entity.dxftype():
        case "SPLINE":
            spline = entity.construction_tool()
            points = spline.points(np.linspace(0, spline.max_t, 20_000))
        case "ELLIPSE":
            points = entity.vertices(entity.params(20_000))
        case "LINE":
            points = [entity.dxf.start.lerp(entity.dxf.end, step) for step in np.linspace(0, 1, 5000)]
        case "ARC" | "CIRCLE":
            points = entity.flattening(1e-6)
        case _:
            parts = [dxf_points(part) for part in entity.virtual_entities()]
            return np.concatenate(parts)
    return np.array([complex(point.x, point.y) for point in points])


def save(folder, fill, units=6):
    drawing = folder / "drawing.dxf"
    dxf = ezdxf.new(units=units)
    entity = fill(dxf.modelspace())
    dxf.saveas(drawing)
    return drawing, entity


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("kind", ["line", "arc", "circle", "ellipse", "polyline", "closed polyline", "old polyline", "spline", "rational"])
def test_every_dxf_entity_is_followed(tmp_path, kind, seed):
    source = random.Random(seed)
    point = lambda: (source.uniform(-50, 50), source.uniform(-50, 50))  # noqa: E731
    mirrored = {"extrusion": (0, 0, source.choice([1, -1]))}
    angles = source.uniform(0, 360), source.uniform(0, 360)
    bulge = lambda: source.choice([0, source.uniform(-0.3, 0.3)])  # noqa: E731
    bulges = [(12 * i, source.uniform(0, 8), bulge()) for i in range(7)]
    ring = [(20 * math.cos(i + source.random() / 2), 20 * math.sin(i + source.random() / 2), bulge()) for i in range(6)]
    controls = [(8 * i, source.uniform(0, 12)) for i in range(9)]
    weights = [source.uniform(0.5, 3) for _ in controls]
    fill = {
        "line": lambda space: space.add_line(point(), point()),
        "arc": lambda space: space.add_arc(point(), source.uniform(2, 40), *angles, dxfattribs=mirrored),
        "circle": lambda space: space.add_circle(point(), source.uniform(2, 40), dxfattribs=mirrored),
        "ellipse": lambda space: space.add_ellipse(
            point(), (source.uniform(5, 20), 3), 0.6, *map(math.radians, angles), dxfattribs=mirrored
        ),
        "polyline": lambda space: space.add_lwpolyline(bulges, format="xyb", dxfattribs=mirrored),
        "closed polyline": lambda space: space.add_lwpolyline(ring, format="xyb", close=True, dxfattribs=mirrored),
        "old polyline": lambda space: space.add_polyline2d(bulges, format="xyb", dxfattribs=mirrored),
        "spline": lambda space: space.add_open_spline(controls, degree=source.choice([2, 3, 4])),
        "rational": lambda space: space.add_rational_spline(controls, weights, degree=3),
    }[kind]
    drawing, entity = save(tmp_path, fill)
    route = route_of(tmp_path, drawing, corner_radius_m=CORNER_RADIUS_M)
    ends = {"polyline": bulges, "old polyline": bulges, "closed polyline": ring}.get(kind, [])
    sign = entity.dxf.extrusion.z if "polyline" in kind else 1
    assert_follows(route, dxf_points(entity), [complex(sign * x, y) for x, y, _ in ends], reach=1.5)
    if kind in ("line", "arc", "circle"):
        assert len(route["segments"]) == 1


def test_dxf_units_and_metres_per_unit_scale_the_route(tmp_path):
    drawing, _ = save(tmp_path, lambda space: space.add_line((0, 0), (5000, 0)), units=4)
    assert route_of(tmp_path, drawing)["segments"] == [{"kind": "line", "length_m": 5.0}]
    assert route_of(tmp_path, drawing, metres_per_unit=0.01)["segments"] == [{"kind": "line", "length_m": 50.0}]


def test_dxf_entities_of_a_layer_are_joined_end_to_end(tmp_path):
    def fill(space):
        route = {"layer": "Route"}
        space.add_line((0, 0), (10, 0), dxfattribs=route)
        space.add_line((30, 10), (15, 5), dxfattribs=route)
        space.add_arc((10, 5), 5, 270, 360, dxfattribs=route)
        space.add_circle((0, 0), 3)

    drawing, _ = save(tmp_path, fill)
    route = route_of(tmp_path, drawing, id="route", corner_radius_m=1)
    assert [segment["kind"] for segment in route["segments"]] == ["line", "arc", "arc", "line"]
    ended, _ = run(tmp_path, drawing)
    assert ended.returncode == 2
    assert ended.stderr.rstrip().endswith('set id to a handle or a layer; layers: "0", "Route"')


def fewest_arcs(wave_m):
    """Number of arcs of the best biarcs along y = w·sin(x/w), for small tolerances.

    A biarc of the length h is about |κ'|·h³/324 from the curve (Meek and Walton, "Approximating smooth planar curves by arc
    splines", 1995).
    """
    x = np.linspace(0, 80, 20_001)
    slope, bend, change = np.cos(x / wave_m), -np.sin(x / wave_m) / wave_m, -np.cos(x / wave_m) / wave_m**2
    stretch = 1 + slope**2
    curvature_change = (change / stretch**1.5 - 3 * slope * bend**2 / stretch**2.5) / np.sqrt(stretch)
    biarcs_per_m = (np.abs(curvature_change) / (324 * TOLERANCE_M)) ** (1 / 3)
    return 2 * np.trapezoid(biarcs_per_m * np.sqrt(stretch), x)


@pytest.mark.parametrize("seed", SEEDS)
def test_sampled_csv_curves_are_followed(tmp_path, seed):
    source = random.Random(seed)
    wave_m = source.uniform(4, 8)
    curve = np.array([complex(x, wave_m * math.sin(x / wave_m)) for x in np.linspace(0, 80, 1500)])
    decimals = source.choice([3, 4, 9])
    drawing = tmp_path / "points.csv"
    rows = [f"{point.real:.{decimals}f},{point.imag:.{decimals}f}" for point in curve]
    drawing.write_text("x_m,y_m\n" + "\n".join(rows) + "\n")
    read = np.array([complex(*map(float, row.split(","))) for row in rows])
    count = assert_follows(route_of(tmp_path, drawing), read)
    # The fit may keep to 0.4 of the tolerance, with 0.4^(-1/3) = 1.36 times as many arcs, and ends them at points of the file.
    assert count <= 2 * fewest_arcs(wave_m)


@pytest.mark.parametrize("seed", SEEDS)
def test_csv_corners_are_rounded(tmp_path, seed):
    source = random.Random(seed)
    points = [complex(10 * i, source.uniform(0, 9)) for i in range(12)]
    drawing = tmp_path / "points.csv"
    drawing.write_text("".join(f"{point.real!r};{point.imag!r}\n" for point in points))
    route = route_of(tmp_path, drawing, corner_radius_m=2)
    assert max(segment.get("radius_m", 9) for segment in route["segments"]) >= 2
    drawn = np.concatenate([np.linspace(a, b, 5000) for a, b in zip(points[:-1], points[1:], strict=True)])
    assert_follows(route, drawn, points, reach=2.5)
