"""The view's server: its answers to viewers, to operators, and to requests without rights.

Run by the Rust tests of `view`, which run a server and pass its instance in the environment.
"""

import contextlib
import json
import math
import os
import socket
import time

import numpy
import pytest
from bench_dragon import Show, ShowState
from view import TIMEOUT_S, next_frame, viewing
from websockets.exceptions import ConnectionClosed

PROGRAM = os.environ["BENCH_DRAGON"]
INSTANCE = os.environ["BENCH_DRAGON_INSTANCE"]
PAUSE = {"command": "pause"}


@pytest.fixture(scope="module")
def view():
    with viewing(PROGRAM, INSTANCE) as view:
        yield view


def newest(is_wanted=lambda header: True):
    """Returns copies of the header and the handles' positions of the first wanted frame on the bus."""
    with Show(INSTANCE) as show:
        for frame in show:
            if is_wanted(frame.header):
                return frame.header, frame.positions.copy()


def state():
    header, _ = newest()
    return header.show_state


def command(view, body):
    status, text = view.command(body)
    assert status == 200, text
    return json.loads(text)


def test_a_page_gets_the_run_and_the_frames_of_the_bus(view):
    assert command(view, PAUSE)["accepted"]
    on_bus, positions_m = newest(lambda header: header.show_state == ShowState.PAUSED)
    with view.stream() as stream:
        assert stream.subprotocol == "bench-dragon.view.v1"
        frame, told = next_frame(stream)
        # The description of a run may come after its first frames.
        while frame.tick < on_bus.tick or not any(message["type"] == "run" for message in told):
            frame, more = next_frame(stream)
            told += more
    assert (frame.benches, frame.state) == (223, ShowState.PAUSED)
    assert frame.show_time_s == pytest.approx(on_bus.show_time_s, abs=1e-9)
    assert numpy.array_equal(numpy.float32(positions_m[:, :2]), numpy.float32([handle[:2] for handle in frame.handles]))
    assert all(speed == 0 for _, _, speed in frame.handles)
    run = next(message for message in told if message["type"] == "run")
    assert (run["benches"], run["run_id"], run["head_length_m"]) == (223, on_bus.run_id, 3.41)
    route = numpy.array(run["route"]).reshape(-1, 2)
    steps = numpy.hypot(*numpy.diff(route, axis=0).T)
    assert steps.max() < 0.5, "the route is a line"
    assert frame.clearance_m > 0 and 0 <= frame.pair[0] < frame.pair[1] - 1 < 222
    assert command(view, {"command": "resume"})["accepted"]


def is_whole(status):
    return status["traffic"]["rate_hz"] > 0 and status["server"] is not None and status["chart"] is not None


def test_a_page_gets_the_status(view):
    with view.stream() as stream:
        statuses = []
        while len(statuses) < 10 or not is_whole(statuses[-1]):
            _, told = next_frame(stream)
            statuses += [message for message in told if message["type"] == "status"]
    last = statuses[-1]
    assert last["link"] == {"state": "live", "age_s": None, "reason": None}
    assert last["traffic"]["latency_us"]["p50"] > 0 and last["server"]["rate_hz"] > 0
    assert last["outlook"]["kind"] in ("contact", "free", "unknown")
    assert last["chart"]["bins"] == 480
    binned = dict(bin for status in statuses if status["chart"] for bin in status["chart"]["changed"])
    assert binned and all(0 <= bin < 480 and math.isfinite(least) for bin, least in binned.items())
    assert last["least"]["clearance_m"] == min(binned.values())


def test_a_page_learns_when_its_acknowledgements_arrived(view):
    with view.stream() as stream:
        acknowledged, told = set(), []
        while not any(message["type"] == "status" and message["heard"] for message in told):
            frame, told = next_frame(stream)
            acknowledged.add(frame.sequence)
    status = next(message for message in told if message["type"] == "status" and message["heard"])
    assert status["heard"]["sequence"] in acknowledged
    assert 0 < status["heard"]["at_ms"] <= time.monotonic() * 1e3
    assert 0 <= status["day_ms"] < 86_400_000


