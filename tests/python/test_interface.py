"""The view's HTTP and WebSocket interface, compared with its description, docs/reference/openapi.yaml.

Each message must match its schema. A schema allows no further keys and requires all keys that are always there, so the comparison finds
keys that are missing on either side.

Run by the Rust tests of `view`, which run a server that is near its contact, and a monitor, and pass their instance.
"""

import contextlib
import json
import os
import pathlib
import socket

import jsonschema
import openapi_spec_validator
import pytest
import yaml
from view import TIMEOUT_S, next_frame, viewing
from websockets.exceptions import ConnectionClosedError
from websockets.sync.client import connect

PROGRAM = os.environ["BENCH_DRAGON"]
INSTANCE = os.environ["BENCH_DRAGON_INSTANCE"]
FILE = pathlib.Path(__file__).parents[2] / "docs/reference/openapi.yaml"
SPEC = yaml.safe_load(FILE.read_text())
JSON_PROTOCOL = "bench-dragon.json.v1"
TYPES = {"frame": "Frame", "run": "Run", "plan": "Plan", "alert": "Alert", "command": "CommandEvent", "status": "Status"}


def expect(name, message):
    """Compares a message with a schema of the description."""
    schema = {"$ref": f"#/components/schemas/{name}", "components": SPEC["components"]}
    jsonschema.validate(message, schema, cls=jsonschema.Draft202012Validator)


def schema_of(path, method, status):
    """The name of the schema of a documented reply. Fails if the status is not documented."""
    reply = SPEC["paths"][path][method]["responses"][str(status)]
    if "$ref" in reply:
        reply = SPEC["components"]["responses"][reply["$ref"].rpartition("/")[2]]
    return reply["content"]["application/json"]["schema"]["$ref"].rpartition("/")[2]


@pytest.fixture(scope="module")
def view():
    with viewing(PROGRAM, INSTANCE) as view:
        # The view has joined the bus when it has its first frame.
        with view.stream() as stream:
            next_frame(stream)
        yield view


@contextlib.contextmanager
def reading(view, protocols=(JSON_PROTOCOL,), **options):
    options = {"proxy": None, "max_size": None, "open_timeout": TIMEOUT_S, **options}
    with connect(f"ws://{view.address}/stream", subprotocols=protocols, **options) as stream:
        yield stream


def test_the_description_is_valid_and_served(view):
    openapi_spec_validator.validate(SPEC)
    status, text = view.request("/openapi.yaml")
    assert (status, text) == (200, FILE.read_text())


@pytest.mark.parametrize("path", ["/access", "/frame", "/status"])
def test_each_reply_matches_its_schema(view, path):
    status, text = view.request(path)
    assert status == 200
    expect(schema_of(path, "get", 200), json.loads(text))


def test_a_json_stream_has_every_message_as_described(view):
    seen = {}
    with reading(view) as stream:
        assert stream.subprotocol == JSON_PROTOCOL
        # Benches come near at 408.07 s, so the monitor reports them afterwards.
        assert json.loads(view.command({"command": "seek", "value": 407})[1])["accepted"]
        while seen.keys() != TYPES.keys():
            message = json.loads(stream.recv(timeout=TIMEOUT_S))
            expect(TYPES[message["type"]], message)
            expect("StreamMessage", message)
            seen.setdefault(message["type"], message)
    assert seen["alert"]["kind"] in ("near", "contact")
    assert len(seen["frame"]["positions_m"]) == seen["run"]["benches"] + 1


def test_a_reader_without_a_protocol_gets_json(view):
    with reading(view, protocols=None) as stream:
        assert stream.subprotocol is None
        assert isinstance(stream.recv(timeout=TIMEOUT_S), str)


def test_pongs_acknowledge_frames(view):
    sequences = []
    with reading(view) as stream:
        while len(sequences) < 20:
            message = json.loads(stream.recv(timeout=TIMEOUT_S))
            if message["type"] == "frame":
                sequences.append(message["sequence"])
    assert sequences == sorted(set(sequences))


