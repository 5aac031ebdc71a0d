"""The stock MCAP readers read from a recording of a real show the same frames that a subscriber received.

Run by the Rust test `record::stock_readers_find_every_frame_the_contact_and_the_configuration`, which makes the recording
and passes its folder in the environment.
"""

import os
from pathlib import Path

import pytest
from bus import HEADER_FIELDS, frame_bytes
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

FOLDER = Path(os.environ["RECORDING_FOLDER"])


def decoded(topic):
    with open(FOLDER / "show.mcap", "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return [item.decoded_message for item in reader.iter_decoded_messages(topics=[topic])]


def recorded_bytes(frame):
    header = {name: getattr(frame, name) for name in HEADER_FIELDS}
    return frame_bytes(header, ((handle.position_m, handle.velocity_mps) for handle in frame.handles))


def test_every_frame_that_was_received_is_recorded_bit_for_bit():
    frames = decoded("/dragon/frames")
    assert [frame.tick for frame in frames] == list(range(len(frames)))
    assert b"".join(map(recorded_bytes, frames)) == (FOLDER / "frames.bin").read_bytes()


def test_the_contact_is_among_the_alerts():
    [contact] = [alert for alert in decoded("/dragon/alerts") if alert.kind == 1]
    assert contact.show_time_ns == pytest.approx(412_473_838_000, abs=1_000)
    assert (contact.bench_a, contact.bench_b, contact.clearance_m) == (0, 8, 0.0)


def test_the_metadata_is_the_description_of_the_run():
    [first, *_] = decoded("/dragon/frames")
    with open(FOLDER / "show.mcap", "rb") as stream:
        [metadata] = make_reader(stream).iter_metadata()
    assert metadata.name == "bench_dragon.configuration"
    assert metadata.metadata == {"run_id": str(first.run_id), "toml": (FOLDER / "description.toml").read_text()}
