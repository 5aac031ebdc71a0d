"""Prints the nanoseconds from the sending of each frame until its head was read: reader.py INSTANCE FRAMES"""

import sys
import time

from bench_dragon import Show

total, latencies_ns = 0.0, []
with Show(sys.argv[1], name="reader-python", timeout_s=60) as show:
    while len(latencies_ns) < int(sys.argv[2]):
        frame = show.wait(60)
        total += frame.position(0)[0]
        now_ns = time.monotonic_ns()
        latencies_ns.append(now_ns - frame.header.published_ns)
print(*latencies_ns, sep="\n")
sys.exit(int(total == 0.0))
