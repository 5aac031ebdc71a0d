"""Frames as their bytes in shared memory."""

import ctypes

from bench_dragon import FrameHeader, HandleState

SHOW_BYTES = FrameHeader.course_m.offset
"""Bytes of a header's fields that a frame of one dragon has in recordings and on the network."""
HEADER_FIELDS = [name for name, _ in FrameHeader._fields_ if getattr(FrameHeader, name).offset < SHOW_BYTES]


def frame_bytes(header, handles):
    """Returns the bytes of a frame of one dragon, from the header's values by name and pairs of position and velocity."""
    header = FrameHeader(*(header[name] for name in HEADER_FIELDS))
    vector = ctypes.c_double * 3
    states = (HandleState(vector(*position), vector(*velocity)) for position, velocity in handles)
    return bytes(header)[:SHOW_BYTES] + b"".join(map(bytes, states))
