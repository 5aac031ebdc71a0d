"""A source of timecode, steered by lines on stdin. Art-Net packets follow the layout in the protocol's text; python-osc encodes
the OSC messages.

    timecode.py artnet HOST:PORT | osc HOST:PORT [--kind KIND] [--form FORM] [--from HOST]

`play S` plays from a position in seconds, `stand` repeats the present position, `silence` stops sending while the clock continues,
`speak` sends again, `send HEX` sends bytes. The answer to each order is a line of JSON: a position, and the CLOCK_MONOTONIC
instant at which the clock had it.
"""

import argparse
import json
import select
import socket
import struct
import sys
import time

from pythonosc.osc_message_builder import OscMessageBuilder

# Type byte of ArtTimeCode: frames per second, and whether two numbers per minute are omitted.
KINDS = {0: (24, False), 1: (25, False), 2: (30, True), 3: (30, False)}


def clock(frame, kind):
    """Returns hours, minutes, seconds and frames of a frame counted from 00:00:00:00."""
    numbers, drops = KINDS[kind]
    if drops:
        tens, rest = divmod(frame, 17982)
        # The first minute of ten has all 1800 numbers, the others have 1798.
        frame += 18 * tens + (0 if rest < 1800 else 2 * (1 + (rest - 1800) // 1798))
    seconds, frames = divmod(frame, numbers)
    return seconds // 3600 % 24, seconds // 60 % 60, seconds % 60, frames


def frames_per_second(kind):
    numbers, drops = KINDS[kind]
    return numbers * 1000 / 1001 if drops else numbers


def art_net(frame, kind):
    hours, minutes, seconds, frames = clock(frame, kind)
    opcode, version, filler, stream = 0x9700, 14, 0, 0
    return (
        b"Art-Net\0"
        + struct.pack("<H", opcode)
        + struct.pack(">H", version)
        + struct.pack("7B", filler, stream, frames, seconds, minutes, hours, kind)
    )


def osc(frame, kind, form):
    builder = OscMessageBuilder(address="/timecode")
    hours, minutes, seconds, frames = clock(frame, kind)
    if form == "text":
        builder.add_arg(f"{hours:02}:{minutes:02}:{seconds:02}:{frames:02}")
        builder.add_arg(29.97 if KINDS[kind][1] else KINDS[kind][0])
    elif form == "numbers":
        for number in (hours, minutes, seconds, frames):
            builder.add_arg(number)
    elif form == "decimals":
        second = frame / frames_per_second(kind)
        builder.add_arg(f"{int(second) // 3600:02}:{int(second) // 60 % 60:02}:{second % 60:06.3f}")
    else:
        builder.add_arg(frame / frames_per_second(kind), arg_type="d" if form == "double" else "f")
    return builder.build().dgram


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("protocol", choices=["artnet", "osc"])
    parser.add_argument("to")
    parser.add_argument("--kind", type=int, default=1)
    parser.add_argument("--form", default="text")
    parser.add_argument("--from", dest="host", default="127.0.0.1")
    args = parser.parse_args()
    host, port = args.to.rsplit(":", 1)
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.bind((args.host, 0))
    rate = frames_per_second(args.kind)
    first, epoch_ns, stands, speaks = 0, time.monotonic_ns(), True, False
    sent = -1

    def due_ns(frame):
        return epoch_ns + round((frame - first) * 1e9 / rate)

    while True:
        now = time.monotonic_ns()
        wait = 1 / rate if stands else max(0, due_ns(sent + 1) - now) / 1e9
        if select.select([sys.stdin], [], [], wait)[0]:
            line = sys.stdin.readline()
            if not line:
                return
            order, *values = line.split()
            if order == "play":
                first, epoch_ns = round(float(values[0]) * rate), time.monotonic_ns()
                sent, stands, speaks = first - 1, False, True
            elif order == "stand":
                first, stands = sent, True
            elif order in ("silence", "speak"):
                speaks = order == "speak"
            elif order == "send":
                sender.sendto(bytes.fromhex(values[0]), (host, int(port)))
            print(json.dumps({"position_s": first / rate, "epoch_ns": epoch_ns}), flush=True)
            continue
        if not stands:
            # After a stall of this process, the present frame is sent, and no earlier ones.
            sent = max(sent + 1, first + int((time.monotonic_ns() - epoch_ns) * rate // 1_000_000_000))
        if speaks:
            packet = art_net(sent, args.kind) if args.protocol == "artnet" else osc(sent, args.kind, args.form)
            sender.sendto(packet, (host, int(port)))


main()
