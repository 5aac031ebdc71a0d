"""State of the server, as a reader sees it."""

import enum


class SourceState(enum.Enum):
    """Whether the server publishes, and if not, why."""

    PUBLISHING = "publishing"
    """A server runs, and the newest frame is recent."""
    HANGING = "hanging"
    """A server runs, but its newest frame is old: the process is suspended, stuck, or still starting."""
    ENDED = "ended"
    """The run has ended in order: the last frame that was read has the state `ShowState.ENDED`."""
    LOST = "lost"
    """No server runs, and the run has not ended in order: the process was killed or has failed."""
