"""A service that keeps its latest value for late joiners."""

from collections.abc import Callable
from typing import Any, Generic, TypeVar

from bench_dragon.deadline import Deadline
from bench_dragon.subscriber import Subscriber

# The server tells late joiners ten times a second.
_LOOK_PERIOD_S = 0.01

Value = TypeVar("Value")


class LatestValue(Generic[Value]):
    """Reads such a service."""

    def __init__(self, subscriber: Subscriber, copied: Callable[[Any], Value]) -> None:
        """Takes the port, and what makes a copy of its samples."""
        self._subscriber = subscriber
        self._copied = copied

    def poll(self) -> Value | None:
        """The newest value that has not been read yet. Never waits."""
        newest = None
        while (value := self._receive()) is not None:
            newest = value
        return newest

    def wait(self, deadline: Deadline) -> Value | None:
        """The same, waiting for it."""
        value = self.poll()
        while value is None and deadline.sleep(_LOOK_PERIOD_S):
            value = self.poll()
        return value

    def _receive(self) -> Value | None:
        # One sample may be held at a time: this one is let go of at the return.
        sample = self._subscriber.receive()
        return None if sample is None else self._copied(sample)
