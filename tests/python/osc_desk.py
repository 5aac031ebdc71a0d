"""A desk that steers a show by Open Sound Control, with python-osc.

    osc_desk.py HOST:PORT [--from HOST] [--port PORT]

Prints its own port. Each line on stdin is a message to send, as JSON: a list of the address and its arguments, or of the word
"bytes" and a text in hex, or of the word "bundle" and such messages. A whole number is sent as an integer (i), another number as
a float (f), a text as a string (s). Each received message is printed as a list of the address and its arguments.
"""

import argparse
import json
import socket
import sys
import threading

from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder
from pythonosc.osc_packet import OscPacket


def message(address, *arguments):
    builder = OscMessageBuilder(address=address)
    for argument in arguments:
        builder.add_arg(argument)
    return builder.build()


def bundle(*messages):
    builder = OscBundleBuilder(IMMEDIATELY)
    for one in messages:
        builder.add_content(message(*one))
    return builder.build()


def datagram(order):
    if order[0] == "bytes":
        return bytes.fromhex(order[1])
    return (bundle(*order[1:]) if order[0] == "bundle" else message(*order)).dgram


def receive(desk):
    while True:
        packet, _ = desk.recvfrom(65536)
        for timed in OscPacket(packet).messages:
            print(json.dumps([timed.message.address, *timed.message.params]), flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("to")
    parser.add_argument("--from", dest="host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=0)
    args = parser.parse_args()
    host, port = args.to.rsplit(":", 1)
    desk = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    desk.bind((args.host, args.port))
    print(desk.getsockname()[1], flush=True)
    threading.Thread(target=receive, args=[desk], daemon=True).start()
    for line in sys.stdin:
        desk.sendto(datagram(json.loads(line)), (host, int(port)))


main()
