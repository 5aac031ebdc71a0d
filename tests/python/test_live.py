"""The stock iceoryx2 package reads a running server's bus with no code of the project except the layouts.

Run by the Rust test `python::the_stock_iceoryx2_package_reads_the_bus_live`, which runs a server and passes
its instance in the environment.
"""

import ctypes
import json
import os
import subprocess
import tomllib

import iceoryx2 as iox2
import pytest
from bench_dragon import FrameHeader, HandleState, Status
from bench_dragon.command import Command, CommandReply
from bus import SHOW_BYTES, frame_bytes

PROGRAM = os.environ["BENCH_DRAGON"]
INSTANCE = os.environ["BENCH_DRAGON_INSTANCE"]
PAUSE, RESUME, SPEED = 0, 1, 2
TIMEOUT_S = 100


def bench_dragon(*args):
    finished = subprocess.run([PROGRAM, *args, "--instance", INSTANCE], check=True, capture_output=True, text=True, timeout=TIMEOUT_S)
    return finished.stdout


@pytest.fixture(params=["the file as it is", "its values one by one"])
def node(request, tmp_path):
    text = bench_dragon("iox2-config")
    if request.param == "the file as it is":
        path = tmp_path / "iceoryx2.toml"
        path.write_text(text)
        config = iox2.config.from_file(iox2.FilePath.new(str(path)))
    else:
        printed = tomllib.loads(text)["global"]
        config = iox2.config.default()
        config.global_cfg.root_path = iox2.Path.new(printed["root-path"])
        config.global_cfg.prefix = iox2.FileName.new(printed["prefix"])
    return iox2.NodeBuilder.new().config(config).create(iox2.ServiceType.Ipc)


def service(node, name):
    return node.service_builder(iox2.ServiceName.new(name))


def open_frames(node):
    frames = service(node, "bench-dragon/frames").publish_subscribe(iox2.Slice[HandleState])
    return frames.user_header(FrameHeader).open()


def copied(sample):
    """Returns a frame as its header and its bytes. The number of handles is in the header, since the package's `len` counts bytes
    instead of elements."""
    header = FrameHeader.from_buffer_copy(sample.user_header().contents)
    size = (header.bench_count + 1) * ctypes.sizeof(HandleState)
    return header, bytes(header)[:SHOW_BYTES] + ctypes.string_at(sample.payload_ptr, size)


def frames_of(subscriber, listener):
    """Yields all frames in their order."""
    while True:
        sample = subscriber.receive()
        if sample is not None:
            yield copied(sample)
        else:
            listener.timed_wait(iox2.Duration.from_secs(1))


def joined(node):
    """Yields the frames from now on."""
    listener = service(node, "bench-dragon/frames").event().open().listener_builder().create()
    return frames_of(open_frames(node).subscriber_builder().create(), listener)


def test_every_frame_is_the_one_that_echo_prints(node):
    frames = joined(node)
    printed = [json.loads(line) for line in bench_dragon("echo", "--count", "10", "--format", "json").splitlines()]
    assert len(printed) == 10
    by_tick = {}
    while printed[-1]["tick"] not in by_tick:
        header, frame = next(frames)
        by_tick[header.tick] = frame
    for line in printed:
        handles = ((handle["position_m"], handle["velocity_mps"]) for handle in line["handles"])
        assert by_tick[line["tick"]] == frame_bytes(line | {"show_time_ns": line["sim_time_ns"]}, handles)


def test_the_ticks_count_on_and_each_advances_show_time_by_one_step(node):
    frames = joined(node)
    before, _ = next(frames)
    for _ in range(5):
        after, _ = next(frames)
        assert after.run_id == before.run_id and after.tick > before.tick
        # Two show seconds per second, also across missed periods.
        assert after.show_time_ns - before.show_time_ns == 2 * (after.scheduled_ns - before.scheduled_ns)
        before = after


def latest(subscriber):
    """Waits for the latest value, which a late reader gets with the server's next report."""
    while True:
        sample = subscriber.receive()
        if sample is not None:
            return sample


def test_the_description_is_the_configuration(node):
    description = service(node, "bench-dragon/description").publish_subscribe(iox2.Slice[ctypes.c_uint8])
    sample = latest(description.user_header(ctypes.c_uint64).open().subscriber_builder().create())
    payload = sample.payload()
    config = tomllib.loads(ctypes.string_at(payload.as_ptr(), payload.len()).decode())
    assert (config["dragon"]["benches"], config["serve"]["rate_hz"], config["serve"]["time_scale"]) == (223, 20, 2.0)
    assert sample.user_header().contents.value == next(joined(node))[0].run_id


def test_the_status_is_the_servers(node):
    status = service(node, "bench-dragon/status").publish_subscribe(Status).open()
    value = latest(status.subscriber_builder().create()).payload().contents
    assert (value.run_id, value.rate_hz, value.state) == (next(joined(node))[0].run_id, 20, 0)
    for histogram, median_ns, max_ns in (
        (value.lateness, value.lateness_p50_ns, value.lateness_max_ns),
        (value.tick_time, value.tick_p50_ns, value.tick_max_ns),
    ):
        assert median_ns <= max_ns == histogram.max_ns
        assert sum(histogram.counts) >= value.tick


def call(node, kind, value=0.0):
    commands = service(node, "bench-dragon/commands").request_response(Command, CommandReply).open()
    pending = commands.client_builder().create().send_copy(Command(kind, 0, 0, (ctypes.c_double * 2)(value)))
    while True:
        response = pending.receive()
        if response is not None:
            return CommandReply.from_buffer_copy(response.payload().contents)


def test_a_command_holds_from_the_tick_of_its_reply(node):
    frames = joined(node)
    for kind, state in ((PAUSE, 1), (RESUME, 0)):
        reply = call(node, kind)
        assert reply.refusal == 0
        headers = [next(frames)[0]]
        while headers[-1].tick < reply.tick:
            headers.append(next(frames)[0])
        assert (headers[-1].tick, headers[-1].state) == (reply.tick, state)
        assert headers[-1].run_id == reply.run_id


def test_a_refused_command_has_the_allowed_range(node):
    reply = call(node, SPEED, 11.0)
    assert (reply.refusal, reply.lowest, reply.highest) == (2, 0.0, 10.0)
