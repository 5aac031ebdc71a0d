"""Open ports of a dragon. Each port, except the frames, is opened at its first use."""

import ctypes
from functools import cached_property
from typing import Any

import iceoryx2 as iox2

from bench_dragon.alert import AlertReader
from bench_dragon.command import CommandClient
from bench_dragon.continuity import ContinuityTracker
from bench_dragon.description import Description
from bench_dragon.errors import VersionMismatch
from bench_dragon.frame_subscriber import FrameSubscriber
from bench_dragon.latest_value import LatestValue
from bench_dragon.member import DESCRIPTION, STATUS, Member
from bench_dragon.status import Status


class Ports:
    """The ports of one member of a domain."""

    def __init__(self, member: Member, tracker: ContinuityTracker) -> None:
        self.member = member
        self.frames = FrameSubscriber(member, tracker)

    @cached_property
    def descriptions(self) -> LatestValue[Description]:
        """Reader of the configuration."""
        subscriber = self.member.subscriber(DESCRIPTION, iox2.Slice[ctypes.c_uint8], ctypes.c_uint64)
        return LatestValue(self.member.instance, subscriber, _described)

    @cached_property
    def statuses(self) -> LatestValue[Status]:
        """Reader of the server's status."""
        subscriber = self.member.subscriber(STATUS, Status)
        return LatestValue(self.member.instance, subscriber, lambda sample: Status.copy_from(sample.payload_ptr))

    @cached_property
    def alerts(self) -> AlertReader:
        """Reader of the monitors' alerts."""
        return AlertReader(self.member)

    @cached_property
    def commands(self) -> CommandClient:
        """Sender of commands to the server."""
        return CommandClient(self.member)


def _described(sample: Any) -> Description:
    text = ctypes.string_at(sample.payload_ptr, sample.header.number_of_elements)
    try:
        return Description(ctypes.c_uint64.from_address(sample.user_header_ptr).value, text.decode())
    except UnicodeDecodeError as error:
        raise VersionMismatch(DESCRIPTION) from error
