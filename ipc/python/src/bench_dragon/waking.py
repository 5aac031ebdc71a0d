"""Waits for the wake-ups of an event service."""

from typing import Any

import iceoryx2 as iox2

from bench_dragon.deadline import Deadline
from bench_dragon.errors import BusError, NoServer
from bench_dragon.member import Member

# The socket behind a listener treats a timeout of 0 microseconds as no timeout.
_LEAST_WAIT_S = 1e-6
# A signal that arrives just before the wait does not end it. Python handles it after this time at the latest.
_LONGEST_WAIT_S = 0.1
# Period in which a reader looks for a server while none runs.
_LOOK_PERIOD_S = 0.02


class Waking:
    """Wakes a reader. The listener exists from the first wait on, and costs the sender one system call per event."""

    def __init__(self, member: Member, service: str) -> None:
        self._member = member
        self._service = service
        self._listener: Any = None

    def wait(self, deadline: Deadline) -> bool:
        """Waits until new samples may have arrived or the deadline is reached. Other threads run during the wait.
        Returns `False` if the deadline had already passed."""
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
        """Creates the listener. Events before its creation do not wake it, so the reader has to check for samples
        again."""
        try:
            self._listener = self._member.listener(self._service)
            return True
        except NoServer:
            # The server is gone, and readers that only poll keep its services. Nothing would wake this reader.
            pass
        return deadline.sleep(_LOOK_PERIOD_S)
