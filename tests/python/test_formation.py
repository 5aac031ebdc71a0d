"""The stock MCAP readers read the recording of a plan of two dragons without code of the project.

Run by the Rust test `dragons::stock_readers_find_every_dragon_in_a_recording`, which passes the recording and the bytes of its frames
on the bus in the environment.
"""

import os
import struct
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

RECORDING = Path(os.environ["RECORDING"])
FRAMES = Path(os.environ["RECORDING_FRAMES"])
HEADER = struct.Struct("<QQqQQdddII")
HANDLE = struct.Struct("<6d")
DRAGON = struct.Struct("<ddIIII")
BENCHES = {"gold": 40, "silver": 30}


def decoded(topic):
    with open(RECORDING, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return [(item.schema.name, item.decoded_message) for item in reader.iter_decoded_messages(topics=[topic])]


def wire_bytes(frame):
    """Returns a decoded frame as `frame_bytes` of the crate `bench-dragon-ipc` writes it."""
    header = HEADER.pack(*(getattr(frame, name) for name in frame.__slots__[:10]))
    handles = (HANDLE.pack(*handle.position_m, *handle.velocity_mps) for handle in frame.handles)
    dragons = (DRAGON.pack(*(getattr(dragon, name) for name in dragon.__slots__)) for dragon in frame.dragons)
    return b"".join([header, *handles, struct.pack("<dd", frame.course_m, frame.course_mps), *dragons])


def test_every_frame_has_every_bit_of_the_bus():
    frames = decoded("/dragon/frames")
    assert {schema for schema, _ in frames} == {"bench_dragon_msgs/msg/FormationFrame"}
    assert b"".join(wire_bytes(frame) for _, frame in frames) == FRAMES.read_bytes()
    _, last = frames[-1]
    assert [(dragon.first_handle, dragon.bench_count) for dragon in last.dragons] == [(0, 40), (41, 30)]


def test_each_dragon_has_a_topic_of_poses():
    topics = {name: decoded(f"/dragon/{name}/poses") for name in BENCHES}
    assert len({len(messages) for messages in topics.values()}) == 1 and topics["gold"]
    frames = {frame.scheduled_ns: frame for _, frame in decoded("/dragon/frames")}
    first = frames[min(frames)]
    for (name, messages), dragon in zip(topics.items(), first.dragons, strict=True):
        poses = messages[0][1].poses
        assert len(poses) == BENCHES[name]
        for index, pose in enumerate(poses):
            front, rear = first.handles[dragon.first_handle + index : dragon.first_handle + index + 2]
            assert pose.position.x == (front.position_m[0] + rear.position_m[0]) / 2
    assert decoded("/dragon/poses") == []


def test_frames_of_reference_have_the_names_of_the_dragons():
    _, message = decoded("/tf")[0]
    children = [transform.child_frame_id for transform in message.transforms]
    assert children == [f"{name}/bench_{index}" for name, count in BENCHES.items() for index in range(count)]
    assert {transform.header.frame_id for transform in message.transforms} == {"stage"}
