"""Two hundred pages at one view: prints how many the view has let in, and shows that a place that is left is free again."""

import contextlib
import json
import os
import socket
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

from view import next_frame, viewing
from websockets.exceptions import InvalidStatus, WebSocketException

PAGES = 200
FRAMES = 20
TIMEOUT_S = 100


def knock(view, pages):
    """Returns a stream, or the status with which the view refused it."""
    try:
        return pages.enter_context(view.stream())
    except InvalidStatus as refused:
        return refused.response.status_code
    except (WebSocketException, EOFError, OSError):
        return 0


class Crowd:
    """Pages that knock together and stay until all have knocked."""

    def __init__(self):
        self.outside = PAGES
        self.lock = threading.Lock()
        self.has_knocked = threading.Event()

    def visit(self, view, pages):
        """Returns a stream and the ticks of frames after all pages have knocked, or the status of a refusal."""
        try:
            page = knock(view, pages)
        finally:
            with self.lock:
                self.outside -= 1
                if self.outside == 0:
                    self.has_knocked.set()
        if isinstance(page, int):
            return page, []
        # The view closes a page that acknowledges nothing for 30 s, and the others may need longer to knock.
        while not self.has_knocked.is_set():
            next_frame(page)
        return page, [next_frame(page)[0].tick for _ in range(FRAMES)]


def main():
    program, instance = os.environ["BENCH_DRAGON"], os.environ["BENCH_DRAGON_INSTANCE"]
    with viewing(program, instance) as view, ThreadPoolExecutor(PAGES) as pool, contextlib.ExitStack() as pages:
        crowd = Crowd()
        visits = list(pool.map(lambda _: crowd.visit(view, pages), range(PAGES)))
        knocked = [page for page, _ in visits]
        streams = [page for page in knocked if not isinstance(page, int)]
        ticks = [ticks for page, ticks in visits if not isinstance(page, int)]
        for stream in streams:
            stream.close()
        address, _, port = view.address.rpartition(":")
        idle = [socket.create_connection((address, int(port))) for _ in range(PAGES)]
        for connection in idle:
            connection.close()
        deadline = time.monotonic() + TIMEOUT_S
        while isinstance(again := knock(view, pages), int):
            assert time.monotonic() < deadline, f"no place is free again after {TIMEOUT_S} s: {again}"
        next_frame(again)
    refused = {status: knocked.count(status) for status in {page for page in knocked if isinstance(page, int)}}
    print(json.dumps({"let_in": len(streams), "refused": refused, "in_order": all(rising(ticks) for ticks in ticks)}))


def rising(ticks):
    return all(before < after for before, after in zip(ticks, ticks[1:], strict=False))


if __name__ == "__main__":
    sys.exit(main())
