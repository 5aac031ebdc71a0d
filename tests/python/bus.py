"""Frames as their bytes in shared memory."""

import ctypes

from bench_dragon import FrameHeader, HandleState

HEADER_FIELDS = [name for name, _ in FrameHeader._fields_]


def frame_bytes(header, handles):
    """Returns the bytes of a frame, from the header's values by name and pairs of position and velocity."""
    header = FrameHeader(*(header[name] for name in HEADER_FIELDS))
    vector = ctypes.c_double * 3
    states = (HandleState(vector(*position), vector(*velocity)) for position, velocity in handles)
    return bytes(header) + b"".join(map(bytes, states))
