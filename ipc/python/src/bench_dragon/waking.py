"""Waiting for what an event service tells of."""

from typing import Any

import iceoryx2 as iox2

from bench_dragon.deadline import Deadline
from bench_dragon.errors import BusError, NoServer
from bench_dragon.member import Member

# The socket behind a listener takes a timeout of 0 microseconds for no timeout at all.
_LEAST_WAIT_S = 1e-6
# A signal that comes just before the wait does not end it; Python looks at it after this time at the latest.
_LONGEST_WAIT_S = 0.1
# How often a server that is gone is looked for.
_LOOK_PERIOD_S = 0.02


class Waking:
    """Wakes a reader. There is a listener from the first wait on: it costs the sender a system call an event."""

    def __init__(self, member: Member, service: str) -> None:
        self._member = member
        self._service = service
        self._listener: Any = None

    def wait(self, deadline: Deadline) -> bool:
        """Waits until something may have come, with other threads running. False where the deadline had passed."""
        left_s = deadline.left_s()
        if left_s < _LEAST_WAIT_S:
            return False
        if self._listener is None:
            return self._listen(deadline)
        timeout = iox2.Duration.from_secs_f64(min(left_s, _LONGEST_WAIT_S))
        try:
            self._listener.timed_wait(timeout)
        except iox2.ListenerWaitError as error:
            if str(error) != "InterruptSignal":
                raise BusError(f"{self._service}: {error}") from error
        return True

    def _listen(self, deadline: Deadline) -> bool:
        """Makes the listener. What was sent before there was one wakes nobody, so the reader has to look again."""
        try:
            self._listener = self._member.listener(self._service)
            return True
        except NoServer:
            # The server is gone, and what it left is kept by readers that only poll: nobody would wake this one.
            pass
        return deadline.sleep(_LOOK_PERIOD_S)
