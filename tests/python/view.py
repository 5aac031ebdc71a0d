"""A `bench-dragon view` and its replies, read by the stock packages `websockets` and `urllib`."""

import contextlib
import json
import struct
import subprocess
import urllib.error
import urllib.request
from dataclasses import dataclass

from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

PROTOCOL = "bench-dragon.view.v1"
HEADER = struct.Struct("<4I7d2I3d")
# Longest wait of a client, in seconds.
TIMEOUT_S = 100


@dataclass
class View:
    """A running view."""

    address: str
    token: str

    def request(self, path, body=None, **headers):
        """Returns status and text of a reply."""
        headers = {name.replace("_", "-"): value for name, value in headers.items()}
        data = body.encode() if isinstance(body, str) else body
        request = urllib.request.Request(f"http://{self.address}{path}", data=data, headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=TIMEOUT_S) as reply:
                return reply.status, reply.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, error.read().decode()

    def command(self, body, **headers):
        """Sends a valid command, except for the given headers. Returns status and text of the reply."""
        headers = {"Authorization": f"Bearer {self.token}", "Content-Type": "application/json", **headers}
        return self.request("/command", body if isinstance(body, (str, bytes)) else json.dumps(body), **headers)

    def stream(self, *protocols, **options):
        """Opens a stream as a page does."""
        options = {"proxy": None, "max_size": None, "open_timeout": TIMEOUT_S, **options}
        return connect(f"ws://{self.address}/stream", subprotocols=[PROTOCOL, *protocols], **options)

    def stream_status(self, *protocols, **options):
        """Returns the status with which a stream is refused, or 101."""
        try:
            with self.stream(*protocols, **options):
                return 101
        except InvalidStatus as refused:
            return refused.response.status_code


@dataclass
class Frame:
    """A frame, as a page gets it."""

    sequence: int
    benches: int
    state: int
    tick: int
    show_time_s: float
    clearance_m: float
    pair: tuple
    handles: list

    @classmethod
    def of(cls, message):
        kind, sequence, benches, state, _, tick, show_time_s, _, _, _, clearance_m, a, b, _, _, _ = HEADER.unpack_from(message)
        assert kind == 1
        handles = list(struct.iter_unpack("<3f", message[HEADER.size :]))
        assert len(handles) == benches + 1
        return cls(sequence, benches, state, int(tick), show_time_s, clearance_m, (a, b), handles)


def next_frame(stream, acknowledge=True):
    """Returns the next frame of a stream, and the messages before it."""
    told = []
    while True:
        message = stream.recv(timeout=TIMEOUT_S)
        if isinstance(message, bytes):
            frame = Frame.of(message)
            if acknowledge:
                stream.send(json.dumps({"ack": frame.sequence}))
            return frame, told
        told.append(json.loads(message))


@contextlib.contextmanager
def viewing(program, instance, *args, listen="127.0.0.1:0", stderr=None):
    """Runs a view."""
    command = [program, "view", "--format", "json", "--listen", listen, "--instance", instance, *args]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=stderr, text=True) as process:
        try:
            listening = json.loads(process.stdout.readline())
            yield View(listening["address"], listening["url"].partition("#token=")[2])
        finally:
            process.terminate()
            assert process.wait(TIMEOUT_S) == 0
