"""Deadlines of waiting calls."""

import math
import time


class Deadline:
    """The instant at which a wait ends, or no limit."""

    def __init__(self, timeout_s: float | None) -> None:
        """Sets the deadline `timeout_s` seconds from now; `None` for no limit.

        Raises `ValueError` if `timeout_s` is negative or NaN.
        """
        if timeout_s is not None and not timeout_s >= 0:
            raise ValueError(f"timeout_s is {timeout_s}, must be at least 0, or None for no limit")
        self.timeout_s = math.inf if timeout_s is None else timeout_s
        """Timeout in seconds at the creation; infinite for no limit."""
        self._at_s = time.monotonic() + self.timeout_s

    def left_s(self) -> float:
        """Returns the seconds until the deadline: 0 after it, infinite for no limit."""
        return max(0.0, self._at_s - time.monotonic())

    def sleep(self, period_s: float) -> bool:
        """Sleeps for a period, but not beyond the deadline. Returns whether any time was left before the sleep."""
        left_s = self.left_s()
        time.sleep(min(period_s, left_s))
        return left_s > 0
