"""A port that reads a publish-subscribe service."""

from typing import Any

import iceoryx2 as iox2

from bench_dragon.errors import BusError, TooManyFramesHeld

MAX_BORROWED_FRAMES = 4
"""Greatest number of frames that a reader may hold at a time."""


class Subscriber:
    """iceoryx2's subscriber, with the errors of this package."""

    def __init__(self, service: str, port: Any) -> None:
        self._service = service
        self._port = port

    def receive(self) -> Any | None:
        """Returns the oldest unread sample, or `None` if all are read. The sample is held while a reference to it
        exists."""
        try:
            return self._port.receive()
        except iox2.ReceiveError as error:
            # Only frames can be held: all other values are copied at once.
            if str(error) == "ExceedsMaxBorrows":
                raise TooManyFramesHeld(MAX_BORROWED_FRAMES) from error
            raise BusError(f"{self._service}: {error}") from error

    def has_unread(self) -> bool:
        """Whether there is a sample to receive."""
        try:
            return bool(self._port.has_samples())
        except iox2.ConnectionFailure as error:
            raise BusError(f"{self._service}: {error}") from error
