"""Receives Open Sound Control with python-osc, and prints what came as JSON.

    osc_receiver.py udp|tcp FRAMES

Prints the port, then ends with that many whole frames: what came between two messages of the show, that at the front among
it. Each is a list of [address, arguments, seconds since 1970 of its bundle or null].
"""

import json
import socket
import sys
import threading

from pythonosc import osc_packet
from pythonosc.dispatcher import Dispatcher
from pythonosc.osc_server import BlockingOSCUDPServer
from pythonosc.osc_tcp_server import MODE_1_1, BlockingOSCTCPServer

SO_RCVBUFFORCE = 33
ROOM = 32 << 20
# In seconds: longer than the frames take to come on any machine.
PATIENCE = 150


class Frames:
    """Messages, cut where a frame begins."""

    def __init__(self, count):
        self.count = count
        self.frames = []
        self.is_full = threading.Event()

    def take(self, address, *arguments):
        if self.is_full.is_set():
            return
        if address.endswith("/show"):
            if len(self.frames) == self.count:
                self.is_full.set()
                return
            self.frames.append([])
        self.frames[-1].append([address, arguments])


class Server(BlockingOSCUDPServer):
    """Keeps, beside the messages, how long the datagrams were and when their bundles are for."""

    longest = 0
    times = []

    def verify_request(self, request, client_address):
        datagram = request[0]
        self.longest = max(self.longest, len(datagram))
        self.times.append(osc_packet.OscPacket(datagram).messages[0].time if datagram.startswith(b"#bundle") else None)
        return super().verify_request(request, client_address)


def main():
    transport, frames = sys.argv[1], Frames(int(sys.argv[2]))
    dispatcher = Dispatcher()
    dispatcher.set_default_handler(frames.take)
    if transport == "tcp":
        server = BlockingOSCTCPServer(("127.0.0.1", 0), dispatcher, MODE_1_1)
    else:
        server = Server(("127.0.0.1", 0), dispatcher)
        try:
            server.socket.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, ROOM)
        except PermissionError:
            server.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, ROOM)
    print(server.server_address[1], flush=True)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    if not frames.is_full.wait(PATIENCE):
        sys.exit(f"only {len(frames.frames)} frames have come")
    longest, times = getattr(server, "longest", None), getattr(server, "times", [])
    print(json.dumps({"frames": frames.frames, "longest": longest, "times": times}), flush=True)


main()
