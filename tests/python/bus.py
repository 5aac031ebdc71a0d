"""The layout of the bus as ctypes, and any frame as the bytes that it has in shared memory."""

import ctypes


class FrameHeader(ctypes.Structure):
    _fields_ = [
        ("run_id", ctypes.c_uint64),
        ("tick", ctypes.c_uint64),
        ("sim_time_ns", ctypes.c_int64),
        ("scheduled_ns", ctypes.c_uint64),
        ("published_ns", ctypes.c_uint64),
        ("head_travel_m", ctypes.c_double),
        ("head_speed_mps", ctypes.c_double),
        ("time_scale", ctypes.c_double),
        ("bench_count", ctypes.c_uint32),
        ("state", ctypes.c_uint32),
    ]

    @staticmethod
    def type_name():
        return "bench_dragon.FrameHeader.v1"


class HandleState(ctypes.Structure):
    _fields_ = [("position_m", ctypes.c_double * 3), ("velocity_mps", ctypes.c_double * 3)]

    @staticmethod
    def type_name():
        return "bench_dragon.HandleState.v1"


class Command(ctypes.Structure):
    _fields_ = [
        ("kind", ctypes.c_uint32),
        ("reserved", ctypes.c_uint32),
        ("run_id", ctypes.c_uint64),
        ("values", ctypes.c_double * 2),
    ]

    @staticmethod
    def type_name():
        return "bench_dragon.Command.v2"


class CommandReply(ctypes.Structure):
    _fields_ = [
        ("run_id", ctypes.c_uint64),
        ("tick", ctypes.c_uint64),
        ("lowest", ctypes.c_double),
        ("highest", ctypes.c_double),
        ("refusal", ctypes.c_uint32),
        ("reserved", ctypes.c_uint32),
    ]

    @staticmethod
    def type_name():
        return "bench_dragon.CommandReply.v1"


class TimeHistogram(ctypes.Structure):
    _fields_ = [("max_ns", ctypes.c_uint64), ("counts", ctypes.c_uint64 * 1024)]


class Status(ctypes.Structure):
    _fields_ = [
        ("run_id", ctypes.c_uint64),
        ("tick", ctypes.c_uint64),
        ("sim_time_ns", ctypes.c_int64),
        ("overruns", ctypes.c_uint64),
        ("lateness_p50_ns", ctypes.c_uint64),
        ("lateness_p99_ns", ctypes.c_uint64),
        ("lateness_p999_ns", ctypes.c_uint64),
        ("lateness_max_ns", ctypes.c_uint64),
        ("tick_p50_ns", ctypes.c_uint64),
        ("tick_p99_ns", ctypes.c_uint64),
        ("tick_p999_ns", ctypes.c_uint64),
        ("tick_max_ns", ctypes.c_uint64),
        ("granted_to_m", ctypes.c_double),
        ("asked_m", ctypes.c_double),
        ("rate_hz", ctypes.c_uint32),
        ("state", ctypes.c_uint32),
        ("pid", ctypes.c_uint32),
        ("reserved", ctypes.c_uint32),
        ("lateness", TimeHistogram),
        ("tick_time", TimeHistogram),
    ]

    @staticmethod
    def type_name():
        return "bench_dragon.Status.v2"


HEADER_FIELDS = [name for name, _ in FrameHeader._fields_]


def frame_bytes(header, handles):
    """A frame from the header's values by name and pairs of position and velocity."""
    header = FrameHeader(*(header[name] for name in HEADER_FIELDS))
    vector = ctypes.c_double * 3
    states = (HandleState(vector(*position), vector(*velocity)) for position, velocity in handles)
    return bytes(header) + b"".join(map(bytes, states))
