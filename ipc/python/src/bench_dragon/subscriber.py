"""A port that reads a publish-subscribe service."""

from typing import Any

import iceoryx2 as iox2

from bench_dragon.errors import BusError, TooManyFramesHeld

MAX_BORROWED_FRAMES = 4
"""Frames that a reader may hold on to at a time."""


class Subscriber:
    """iceoryx2's own subscriber, with the errors of this package."""

    def __init__(self, service: str, port: Any) -> None:
        self._service = service
        self._port = port

    def receive(self) -> Any | None:
        """The oldest sample that has not been read yet. It is held for as long as it is referred to."""
        try:
            return self._port.receive()
        except iox2.ReceiveError as error:
            # Only frames are ever held: all else is copied at once.
            if str(error) == "ExceedsMaxBorrows":
                raise TooManyFramesHeld(MAX_BORROWED_FRAMES) from error
            raise BusError(f"{self._service}: {error}") from error

    def has_unread(self) -> bool:
        """Whether there is a sample to receive."""
        try:
            return bool(self._port.has_samples())
        except iox2.ConnectionFailure as error:
            raise BusError(f"{self._service}: {error}") from error
