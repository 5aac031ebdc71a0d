"""Continuity of frames: whether a frame directly follows the previous one."""

import enum


class Continuity(enum.Enum):
    """Relation of a frame to the previously received one."""

    FIRST = enum.auto()
    """The first frame that this reader has received."""
    NEXT = enum.auto()
    """The next tick of the same run."""
    LOST = enum.auto()
    """The same run, but frames between the two did not reach the reader."""
    RESTARTED = enum.auto()
    """Another run: the server was restarted. The number of frames lost from either run is unknown."""


class ContinuityTracker:
    """Tracks run and tick from frame to frame.

    >>> tracker = ContinuityTracker()
    >>> [tracker.track(run_id, tick)[1] for run_id, tick in [(7, 100), (7, 101), (7, 105), (8, 0)]]
    [0, 0, 3, 0]
    >>> tracker.lost
    3
    """

    def __init__(self) -> None:
        self._last: tuple[int, int] | None = None
        self.lost = 0
        """Number of frames lost since the first one, over all runs."""

    def track(self, run_id: int, tick: int) -> tuple[Continuity, int]:
        """Takes the next frame's run and tick. Returns its relation to the previous frame and the number of frames lost
        between them."""
        last, self._last = self._last, (run_id, tick)
        if last is None:
            return Continuity.FIRST, 0
        if last[0] != run_id:
            return Continuity.RESTARTED, 0
        lost = max(0, tick - last[1] - 1)
        self.lost += lost
        return (Continuity.LOST if lost else Continuity.NEXT), lost
