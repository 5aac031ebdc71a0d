"""The stock MCAP readers read every bit of a recording without code of the project.

Run by the Rust test `python::stock_python_readers_find_every_bit`, which makes the recordings and passes their
folder in the environment.
"""

import math
import os
import struct
from pathlib import Path

import pytest
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader
from mcap_ros2._vendor.rosidl_adapter.parser import parse_message_string
from mcap_ros2.decoder import DecoderFactory

FOLDER = Path(os.environ["RECORDING_FOLDER"])
FRAMES = int(os.environ["RECORDING_FRAMES"])
FRAMES_IN_CUT = int(os.environ["RECORDING_FRAMES_IN_CUT"])
OFFSET_NS = int(os.environ["RECORDING_OFFSET_NS"])
FRAME_BYTES = 72 + 224 * 48
HEADER = struct.Struct("<QQqQQdddII")
HANDLE = struct.Struct("<6d")


def expected_frames():
    sent = (FOLDER / "frames.bin").read_bytes()
    assert len(sent) == FRAMES * FRAME_BYTES
    return [sent[at : at + FRAME_BYTES] for at in range(0, len(sent), FRAME_BYTES)]


def wire_bytes(frame):
    """Returns a decoded frame as its bytes in shared memory."""
    header = HEADER.pack(
        frame.run_id,
        frame.tick,
        frame.show_time_ns,
        frame.scheduled_ns,
        frame.published_ns,
        frame.head_travel_m,
        frame.head_speed_mps,
        frame.time_scale,
        frame.bench_count,
        frame.state,
    )
    return header + b"".join(HANDLE.pack(*handle.position_m, *handle.velocity_mps) for handle in frame.handles)


def decoded(name, topic):
    with open(FOLDER / name, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return [(item.message, item.decoded_message) for item in reader.iter_decoded_messages(topics=[topic])]


def streamed_frames(name):
    """Returns the frames that the streaming reader yields, and its final error, if any."""
    schemas, channels, frames, factory = {}, {}, [], DecoderFactory()
    with open(FOLDER / name, "rb") as stream:
        try:
            for record in StreamReader(stream, validate_crcs=True).records:
                if isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel):
                    channels[record.id] = record
                elif isinstance(record, Message) and channels[record.channel_id].topic == "/dragon/frames":
                    channel = channels[record.channel_id]
                    decode = factory.decoder_for(channel.message_encoding, schemas[channel.schema_id])
                    frames.append(wire_bytes(decode(record.data)))
        except EndOfFile as error:
            return frames, error
    return frames, None


def test_the_indexed_reader_finds_every_bit_of_every_frame():
    assert [wire_bytes(frame) for _, frame in decoded("show.mcap", "/dragon/frames")] == expected_frames()


def test_the_streaming_reader_finds_every_bit_of_every_frame():
    frames, error = streamed_frames("show.mcap")
    assert frames == expected_frames()
    assert error is None


def test_the_fields_of_a_frame_have_the_names_of_the_bus():
    _, frame = decoded("show.mcap", "/dragon/frames")[0]
    names = "run_id tick show_time_ns scheduled_ns published_ns head_travel_m head_speed_mps time_scale bench_count state"
    assert [field for field in type(frame).__slots__] == names.split() + ["handles"]


def test_the_times_of_a_message_are_unix_times():
    for message, frame in decoded("show.mcap", "/dragon/frames"):
        assert message.log_time == frame.published_ns + OFFSET_NS
        assert message.publish_time == frame.scheduled_ns + OFFSET_NS
        assert message.sequence == frame.tick & 0xFFFFFFFF


def test_a_pose_is_the_middle_and_the_heading_of_its_bench():
    frames = {message.log_time: frame for message, frame in decoded("show.mcap", "/dragon/frames")}
    poses = decoded("show.mcap", "/dragon/poses")
    assert len(poses) in (8, 9)  # a quarter of a second at 30 Hz
    for message, array in poses:
        assert array.header.frame_id == "stage"
        assert array.header.stamp.sec * 10**9 + array.header.stamp.nanosec == message.publish_time
        handles = frames[message.log_time].handles
        assert len(array.poses) == len(handles) - 1
        for pose, front, rear in zip(array.poses, handles, handles[1:]):
            check_pose(pose, front.position_m, rear.position_m)


def test_the_benches_are_frames_of_reference_at_their_poses():
    poses = {message.log_time: array for message, array in decoded("show.mcap", "/dragon/poses")}
    transforms = decoded("show.mcap", "/tf")
    assert len(transforms) == len(poses)
    for message, benches in transforms:
        array = poses[message.log_time]
        assert [bench.child_frame_id for bench in benches.transforms] == [f"bench_{i}" for i in range(len(array.poses))]
        for bench, pose in zip(benches.transforms, array.poses):
            assert (values(bench.header.stamp), bench.header.frame_id) == (values(array.header.stamp), "stage")
            assert values(bench.transform.translation) == values(pose.position)
            assert values(bench.transform.rotation) == values(pose.orientation)


