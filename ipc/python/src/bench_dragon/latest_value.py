"""A service that keeps its latest value for late joiners."""

from collections.abc import Callable
from typing import Any, Generic, TypeVar

from bench_dragon.errors import NoServer
from bench_dragon.subscriber import Subscriber

Value = TypeVar("Value")


class LatestValue(Generic[Value]):
    """Reads such a service."""

    def __init__(self, instance: str, subscriber: Subscriber, copied: Callable[[Any], Value]) -> None:
        """Takes the instance's name, the port, and what makes a copy of its samples."""
        self._instance = instance
        self._subscriber = subscriber
        self._copied = copied
        self._latest: Value | None = None

    def read(self) -> Value:
        """The latest value, that of a server that has ended too. Never waits. Raises `NoServer` where none has come
        yet."""
        while (value := self._receive()) is not None:
            self._latest = value
        if self._latest is None:
            raise NoServer(self._instance)
        return self._latest

    def _receive(self) -> Value | None:
        # One sample may be held at a time: this one is let go of at the return.
        sample = self._subscriber.receive()
        return None if sample is None else self._copied(sample)