def test_a_reader_that_answers_no_ping_gets_two_frames(view):
    address, _, port = view.address.rpartition(":")
    upgrade = (
        f"GET /stream HTTP/1.1\r\nHost: {view.address}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )
    with socket.create_connection((address, int(port)), timeout=TIMEOUT_S) as raw, raw.makefile("rb") as lines:
        raw.sendall(upgrade.encode())
        assert lines.readline().startswith(b"HTTP/1.1 101 ")
        while lines.readline() != b"\r\n":
            pass
        kinds = []
        # Statuses go on. Five of them take a second, in which the show has a hundred frames.
        while kinds.count("status") < 6:
            opcode, length = lines.read(1)[0] & 15, lines.read(1)[0]
            if length >= 126:
                length = int.from_bytes(lines.read(2 if length == 126 else 8), "big")
            payload = lines.read(length)
            kinds.append(json.loads(payload)["type"] if opcode == 1 else opcode)
    assert kinds.count("frame") == 2
    assert kinds.count(9) == 2


def test_both_forms_of_a_frame_have_the_same_values(view):
    status, text = view.command({"command": "pause"})
    assert status == 200 and json.loads(text)["accepted"], text
    expect("Reply", json.loads(text))
    with view.stream() as stream:
        binary, _ = next_frame(stream)
        while binary.state != 1:
            binary, _ = next_frame(stream)
        as_json = json.loads(view.request("/frame")[1])
        assert (as_json["state"], as_json["time_s"]) == ("paused", binary.show_time_s)
        assert (as_json["nearest"]["clearance_m"], *as_json["nearest"]["benches"]) == (binary.clearance_m, *binary.pair)
        for (x, y, _), speed, handle in zip(as_json["positions_m"], as_json["speeds_mps"], binary.handles, strict=True):
            assert (x, y, speed) == pytest.approx(handle, rel=1e-6, abs=2e-6)
    assert json.loads(view.command({"command": "resume"})[1])["accepted"]


@pytest.mark.parametrize(
    ("status", "body", "headers"),
    [
        (400, {"command": "dance"}, {}),
        (400, {"command": "hold", "value": 1}, {}),
        (401, {"command": "hold"}, {"Authorization": "Bearer nothing"}),
        (413, {"command": "x" * 2000}, {}),
        (415, {"command": "hold"}, {"Content-Type": "text/plain"}),
    ],
)
def test_a_refused_command_is_answered_as_described(view, status, body, headers):
    answered, text = view.command(body, **headers)
    assert answered == status, text
    expect(schema_of("/command", "post", status), json.loads(text))


def test_a_command_that_the_server_refuses_has_a_reason(view):
    status, text = view.command({"command": "seek", "value": 1e9})
    assert status == 200
    reply = json.loads(text)
    expect("Reply", reply)
    assert not reply["accepted"] and "1000000000" in reply["reason"].replace(" ", ""), reply


def test_a_stream_with_the_token_takes_commands(view):
    def ask(stream, text):
        stream.send(text)
        message = json.loads(stream.recv(timeout=TIMEOUT_S))
        while message["type"] != "reply":
            message = json.loads(stream.recv(timeout=TIMEOUT_S))
        expect("StreamReply", message)
        return message

    with reading(view, (JSON_PROTOCOL, f"bench-dragon.token.{view.token}")) as stream:
        for command in ("pause", "resume"):
            reply = ask(stream, json.dumps({"command": command}))
            assert (reply["action"], reply["accepted"], reply["reason"]) == (command, True, None)
            assert reply["tick"] > 0
        reply = ask(stream, '{"command":"speed","value":99}')
        assert (reply["action"], reply["accepted"]) == ("speed 99 m/s", False) and "from 0 to 10" in reply["reason"]
        reply = ask(stream, '{"command":"dance"}')
        assert (reply["action"], reply["tick"]) == (None, None) and "must be" in reply["reason"]


@pytest.mark.parametrize("text", ['{"command":"hold"}', "hold", '{"ack":4000000000}'])
def test_a_stream_without_the_token_that_sends_more_than_acknowledgements_is_closed(view, text):
    with reading(view) as stream, pytest.raises(ConnectionClosedError) as closed:
        stream.send(text)
        while True:
            stream.recv(timeout=TIMEOUT_S)
    assert closed.value.rcvd.code == 1008


def test_a_view_without_a_server_and_a_read_only_one_refuse_as_described():
    with viewing(PROGRAM, f"{INSTANCE}-nobody", "--read-only") as view:
        for path, method, body, status in [
            ("/frame", "get", None, 503),
            ("/command", "post", {"command": "hold"}, 403),
            ("/stream", "get", None, 426),
        ]:
            answered, text = view.request(path) if body is None else view.command(body)
            assert answered == status, (path, text)
            expect(schema_of(path, method, status), json.loads(text))
        expect("Status", json.loads(view.request("/status")[1]))
    with viewing(PROGRAM, f"{INSTANCE}-nobody") as view:
        answered, text = view.command({"command": "hold"})
        assert answered == 503, text
        expect(schema_of("/command", "post", 503), json.loads(text))


def test_each_described_path_has_the_described_method_alone(view):
    for path, methods in SPEC["paths"].items():
        for method in ("get", "post"):
            answered, text = view.request(path, "{}" if method == "post" else None)
            allowed = method in methods or path == "/stream"
            assert (answered != 405) == allowed and answered != 404, (path, method, answered)
            if answered == 405:
                expect("Refusal", json.loads(text))
    assert view.request("/dance")[0] == 404
    foreign = view.request("/status", **{"Host": "evil.example"})
    assert foreign[0] == 403
    expect("Refusal", json.loads(foreign[1]))


def test_stop_ends_the_server_and_needs_the_token(view):
    assert view.command({"command": "stop"}, Authorization="Bearer nothing")[0] == 401
    with reading(view) as stream:
        status, text = view.command({"command": "stop"})
        assert status == 200 and json.loads(text)["accepted"], text
        state = None
        while state != "ended":
            message = json.loads(stream.recv(timeout=TIMEOUT_S))
            state = message["link"]["state"] if message["type"] == "status" else state
            expect(TYPES[message["type"]], message)
