"""Two hundred pages at one view: prints how many it has let in, and shows that a place that is left is free again."""

import contextlib
import json
import os
import socket
import sys
import time
from concurrent.futures import ThreadPoolExecutor

from view import next_frame, viewing
from websockets.exceptions import InvalidStatus, WebSocketException

PAGES = 200
FRAMES = 20
PATIENCE_S = 60


def knock(view, pages):
    """A stream, or the status that it was refused with."""
    try:
        return pages.enter_context(view.stream(open_timeout=60))
    except InvalidStatus as refused:
        return refused.response.status_code
    except (WebSocketException, EOFError, OSError):
        return 0


def main():
    program, instance = os.environ["BENCH_DRAGON"], os.environ["BENCH_DRAGON_INSTANCE"]
    with viewing(program, instance) as view, ThreadPoolExecutor(PAGES) as pool, contextlib.ExitStack() as pages:
        knocked = list(pool.map(lambda _: knock(view, pages), range(PAGES)))
        streams = [page for page in knocked if not isinstance(page, int)]
        ticks = list(pool.map(lambda stream: [next_frame(stream)[0].tick for _ in range(FRAMES)], streams))
        for stream in streams:
            stream.close()
        address, _, port = view.address.rpartition(":")
        idle = [socket.create_connection((address, int(port))) for _ in range(PAGES)]
        for connection in idle:
            connection.close()
        given_up = time.monotonic() + PATIENCE_S
        while isinstance(again := knock(view, pages), int):
            assert time.monotonic() < given_up, f"no place is free again after {PATIENCE_S} s: {again}"
        next_frame(again)
    refused = {status: knocked.count(status) for status in {page for page in knocked if isinstance(page, int)}}
    print(json.dumps({"let_in": len(streams), "refused": refused, "in_order": all(rising(ticks) for ticks in ticks)}))


def rising(ticks):
    return all(before < after for before, after in zip(ticks, ticks[1:], strict=False))


if __name__ == "__main__":
    sys.exit(main())
