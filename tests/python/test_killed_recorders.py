"""The stock MCAP readers open the files of killed recorders: by streaming before the repair, by the index after it.

Run by the Rust test `killed_recorders`, which passes the folder in the environment and lists the frames.
"""

import os
import struct
from pathlib import Path

from mcap.exceptions import EndOfFile
from mcap.reader import SeekingReader
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader

FOLDER = Path(os.environ["RECORDING_FOLDER"])
TOPIC = "/dragon/frames"


def tick(data):
    """Returns the tick of a frame, which follows the encapsulation and the run."""
    return struct.unpack_from("<Q", data, 4 + 8)[0]


def streamed_ticks(path):
    channels, ticks = {}, []
    with open(path, "rb") as stream:
        try:
            for record in StreamReader(stream, validate_crcs=True).records:
                if isinstance(record, Channel):
                    channels[record.id] = record.topic
                elif isinstance(record, Message) and channels[record.channel_id] == TOPIC:
                    ticks.append(tick(record.data))
        except EndOfFile:
            return ticks
    raise AssertionError(f"{path} ends like a finished file")


def indexed_ticks(path):
    with open(path, "rb") as stream:
        reader = SeekingReader(stream, validate_crcs=True)
        summary = reader.get_summary()
        ticks = [tick(message.data) for _, _, message in reader.iter_messages(topics=[TOPIC])]
    # A file without frames may still have a chunk of commands.
    frames = {channel.id for channel in summary.channels.values() if channel.topic == TOPIC}
    assert any(frames & chunk.message_index_offsets.keys() for chunk in summary.chunk_indexes) == bool(ticks)
    return ticks


def test_every_file_streams_and_once_repaired_has_an_index():
    lines = (FOLDER / "frames.txt").read_text().splitlines()
    assert len(lines) >= 100
    for line in lines:
        number, first, count = map(int, line.split())
        expected = list(range(first, first + count))
        assert streamed_ticks(FOLDER / str(number) / "cut.mcap") == expected, number
        assert indexed_ticks(FOLDER / str(number) / "repaired.mcap") == expected, number
