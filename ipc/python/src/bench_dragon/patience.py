"""Looking again and again for what no event announces."""

from collections.abc import Callable
from typing import TypeVar

from bench_dragon.deadline import Deadline
from bench_dragon.errors import NoServer

_LOOK_PERIOD_S = 0.02

Found = TypeVar("Found")


def look(deadline: Deadline, attempt: Callable[[], Found]) -> Found:
    """What the attempt returns, made at least once, and again for as long as it raises `NoServer` and there is time.

    Raises the last `NoServer`, and at once whatever else the attempt raises.
    """
    while True:
        try:
            return attempt()
        except NoServer:
            if not deadline.left_s():
                raise
        deadline.sleep(_LOOK_PERIOD_S)
