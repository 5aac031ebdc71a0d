"""Repeats an attempt for values that no event announces."""

from collections.abc import Callable
from typing import TypeVar

from bench_dragon.deadline import Deadline
from bench_dragon.errors import NoServer

_LOOK_PERIOD_S = 0.02

Found = TypeVar("Found")


def look(deadline: Deadline, attempt: Callable[[], Found]) -> Found:
    """Calls `attempt` and returns its result. Repeats it while it raises `NoServer` and time is left.

    Raises the last `NoServer` at the deadline, and any other error at once.
    """
    while True:
        try:
            return attempt()
        except NoServer:
            if not deadline.left_s():
                raise
        deadline.sleep(_LOOK_PERIOD_S)
