"""Reader of a service that keeps its latest value for late joiners."""

from collections.abc import Callable
from typing import Any, Generic, TypeVar

from bench_dragon.errors import NoServer
from bench_dragon.subscriber import Subscriber

Value = TypeVar("Value")


class LatestValue(Generic[Value]):
    """Reads the latest value of such a service."""

    def __init__(self, instance: str, subscriber: Subscriber, copied: Callable[[Any], Value]) -> None:
        """`copied` returns a copy of a sample's value."""
        self._instance = instance
        self._subscriber = subscriber
        self._copied = copied
        self._latest: Value | None = None

    def read(self) -> Value:
        """Returns the latest value, also from a server that has ended. Never waits. Raises `NoServer` if no value has
        arrived yet."""
        while (value := self._receive()) is not None:
            self._latest = value
        if self._latest is None:
            raise NoServer(self._instance)
        return self._latest

    def _receive(self) -> Value | None:
        # Only one sample may be held at a time: this one is released at the return.
        sample = self._subscriber.receive()
        return None if sample is None else self._copied(sample)
