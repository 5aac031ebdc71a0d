"""The paper's dragon by numpy and scipy alone, and tables of it as the contest asks for, with mistakes on request.

A route is a function from the length walked to the place and the direction there. The chain goes from handle to handle along it.
"""

import math

import openpyxl
from scipy.optimize import brentq

BENCHES = 223
LINKS = [3.41 - 0.55] + [2.20 - 0.55] * (BENCHES - 1)
NAMES = ["龙头", *(f"第{bench}节龙身" for bench in range(1, 222)), "龙尾", "龙尾（后）"]


def spiral_length(b, theta):
    return 0.5 * b * (theta * math.sqrt(1 + theta * theta) + math.asinh(theta))


def spiral_theta(b, length):
    """The angle at which the spiral from its centre has this length, by Newton's method."""
    theta = math.sqrt(2 * length / b) if length > 0 else 0.0
    for _ in range(50):
        step = (spiral_length(b, theta) - length) / (b * math.sqrt(1 + theta * theta))
        theta -= step
        if abs(step) < 1e-14 * (1 + theta):
            break
    return theta


def on_spiral(b, theta):
    """The place at an angle, and the direction in which the angle shrinks."""
    root = math.sqrt(1 + theta * theta)
    cos, sin = math.cos(theta), math.sin(theta)
    return (b * theta * cos, b * theta * sin), ((theta * sin - cos) / root, (-theta * cos - sin) / root)


def inward(s, pitch=0.55, theta=32 * math.pi):
    """The paper's spiral: the head is at s = 0 at t = 0."""
    b = pitch / (2 * math.pi)
    return on_spiral(b, spiral_theta(b, spiral_length(b, theta) - s))


def turnaround(ratio=2.0, exit_turn=-1):
    """The paper's turnaround. The entry arc has `ratio` times the radius of the exit arc; `exit_turn` 1 forgets the half turn."""
    b, radius = 1.7 / (2 * math.pi), 4.5
    theta = radius / b
    entry, heading = on_spiral(b, theta)
    # The sum of the radii from the chord -2·entry and the heading at both of its ends.
    chord = (-2 * entry[0], -2 * entry[1])
    along = chord[0] * heading[0] + chord[1] * heading[1]
    right = chord[0] * heading[1] - chord[1] * heading[0]
    angle = 2 * math.atan2(right, along)
    radii = along / math.sin(angle)
    small = radii / (1 + ratio)
    large = radii - small
    lengths = (large * angle, small * angle)

    def arc(start, direction, r, s, side):
        # side 1 turns right.
        turn = s / r
        normal = (direction[1] * side, -direction[0] * side)
        sin, cos = r * math.sin(turn), r * (1 - math.cos(turn))
        place = (start[0] + sin * direction[0] + cos * normal[0], start[1] + sin * direction[1] + cos * normal[1])
        tangent = tuple(math.cos(turn) * d + math.sin(turn) * n for d, n in zip(direction, normal))
        return place, tangent

    middle, across = arc(entry, heading, large, lengths[0], 1)

    def route(s):
        if s <= 0:
            return on_spiral(b, spiral_theta(b, spiral_length(b, theta) - s))
        if s <= lengths[0]:
            return arc(entry, heading, large, s, 1)
        s -= lengths[0]
        if s <= lengths[1]:
            return arc(middle, across, small, s, -1)
        place, inwards = on_spiral(b, spiral_theta(b, spiral_length(b, theta) + s - lengths[1]))
        return tuple(exit_turn * x for x in place), inwards

    return route


def chain(route, s, direction=-1):
    """Lengths of all handles: each is the nearest one along the route, behind the one before, at the length of the link."""
    lengths = [s]
    for link in LINKS:
        (x, y), _ = route(s)

        def gap(arc):
            to_x, to_y = route(s + direction * arc)[0]
            return math.hypot(to_x - x, to_y - y) - link

        arc = link * (1 - 1e-12)
        while gap(arc + link / 16) < 0:
            arc += link / 16
        s += direction * brentq(gap, arc, arc + link / 16, xtol=1e-14, rtol=1e-15)
        lengths.append(s)
    return lengths


def speeds(route, lengths):
    """Speeds of all handles for a head at 1 m/s: both ends of a link are equally fast along it."""
    ended = [route(s) for s in lengths]
    result = [1.0]
    for ((x, y), (u, v)), ((to_x, to_y), (to_u, to_v)) in zip(ended, ended[1:]):
        dx, dy = to_x - x, to_y - y
        result.append(result[-1] * (u * dx + v * dy) / (to_u * dx + to_v * dy))
    return result


def pose(route, time_s):
    lengths = chain(route, time_s)
    return [route(s)[0] for s in lengths], speeds(route, lengths)


def write_by_time(path, times, poses):
    """A table as result1.xlsx and result4.xlsx."""
    book = openpyxl.Workbook()
    positions, of_speeds = book.active, book.create_sheet("速度")
    positions.title = "位置"
    for sheet in (positions, of_speeds):
        sheet.append([None, *(f"{time} s" for time in times)])
    for handle, name in enumerate(NAMES):
        for axis, letter in enumerate("xy"):
            positions.append([f"{name}{letter} (m)", *(round(places[handle][axis], 6) for places, _ in poses)])
        of_speeds.append([f"{name} (m/s)", *(round(speed[handle], 6) for _, speed in poses)])
    book.save(path)


def write_at_end(path, pose):
    """A table as result2.xlsx."""
    book = openpyxl.Workbook()
    book.active.append([None, "横坐标x (m)", "纵坐标y (m)", "速度 (m/s)"])
    for name, (x, y), speed in zip(NAMES, *pose):
        book.active.append([name, round(x, 6), round(y, 6), round(speed, 6)])
    book.save(path)
