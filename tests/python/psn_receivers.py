"""Receives PosiStageNet with pypsn and with npm's @jwetzell/posistagenet, both from the multicast group.

    psn_receivers.py FRAMES FOLDER [NODE_SCRIPT]

Prints their port once both have joined, ends after this many DATA frames, and writes the decoded frames to FOLDER/pypsn.jsonl and
FOLDER/npm.jsonl: one line per frame, and a line of names. Datagrams are kept and decoded at the end, and the sockets have room
for all of them, so that none is lost on a busy machine.
"""

import json
import socket
import subprocess
import sys
from pathlib import Path

import pypsn

INTERFACE = "127.0.0.1"
SO_RCVBUFFORCE = 33
ROOM = 32 << 20
# Longest wait for a datagram, in seconds.
TIMEOUT_S = 150
DATA_PACKET = pypsn.psn_v2_chunk.PSN_DATA_PACKET.to_bytes(2, "little")


def joined(port):
    sock = pypsn.get_socket(INTERFACE, port)
    try:
        sock.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, ROOM)
    except PermissionError:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, ROOM)
    sock.settimeout(TIMEOUT_S)
    return sock


def receive(sock, frames):
    """Returns datagrams up to the last one of this many DATA frames."""
    datagrams, expected, data_packets = [], None, 0
    while data_packets != expected:
        datagrams.append(sock.recv(65536))
        if datagrams[-1].startswith(DATA_PACKET):
            data_packets += 1
            expected = expected or frames * pypsn.parse_psn_packet(datagrams[-1]).info.packet_count
    return datagrams


def tracker_row(tracker):
    return [tracker.id, *tracker.pos, *tracker.speed, *tracker.ori, tracker.status, tracker.timestamp]


def frames_of(packets):
    """Groups consecutive packets of one frame id."""
    frames = []
    for packet in packets:
        info = packet.info
        if not frames or frames[-1]["frame_id"] != info.frame_id:
            frames.append({"frame_id": info.frame_id, "headers": [], "trackers": []})
        header = [info.timestamp, info.version_high, info.version_low, info.packet_count]
        frames[-1]["headers"].append(header)
        frames[-1]["trackers"] += map(tracker_row, packet.trackers)
    return frames


def write(path, datagrams):
    packets = [pypsn.parse_psn_packet(datagram) for datagram in datagrams]
    infos = [packet for packet in packets if isinstance(packet, pypsn.psn_info_packet)]
    names = {tracker.tracker_id: tracker.tracker_name.decode() for info in infos for tracker in info.trackers}
    with open(path, "w", encoding="utf-8") as lines:
        for frame in frames_of(packet for packet in packets if isinstance(packet, pypsn.psn_data_packet)):
            print(json.dumps(frame), file=lines)
        longest = max(map(len, datagrams))
        print(json.dumps({"system_name": infos[0].name.decode(), "names": names, "longest": longest}), file=lines)


def main():
    frames, folder = int(sys.argv[1]), Path(sys.argv[2])
    # The system chooses the port. npm's receiver shares it.
    sock, others = joined(0), []
    port = sock.getsockname()[1]
    if len(sys.argv) > 3:
        theirs = joined(port)
        arguments = ["node", sys.argv[3], str(theirs.fileno()), str(frames), str(folder / "npm.jsonl")]
        others.append(subprocess.Popen(arguments, pass_fds=[theirs.fileno()]))
        theirs.close()
    print(port, flush=True)
    try:
        write(folder / "pypsn.jsonl", receive(sock, frames))
        sys.exit(any(other.wait(TIMEOUT_S) for other in others))
    finally:
        for other in others:
            other.kill()


main()
