"""Prints position and speed of the dragon's head, frame by frame, until Ctrl-C: head.py [INSTANCE]."""

import contextlib
import sys

from bench_dragon import Dragon

with contextlib.suppress(KeyboardInterrupt), Dragon(*sys.argv[1:]) as dragon:
    for frame in dragon:
        (x, y, _), speed = frame.positions[0], frame.header.head_speed_mps
        print(f"{frame.header.sim_time_s:.3f} s: head at {x:.3f}, {y:.3f} m, {speed:.3f} m/s", flush=True)
