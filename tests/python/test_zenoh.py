"""The stock zenoh package reads a bridge with no code of the project except the layouts, and gets the frames of the bus.

Run by the Rust test `zenoh::independent`, which runs a server and two bridges, one with commands, and passes their
endpoints in the environment.
"""

import ctypes
import json
import os
import queue
import struct
import subprocess
import tomllib

import iceoryx2 as iox2
import pytest
import zenoh
from bench_dragon import FrameHeader, HandleState
from bench_dragon.command import Command, CommandReply
from bus import SHOW_BYTES

PROGRAM = os.environ["BENCH_DRAGON"]
INSTANCE = os.environ["BENCH_DRAGON_INSTANCE"]
ENDPOINT = os.environ["BENCH_DRAGON_ENDPOINT"]
SILENT_ENDPOINT = os.environ["BENCH_DRAGON_SILENT_ENDPOINT"]
KEY = os.environ["BENCH_DRAGON_KEY"]
PAUSE, SEEK = 0, 3
PAUSED = 1
FRAMES = 100
TIMEOUT_S = 100


def bench_dragon(*args):
    finished = subprocess.run([PROGRAM, *args, "--instance", INSTANCE], check=True, capture_output=True, text=True, timeout=TIMEOUT_S)
    return finished.stdout


def connected(endpoint):
    config = zenoh.Config()
    config.insert_json5("mode", '"peer"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("listen/endpoints", "[]")
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


@pytest.fixture
def session():
    with connected(ENDPOINT) as session:
        yield session


def bus_frames():
    """Yields the frames of the bus as ticks and bytes, without an end."""
    config = iox2.config.default()
    printed = tomllib.loads(bench_dragon("iox2-config"))["global"]
    config.global_cfg.root_path = iox2.Path.new(printed["root-path"])
    config.global_cfg.prefix = iox2.FileName.new(printed["prefix"])
    node = iox2.NodeBuilder.new().config(config).create(iox2.ServiceType.Ipc)
    name = iox2.ServiceName.new("bench-dragon/frames")
    frames = node.service_builder(name).publish_subscribe(iox2.Slice[HandleState]).user_header(FrameHeader).open()
    listener = node.service_builder(name).event().open().listener_builder().create()
    subscriber = frames.subscriber_builder().create()
    while True:
        sample = subscriber.receive()
        if sample is None:
            listener.timed_wait(iox2.Duration.from_secs(1))
            continue
        header = FrameHeader.from_buffer_copy(sample.user_header().contents)
        size = (header.bench_count + 1) * ctypes.sizeof(HandleState)
        yield header.tick, bytes(header)[:SHOW_BYTES] + ctypes.string_at(sample.payload_ptr, size)


def received(session, key):
    """Returns a queue of all messages under a key."""
    samples = queue.Queue()
    subscriber = session.declare_subscriber(f"{KEY}/{key}", samples.put)
    return subscriber, samples


def command(session, kind, value=0.0):
    payload = bytes(Command(kind=kind, values=(ctypes.c_double * 2)(value, 0.0)))
    replies = list(session.get(f"{KEY}/commands", payload=payload, timeout=TIMEOUT_S))
    return [CommandReply.from_buffer_copy(reply.ok.payload.to_bytes()) for reply in replies if reply.ok]


def test_every_frame_is_the_one_of_the_bus_bit_for_bit(session):
    subscriber, samples = received(session, "frames")
    first = samples.get(timeout=TIMEOUT_S)
    assert str(first.encoding) == "application/octet-stream;bench_dragon.Frame.v1"
    over_there, on_the_bus = {}, {}
    bus = bus_frames()
    begun, _ = next(bus)
    for tick, frame in bus:
        on_the_bus[tick] = frame
        if tick >= begun + FRAMES:
            break
    while begun + FRAMES not in over_there:
        payload = samples.get(timeout=TIMEOUT_S).payload.to_bytes()
        run_id, tick, *_, bench_count, state = struct.unpack_from("<QQqQQdddII", payload)
        assert len(payload) == 72 + 48 * (bench_count + 1)
        over_there[tick] = payload
    common = on_the_bus.keys() & over_there.keys()
    assert len(common) == FRAMES, "every frame has come"
    for tick in common:
        assert over_there[tick] == on_the_bus[tick], tick
    subscriber.undeclare()


def test_the_description_can_be_queried_and_names_its_run(session):
    (reply,) = session.get(f"{KEY}/description", timeout=TIMEOUT_S)
    assert str(reply.ok.encoding) == "text/toml"
    run_id, every, rate_hz = struct.unpack("<QQQ", reply.ok.attachment.to_bytes())
    subscriber, samples = received(session, "frames")
    assert struct.unpack_from("<Q", samples.get(timeout=TIMEOUT_S).payload.to_bytes())[0] == run_id
    assert (every, rate_hz) == (1, 50)
    assert "rate_hz = 50" in reply.ok.payload.to_string()
    subscriber.undeclare()


def test_a_token_shows_that_a_source_is_present(session):
    replies = list(session.liveliness().get(f"{KEY}/source", timeout=TIMEOUT_S))
    assert [str(reply.ok.key_expr) for reply in replies] == [f"{KEY}/source"]


def test_commands_are_accepted_where_they_are_allowed(session):
    (accepted,) = command(session, PAUSE)
    assert accepted.refusal == 0
    subscriber, samples = received(session, "frames")
    while True:
        _, tick, *_, state = struct.unpack_from("<QQqQQdddII", samples.get(timeout=TIMEOUT_S).payload.to_bytes())
        if tick >= accepted.tick:
            break
    assert state == PAUSED
    (refused,) = command(session, SEEK, float("nan"))
    assert (refused.refusal, refused.lowest) == (2, 0.0), "out of range"
    (reply,) = session.get(f"{KEY}/commands", payload=b"pause", timeout=TIMEOUT_S)
    assert reply.err.payload.to_string() == "the command is malformed, must have 40 bytes"
    subscriber.undeclare()


def test_commands_get_no_answer_where_they_are_not_allowed():
    with connected(SILENT_ENDPOINT) as session:
        assert command(session, PAUSE) == []
