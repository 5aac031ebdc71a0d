"""Reader of frames."""

import iceoryx2 as iox2

from bench_dragon.continuity import ContinuityTracker
from bench_dragon.deadline import Deadline
from bench_dragon.errors import VersionMismatch
from bench_dragon.frame import Frame, FrameHeader, HandleState, SharedMemory
from bench_dragon.member import FRAMES, Member
from bench_dragon.waking import Waking


class FrameSubscriber:
    """Reads the frames of an instance, oldest first."""

    def __init__(self, member: Member, tracker: ContinuityTracker) -> None:
        self._member = member
        self._tracker = tracker
        self._subscriber = member.subscriber(FRAMES, iox2.Slice[HandleState], FrameHeader)
        self._waking = Waking(member, FRAMES)

    def receive(self) -> Frame | None:
        """Returns the oldest unread frame, or `None` if all are read. Never waits."""
        sample = self._subscriber.receive()
        if sample is None:
            return None
        header = FrameHeader.copy_from(sample.user_header_ptr)
        handle_count = header.bench_count + 1
        # The header is used because the length of the package's slice counts bytes instead of elements.
        if sample.header.number_of_elements != handle_count:
            raise VersionMismatch(FRAMES)
        continuity, lost = self._tracker.track(header.run_id, header.tick)
        return Frame(header, SharedMemory(sample, self._member, handle_count), continuity, lost)

    def latest(self) -> Frame | None:
        """Returns the newest unread frame, or `None` if all are read. Never waits."""
        frame = self.receive()
        while frame is not None and self._subscriber.has_unread():
            # Released before the next frame is received.
            frame = None
            frame = self.receive()
        return frame

    def wait(self, deadline: Deadline) -> Frame | None:
        """Returns the oldest unread frame, and waits for one until the deadline; else `None`."""
        frame = self.receive()
        while frame is None and self._waking.wait(deadline):
            frame = self.receive()
        return frame