def test_the_boards_are_cubes_at_the_poses_of_their_benches():
    poses = {message.log_time: array.poses for message, array in decoded("show.mcap", "/dragon/poses")}
    scenes, markers = decoded("show.mcap", "/dragon/boards"), decoded("show.mcap", "/dragon/markers")
    assert len(scenes) == len(markers) and len(scenes) in (3, 4)  # a quarter of a second at 10 Hz
    for (message, scene), (_, array) in zip(scenes, markers, strict=True):
        [entity] = scene.entities
        assert (entity.frame_id, entity.id, scene.deletions) == ("stage", "boards", [])
        assert entity.timestamp.sec * 10**9 + entity.timestamp.nanosec == message.publish_time
        assert [entity.arrows, entity.lines, entity.texts, entity.models] == [[]] * 4
        before, *boards = array.markers
        assert before.action == 3, "all earlier markers are deleted"
        assert [(board.ns, board.id, board.type, board.action) for board in boards] == [("dragon", i, 1, 0) for i in range(223)]
        at = poses[message.log_time]
        for index, (cube, board, pose) in enumerate(zip(entity.cubes, boards, at, strict=True)):
            size = [3.41 if index == 0 else 2.2, 0.3, 0.03]
            assert values(cube.size) == values(board.scale) == size
            for drawn in (cube.pose, board.pose):
                assert values(drawn.position) == values(pose.position)
                assert values(drawn.orientation) == values(pose.orientation)
            assert (board.header.frame_id, board.color.a, cube.color.a) == ("stage", 1, 1)
            assert values(board.header.stamp) == values(entity.timestamp)
            assert values(board.color) == pytest.approx(values(cube.color), abs=1e-7)
        assert entity.cubes[0].color.r > entity.cubes[1].color.r, "the head is lighter"


def values(message):
    return [getattr(message, name) for name in type(message).__slots__]


def test_the_definitions_have_the_constants():
    # Numbers on the wire that stay the same in every version. A Rust test compares all of them with the enums.
    with open(FOLDER / "show.mcap", "rb") as stream:
        schemas = make_reader(stream).get_summary().schemas.values()
    constants = {}
    for schema in schemas:
        package, name = schema.name.split("/msg/")
        text, *_ = schema.data.decode().partition("=" * 80)
        constants[name] = {constant.name: constant.value for constant in parse_message_string(package, name, text).constants}
    assert (constants["Frame"]["RUNNING"], constants["Frame"]["ENDED"]) == (0, 5)
    assert (constants["Alert"]["CONTACT"], constants["Alert"]["NO_BENCH"]) == (1, 2**32 - 1)
    assert constants["Alert"]["NO_FORECAST"] == -(2**63)
    assert (constants["CommandEvent"]["KIND_HOLD"], constants["CommandEvent"]["SENDER_GUARD"]) == (4, 6)
    assert (constants["CommandEvent"]["REFUSAL_NONE"], constants["CommandEvent"]["REFUSAL_READY"]) == (0, 15)
    assert constants["TFMessage"] == constants["PoseArray"] == {}


def check_pose(pose, front, rear):
    middle = [(a + b) / 2 for a, b in zip(front, rear)]
    assert [pose.position.x, pose.position.y, pose.position.z] == middle
    assert (pose.orientation.x, pose.orientation.y) == (0, 0)
    heading = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
    assert math.remainder(heading - math.atan2(front[1] - rear[1], front[0] - rear[0]), math.tau) == pytest.approx(0)


def test_an_alert_keeps_every_field():
    [(message, alert)] = decoded("show.mcap", "/dragon/alerts")
    assert message.log_time == 6_000_000_000_000 + OFFSET_NS
    assert (alert.run_id, alert.tick) == (0x1FFFFF00000001, FRAMES - 1)
    assert (alert.show_time_ns, alert.forecast_ns) == (-7, -(2**63))
    assert struct.pack("<3d", alert.clearance_m, *alert.point_m) == struct.pack("<3d", -1 / 3, 0.1, -0.0)
    assert (alert.kind, alert.bench_a, alert.bench_b, alert.reserved) == (1, 0, 8, 0)


@pytest.mark.parametrize("name", ["show.mcap", "repaired.mcap"])
def test_the_configuration_is_metadata(name):
    with open(FOLDER / name, "rb") as stream:
        [metadata] = make_reader(stream).iter_metadata()
    assert metadata.name == "bench_dragon.configuration"
    toml = "[dragon]\nbenches = 223\nhead_length_m = 3.41\nbody_length_m = 2.2\nwidth_m = 0.3\n"
    assert metadata.metadata == {"run_id": str(0x1FFFFF00000001), "toml": toml}


def test_a_cut_recording_streams_its_whole_chunks_up_to_the_end_of_file():
    frames, error = streamed_frames("cut.mcap")
    assert frames == expected_frames()[:FRAMES_IN_CUT]
    assert isinstance(error, EndOfFile)


def test_the_non_seeking_reader_streams_a_cut_recording_too():
    ticks = []
    with open(FOLDER / "cut.mcap", "rb") as stream:
        reader = NonSeekingReader(stream, decoder_factories=[DecoderFactory()])
        with pytest.raises(EndOfFile):
            for item in reader.iter_decoded_messages(topics=["/dragon/frames"], log_time_order=False):
                ticks.append(item.decoded_message.tick)
    assert ticks == list(range(FRAMES_IN_CUT))


def test_a_repaired_recording_is_indexed_and_complete():
    with open(FOLDER / "repaired.mcap", "rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary.chunk_indexes
    [frames_id] = [id for id, channel in summary.channels.items() if channel.topic == "/dragon/frames"]
    assert summary.statistics.channel_message_counts[frames_id] == FRAMES_IN_CUT
    frames = [wire_bytes(frame) for _, frame in decoded("repaired.mcap", "/dragon/frames")]
    assert frames == expected_frames()[:FRAMES_IN_CUT]
