"""Prints the head's front hinge and the centre of its board, frame by frame, until the run ends: head.py [INSTANCE]"""

import contextlib
import sys

from bench_dragon import Show, ShowState

with contextlib.suppress(KeyboardInterrupt), Show(*sys.argv[1:]) as show:
    for frame in show.frames(timeout_s=5):  # raises NoServer after five seconds without a frame
        x, y, _ = frame.positions[0]  # (N + 1, 3) metres, in shared memory
        cx, cy, _ = frame.benches.centres[0]  # (N, 3) metres
        time_s, state = frame.header.show_time_s, frame.header.show_state
        print(f"{time_s:.3f} s: front hinge {x:.3f}, {y:.3f} m, centre of the board {cx:.3f}, {cy:.3f} m", flush=True)
        if state is ShowState.ENDED:
            break