def test_commands_have_the_machine_of_their_page(view):
    # A seek to a time that no other test uses.
    refused = command(view, {"command": "seek", "value": 123456.5})
    assert not refused["accepted"]
    with view.stream() as stream:
        told = []
        while not any(message["type"] == "command" and "123456.5" in message["action"] for message in told):
            _, told = next_frame(stream)
    sought = next(message for message in told if message["type"] == "command" and "123456.5" in message["action"])
    assert (sought["sender"], sought["accepted"]) == ("page@localhost", False)


def test_a_page_that_acknowledges_nothing_gets_two_frames_and_then_the_newest(view):
    with view.stream() as stream:
        first, _ = next_frame(stream, acknowledge=False)
        second, _ = next_frame(stream, acknowledge=False)
        assert second.tick > first.tick
        for _ in range(5):
            assert isinstance(stream.recv(timeout=TIMEOUT_S), str), "a third frame came, although none was acknowledged"
        stream.send(json.dumps({"ack": second.sequence}))
        third, _ = next_frame(stream)
        assert third.sequence > second.sequence + 1, "the frames in between were kept"


@pytest.mark.parametrize(
    "message",
    ["", "{}", "null", '{"ack":-1}', '{"ack":1.5}', '{"ack":4000000000}', '{"command":"stop"}', b"\x00", b"", "x" * 300, b"\x00" * 300, "[" * 200],
)
def test_a_page_that_sends_anything_else_is_disconnected(view, message):
    with view.stream() as stream:
        stream.send(message)
        with pytest.raises(ConnectionClosed) as closed:
            while True:
                stream.recv(timeout=TIMEOUT_S)
        assert closed.value.rcvd.code == 1008
    assert view.stream_status() == 101, "the next page is refused"


def test_a_command_needs_the_token(view):
    for headers in ({"Authorization": ""}, {"Authorization": "Bearer " + "0" * 32}, {"Authorization": f"Basic {view.token}"}):
        status, text = view.command(PAUSE, **headers)
        assert status == 401 and list(json.loads(text)) == ["error"], text
    assert view.request("/command?token=" + view.token, json.dumps(PAUSE), Content_Type="application/json")[0] == 401
    assert state() == ShowState.RUNNING


def test_pages_of_another_origin_are_refused_everything(view):
    here = view.address
    for foreign in (
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:1"},
        {"Origin": f"http://{here}.evil.example"},
        {"Host": "evil.example"},
        {"Host": f"evil.example:{here.partition(':')[2]}"},
        {"Sec-Fetch-Site": "cross-site"},
    ):
        for path in ("/", "/access", "/stream", "/metrics", "/nothing"):
            assert view.request(path, **foreign)[0] == 403, (path, foreign)
        assert view.command(PAUSE, **foreign)[0] == 403, foreign
    for origin in ("http://evil.example", "null", f"https://{here}.evil.example"):
        assert view.stream_status(origin=origin) == 403
    assert view.stream_status(additional_headers={"Sec-Fetch-Site": "cross-site"}) == 403
    assert view.stream_status(origin=f"http://{here}") == 101
    assert state() == ShowState.RUNNING


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ("", 400),
        ("pause", 400),
        ('{"command":"stop","value":1}', 400),
        ('{"command":"speed"}', 400),
        ('{"command":"speed","value":"fast"}', 400),
        ('{"command":"seek","value":1e999}', 400),
        (b"\xff\xfe", 400),
        ('{"command":"pause"}' + " " * 2000, 413),
    ],
)
def test_a_body_that_is_no_command_is_refused_in_one_line(view, body, status):
    refused, text = view.command(body)
    assert refused == status, text
    assert text.count("\n") == 1 and json.loads(text)["error"]
    assert state() == ShowState.RUNNING


def test_a_command_that_a_form_could_send_is_refused(view):
    assert view.command(PAUSE, **{"Content-Type": "application/json; charset=utf-8"})[0] == 200
    assert command(view, {"command": "resume"})["accepted"]
    for media_type in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data"):
        assert view.command(PAUSE, **{"Content-Type": media_type})[0] == 415


