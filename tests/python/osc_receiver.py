"""Receives Open Sound Control with python-osc, and prints the messages as JSON.

    osc_receiver.py udp|tcp FRAMES

Prints the port, and ends after this many whole frames. A frame begins with a message of the show and ends before the next one.
It is a list of [address, arguments, seconds since 1970 of its bundle or null].
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
# Longest wait for the frames, in seconds.
TIMEOUT_S = 150


class Frames:
    """The received messages, grouped by frame."""

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
    """Also keeps the length of the longest datagram and the times of the bundles."""

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
    if not frames.is_full.wait(TIMEOUT_S):
        sys.exit(f"only {len(frames.frames)} frames arrived")
    longest, times = getattr(server, "longest", None), getattr(server, "times", [])
    print(json.dumps({"frames": frames.frames, "longest": longest, "times": times}), flush=True)


main()
