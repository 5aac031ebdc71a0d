"""How long something is waited for."""

import math
import time


class Deadline:
    """An instant in the future, or none."""

    def __init__(self, timeout_s: float | None) -> None:
        """`timeout_s` seconds from now; `None` for never. Raises `ValueError` for less than 0 and what is no number."""
        if timeout_s is not None and not timeout_s >= 0:
            raise ValueError(f"timeout_s is {timeout_s}, must be at least 0, or None for as long as it takes")
        self.timeout_s = math.inf if timeout_s is None else timeout_s
        """How far off it was when it was made, in seconds; infinite where there is none."""
        self._at_s = time.monotonic() + self.timeout_s

    def left_s(self) -> float:
        """Seconds until then; 0 where it has passed, infinite where there is none."""
        return max(0.0, self._at_s - time.monotonic())

    def sleep(self, period_s: float) -> bool:
        """Sleeps for a period, but not beyond. Whether there was any time left."""
        left_s = self.left_s()
        time.sleep(min(period_s, left_s))
        return left_s > 0
