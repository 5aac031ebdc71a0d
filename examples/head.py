"""Prints the head's front hinge and heading, frame by frame, until Ctrl-C: head.py [INSTANCE]"""

import contextlib
import sys

from bench_dragon import Dragon

with contextlib.suppress(KeyboardInterrupt), Dragon(*sys.argv[1:]) as dragon:
    for frame in dragon:
        x, y, _ = frame.positions[0]  # (N + 1, 3) metres, in shared memory
        heading = frame.benches.headings[0]  # (N,) radians
        print(f"{frame.header.sim_time_s:.3f} s: head at {x:.3f}, {y:.3f} m, {heading:.3f} rad", flush=True)
