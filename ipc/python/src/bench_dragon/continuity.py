"""Whether a frame follows on the one before it."""

import enum


class Continuity(enum.Enum):
    """How a frame stands to the one received before it."""

    FIRST = enum.auto()
    """The first frame that this reader has received."""
    NEXT = enum.auto()
    """The next tick of the same run."""
    LOST = enum.auto()
    """The same run, but frames between the two never reached the reader."""
    RESTARTED = enum.auto()
    """Another run: the server was started again. What the reader lost of either run is not known."""


class ContinuityTracker:
    """Follows run and tick from frame to frame.

    >>> tracker = ContinuityTracker()
    >>> [tracker.track(run_id, tick)[1] for run_id, tick in [(7, 100), (7, 101), (7, 105), (8, 0)]]
    [0, 0, 3, 0]
    >>> tracker.lost
    3
    """

    def __init__(self) -> None:
        self._last: tuple[int, int] | None = None
        self.lost = 0
        """Frames lost since the first one, over all runs."""

    def track(self, run_id: int, tick: int) -> tuple[Continuity, int]:
        """Takes the next frame's run and tick, and says how it stands to the one before and how many were lost."""
        last, self._last = self._last, (run_id, tick)
        if last is None:
            return Continuity.FIRST, 0
        if last[0] != run_id:
            return Continuity.RESTARTED, 0
        lost = max(0, tick - last[1] - 1)
        self.lost += lost
        return (Continuity.LOST if lost else Continuity.NEXT), lost
