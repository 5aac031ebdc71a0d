"""Several dragons in one frame, by their names and numbers."""

import numpy as np
import pytest
from bench_dragon import DragonState, Show
from stage import EXAMPLES, PATIENCE_S

TWO_DRAGONS = str(EXAMPLES / "two-dragons.toml")


@pytest.fixture
def two(stage):
    server = stage.serve("--config", TWO_DRAGONS, "--rate", "20", "--start-at", "12")
    with Show(stage.instance, timeout_s=PATIENCE_S) as show:
        yield show
    server.stop()


def test_a_frame_has_its_dragons_by_name_and_number(two):
    frame = two.wait(PATIENCE_S)
    gold, silver = frame.dragons["gold"], frame.dragons["silver"]
    assert frame.dragons.names == ("gold", "silver")
    assert [len(gold.benches), len(silver.benches), len(frame.benches)] == [40, 30, 70]
    assert (frame.dragons[1].positions == silver.positions).all() and len(frame.dragons) == 2
    assert np.shares_memory(silver.positions, frame.positions)
    assert (frame.positions[41:] == silver.positions).all()
    for whole, parts in (
        (frame.benches.centres, [dragon.benches.centres for dragon in frame.dragons]),
        (frame.benches.turn_rates, [dragon.benches.turn_rates for dragon in frame.dragons]),
    ):
        assert (whole == np.concatenate(parts)).all()
    assert gold.motion.dragon_state is DragonState.WALKING
    assert gold.motion.travel_m == frame.header.head_travel_m
    with pytest.raises(KeyError, match="no dragon is named 'bronze'; names: gold, silver"):
        frame.dragons["bronze"]
    with pytest.raises(IndexError):
        frame.dragons[2]


def test_a_show_has_the_dragons_of_the_newest_frame(two):
    first = two.dragons["gold"].motion.travel_m
    assert two.dragons["silver"].benches.centres.shape == (30, 3)
    while (moved := two.dragons["gold"]).motion.travel_m == first:
        pass
    assert moved.motion.travel_m > first
    assert two.receive() is None or two.lost == 0


def test_dragons_of_a_copy_outlive_their_frame(two):
    frame = two.wait(PATIENCE_S)
    expected = frame.dragons["silver"].positions.copy()
    kept = frame.copy()
    del frame
    assert (kept.dragons["silver"].positions == expected).all()
    assert not np.shares_memory(kept.dragons["silver"].positions, expected)
    assert "dragons=[DragonMotion(travel_m=" in repr(kept)


def test_one_dragon_has_a_number_and_no_name(stage):
    server = stage.serve("--rate", "20", "--held")
    with Show(stage.instance, timeout_s=PATIENCE_S) as show:
        frame = show.wait(PATIENCE_S)
        assert frame.dragons.names == ()
        assert (frame.dragons[0].benches.centres == frame.benches.centres).all()
        assert frame.header.is_plan == 0 and frame.header.course_m == frame.header.head_travel_m
        with pytest.raises(KeyError, match="names: none"):
            frame.dragons["gold"]
    server.stop()
