"""Commands hold from the tick of their reply, and are refused with the server's reason."""

import json
from pathlib import Path

import pytest
from bench_dragon import Dragon, NoServer, Refusal, Refused, ShowState
from bench_dragon.command import REASONS
from stage import PATIENCE_S, read_until


def headers_around(dragon, command):
    """Gives a command; the headers just before the tick that it returns, and at it."""
    header = dragon.wait(PATIENCE_S).header
    tick = command()
    *_, before, after = [header, *read_until(dragon, lambda header: header.tick >= tick)]
    assert (before.tick, after.tick) == (tick - 1, tick)
    return before, after


def test_a_command_holds_from_the_tick_that_it_returns(stage):
    server = stage.serve("--rate", "20")
    with Dragon(stage.instance) as dragon:
        for command, state in (
            (dragon.pause, ShowState.PAUSED),
            (dragon.resume, ShowState.RUNNING),
            (dragon.hold, ShowState.HELD),
            (dragon.release, ShowState.RUNNING),
        ):
            before, after = headers_around(dragon, command)
            assert before.show_state is not state
            assert after.show_state is state
        before, after = headers_around(dragon, lambda: dragon.speed(0.5))
        assert (before.head_speed_mps, after.head_speed_mps) == (1.0, 0.5)
        _, after = headers_around(dragon, lambda: dragon.seek(300.0))
        assert after.sim_time_ns in range(300_000_000_000, 300_050_000_001)
        last = dragon.stop()
        assert server.summary()["frames"] == last + 1


@pytest.mark.parametrize(
    ("prepare", "command", "refusal"),
    [
        ([], ["seek", 1e9], Refusal.OUT_OF_RANGE),
        ([], ["release"], Refusal.NOT_HELD),
        (["hold"], ["resume"], Refusal.HELD),
    ],
)
def test_a_refusal_has_the_reason_that_ctl_prints(stage, prepare, command, refusal):
    server = stage.serve("--rate", "100")
    with Dragon(stage.instance) as dragon:
        for name in prepare:
            call(dragon, [name])
        reason = printed_reason(stage, command)
        with pytest.raises(Refused) as refused:
            call(dragon, command)
        assert str(refused.value) == reason
        assert (refused.value.refusal, refused.value.run_id) == (refusal, server.run_id)
    server.stop()


@pytest.mark.parametrize("speed_mps", [11.0, -0.1, float("nan"), float("inf")])
def test_a_speed_out_of_range_is_refused_with_the_range(stage, speed_mps):
    server = stage.serve("--rate", "100")
    with Dragon(stage.instance) as dragon:
        with pytest.raises(Refused, match=r"^the value must be from 0 to 10$") as refused:
            dragon.speed(speed_mps)
        assert (refused.value.lowest, refused.value.highest) == (0.0, 10.0)
    server.stop()


def call(dragon, command):
    name, *values = command
    return getattr(dragon, name)(*values)


def printed_reason(stage, command):
    printed = stage.run("ctl", "--format", "json", *map(str, command)).stdout
    return json.loads(printed)["reason"]


def test_a_guarded_server_is_asked_until_its_guard_has_proved_the_ground(stage):
    server = stage.serve("--rate", "100", "--guarded")
    with Dragon(stage.instance) as dragon:
        with pytest.raises(Refused, match="no guard has proved") as refused:
            dragon.seek(100.0, timeout_s=0.1)
        assert refused.value.refusal is Refusal.NOT_PROVED
        guard = stage.start("monitor", "--guard")
        _, after = headers_around(dragon, lambda: dragon.seek(100.0, PATIENCE_S))
        assert after.sim_time_s >= 100.0
        guard.terminate()
        guard.wait()
    server.stop()


def test_a_command_that_no_server_takes_says_so(stage):
    server = stage.serve("--rate", "20")
    with Dragon(stage.instance) as dragon:
        server.stop()
        with pytest.raises(NoServer, match="start one with `bench-dragon serve`"):
            dragon.pause()


def test_the_reasons_are_those_of_the_rust_crate():
    source = (Path(__file__).parents[2] / "src" / "command.rs").read_text()
    assert [reason for reason in REASONS.values() if f'"{reason}"' not in source] == []
    assert all(refusal in REASONS for refusal in Refusal if refusal is not Refusal.OUT_OF_RANGE)