def begun_command(view, *headers):
    """Opens a connection and sends a command without its body."""
    address, _, port = view.address.rpartition(":")
    connection = socket.create_connection((address, int(port)))
    lines = ["POST /command HTTP/1.1", f"Host: {view.address}", "Content-Type: application/json", "Content-Length: 900", *headers]
    connection.sendall("\r\n".join([*lines, "", ""]).encode())
    return connection


def status_line(connection):
    with connection.makefile("rb") as reply:
        return reply.readline().split()[1]


def test_incomplete_requests_block_no_other_client(view):
    strangers = [begun_command(view) for _ in range(140)]
    answered = [status_line(connection) for connection in strangers[:100]]
    assert answered == [b"401"] * 100, "a request without the token is read"
    for connection in strangers:
        connection.close()
    assert command(view, {"command": "speed", "value": 1.0})["accepted"]
    with begun_command(view, f"Authorization: Bearer {view.token}") as slow:
        assert status_line(slow) == b"408"


def test_the_servers_refusals_reach_the_page(view):
    assert command(view, {"command": "release"}) == {"accepted": False, "tick": pytest.approx(0, abs=1e9), "reason": "the show is not held"}
    reply = command(view, {"command": "speed", "value": 11})
    assert (reply["accepted"], reply["reason"]) == (False, "the speed is 11 m/s, must be from 0 to 10 m/s")


def test_a_hold_stands_until_it_is_released(view):
    assert command(view, {"command": "hold"})["accepted"]
    assert newest(lambda header: header.show_state != ShowState.RUNNING)[0].show_state == ShowState.HELD
    assert not command(view, {"command": "resume"})["accepted"]
    assert command(view, {"command": "release"})["accepted"]
    assert newest(lambda header: header.show_state != ShowState.HELD)[0].show_state == ShowState.RUNNING


def test_a_read_only_view_takes_no_command():
    with viewing(PROGRAM, INSTANCE, "--read-only") as view:
        assert view.token == "", "a read-only view has no token"
        assert view.command(PAUSE)[0] == 403
        assert json.loads(view.request("/access")[1])["read_only"]
        assert view.stream_status() == 101
    assert state() == ShowState.RUNNING


def test_the_token_of_the_environment_is_used(monkeypatch):
    monkeypatch.setenv("BENCH_DRAGON_TOKEN", "known-to-the-booth")
    with viewing(PROGRAM, INSTANCE) as view:
        assert view.token == "known-to-the-booth"
        assert json.loads(view.request("/access", Authorization="Bearer known-to-the-booth")[1])["may_control"]


def test_a_view_closes_its_streams_at_its_end():
    with contextlib.ExitStack() as pages:
        with viewing(PROGRAM, INSTANCE) as view:
            stream = pages.enter_context(view.stream())
            next_frame(stream)
        with pytest.raises(ConnectionClosed) as closed:
            while True:
                stream.recv(timeout=TIMEOUT_S)
    assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (1001, "the view has ended")


def test_a_page_with_the_token_takes_the_place_of_one_without():
    with viewing(PROGRAM, INSTANCE) as view, contextlib.ExitStack() as crowd:
        streams = [crowd.enter_context(view.stream()) for _ in range(32)]
        assert view.stream_status() == 503
        token = {"Authorization": f"Bearer {view.token}"}
        access = [json.loads(view.request("/access", **headers)[1]) for headers in ({}, token)]
        assert [report["is_full"] for report in access] == [True, False]
        assert [report["viewers"] for report in access] == [32, 32]
        protocol = f"bench-dragon.token.{view.token}"
        operators = [crowd.enter_context(view.stream(protocol)) for _ in range(2)]
        for stream in streams[:2]:
            with pytest.raises(ConnectionClosed) as closed:
                while True:
                    next_frame(stream)
            assert closed.value.rcvd.code == 1013
            assert closed.value.rcvd.reason == "a page with the token has taken this place"
        for stream in [*operators, *streams[2:]]:
            next_frame(stream)
        assert view.stream_status() == 503


def test_unknown_paths_and_methods_are_refused(view):
    assert view.request("/nothing")[0] == 404
    assert view.request("/../Cargo.toml")[0] == 404
    assert view.request("/stream")[0] == 426
    assert view.request("/command")[0] == 405
