"""Continuity of frames: whether a frame directly follows the previous one."""

import enum


class Continuity(enum.Enum):
    """Relation of a frame to the previously received one."""

    FIRST = 0
    """The first frame that this reader has received."""
    NEXT = 1
    """The next tick of the same run."""
    LOST = 2
    """The same run, but frames between the two did not reach the reader."""
    RESTARTED = 3
    """Another run: the server was restarted. The number of frames lost from either run is unknown."""
