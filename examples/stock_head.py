"""Prints the head's front hinge, frame by frame, with the stock package iceoryx2: stock_head.py CONFIGURATION"""

import contextlib
import signal
import sys
import time
import tomllib
from ctypes import Structure, c_double, c_int64, c_uint32, c_uint64
from pathlib import Path

import iceoryx2 as iox2


class HandleState(Structure):
    type_name = staticmethod(lambda: "bench_dragon.HandleState.v1")
    _fields_ = [("position_m", c_double * 3), ("velocity_mps", c_double * 3)]


class FrameHeader(Structure):
    type_name = staticmethod(lambda: "bench_dragon.FrameHeader.v2")
    _fields_ = [("run_id", c_uint64), ("tick", c_uint64), ("show_time_ns", c_int64), ("due_and_sent_ns", c_uint64 * 2)]
    _fields_ += [("travel_speed_scale", c_double * 3), ("bench_count", c_uint32), ("state", c_uint32), ("dragons", c_uint64 * 131)]


for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, lambda *_: sys.exit())
services = Path(tomllib.loads(Path(sys.argv[1]).read_text())["global"]["root-path"]) / "services"
if not services.is_dir():
    print("waiting: no server runs, start one with `bench-dragon serve`", file=sys.stderr, flush=True)
while not any(services.glob("*.service")):
    time.sleep(0.1)
config = iox2.config.from_file(iox2.FilePath.new(sys.argv[1]))
node = iox2.NodeBuilder.new().config(config).create(iox2.ServiceType.Ipc)
reader, state = None, 0
while reader is None:
    time.sleep(0.1)
    frames = node.service_builder(iox2.ServiceName.new("bench-dragon/frames")).publish_subscribe(iox2.Slice[HandleState])
    with contextlib.suppress(iox2.PublishSubscribeOpenError):  # the server is still creating it
        reader = frames.user_header(FrameHeader).open().subscriber_builder().create()
while state != 5:  # ended
    time.sleep(0.001)
    while (frame := reader.receive()) is not None:
        header, head = frame.user_header().contents, HandleState.from_address(frame.payload_ptr)
        state = header.state
        print(f"{header.show_time_ns / 1e9:.3f} s: head at", *head.position_m, flush=True)
