"""Commands hold from the tick of their reply, and are refused with the server's reason."""

import itertools
import json
import os
import signal
import subprocess
import threading

import pytest
from bench_dragon import NoAnswer, NoServer, Refusal, Refused, Show, ShowState
from stage import PATIENCE_S, read_until


def headers_around(show, command):
    """Sends a command. Returns the headers just before the tick that the command returns, and at it."""
    header = show.wait(PATIENCE_S).header
    tick = command()
    *_, before, after = [header, *read_until(show, f"tick {tick}", lambda header: header.tick >= tick)]
    assert (before.tick, after.tick) == (tick - 1, tick)
    return before, after


def test_a_command_holds_from_the_tick_that_it_returns(stage):
    server = stage.serve("--rate", "20")
    with Show(stage.instance) as show:
        for command, state in (
            (show.pause, ShowState.PAUSED),
            (show.resume, ShowState.RUNNING),
            (show.hold, ShowState.HELD),
            (show.release, ShowState.RUNNING),
        ):
            before, after = headers_around(show, command)
            assert before.show_state is not state
            assert after.show_state is state
        before, after = headers_around(show, lambda: show.speed(0.5))
        assert (before.head_speed_mps, after.head_speed_mps) == (1.0, 0.5)
        _, after = headers_around(show, lambda: show.seek(300.0))
        assert after.show_time_ns in range(300_000_000_000, 300_050_000_001)
        last = show.stop()
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
    with Show(stage.instance) as show:
        for name in prepare:
            call(show, [name])
        reason = printed_reason(stage, command)
        with pytest.raises(Refused) as refused:
            call(show, command)
        assert str(refused.value) == reason
        assert (refused.value.refusal, refused.value.run_id) == (refusal, server.run_id)
    server.stop()


@pytest.mark.parametrize("speed_mps", [11.0, -0.1, float("nan"), float("inf")])
def test_a_speed_out_of_range_is_refused_with_the_range(stage, speed_mps):
    server = stage.serve("--rate", "100")
    with Show(stage.instance) as show:
        with pytest.raises(Refused, match=r"^the speed is (11|-0.1|NaN|inf) m/s, must be from 0 to 10 m/s$") as refused:
            show.speed(speed_mps)
        assert (refused.value.lowest, refused.value.highest) == (0.0, 10.0)
    server.stop()


def call(show, command):
    name, *values = command
    return getattr(show, name)(*values)


def printed_reason(stage, command):
    printed = stage.run("ctl", "--format", "json", *map(str, command)).stdout
    return json.loads(printed)["reason"]


def test_a_seek_is_repeated_until_the_guard_has_proved_the_travel(stage, monkeypatch):
    server = stage.serve("--rate", "100", "--guarded")
    call, left_s, refusals, guards = Show._call, [], [], []

    def watched_call(show, kind, value, timeout_s):
        left_s.append(timeout_s)
        try:
            return call(show, kind, value, timeout_s)
        except Refused as refused:
            refusals.append((refused.refusal, str(refused)))
            if not guards:
                guards.append(stage.start("monitor", "--guard"))
            raise

    monkeypatch.setattr(Show, "_call", watched_call)
    with Show(stage.instance) as show:
        _, after = headers_around(show, lambda: show.seek(100.0, PATIENCE_S))
        assert after.show_time_s >= 100.0
    assert set(refusals) == {(Refusal.NOT_PROVED, "no guard has proved that the benches are apart there")}
    # Each attempt has the time that earlier attempts have left of the timeout.
    assert all(later <= earlier - 0.02 for earlier, later in itertools.pairwise(left_s))
    guards[0].terminate()
    guards[0].wait(PATIENCE_S)
    server.stop()


@pytest.mark.parametrize("end", ["stop", "kill"])
def test_a_command_without_a_server_raises_no_server_at_once(stage, end):
    server = stage.serve("--rate", "20")
    with Show(stage.instance) as show:
        show.resume(PATIENCE_S)
        getattr(server, end)()
        with pytest.raises(NoServer, match=f"`bench-dragon serve --config FILE --held --instance {stage.instance}`") as error:
            show.pause(None)
        assert not isinstance(error.value, NoAnswer)


def test_a_command_without_a_reply_in_time_raises_no_answer(stage):
    server = stage.serve("--rate", "20")
    expected = f"^the server on instance \"{stage.instance}\" has not answered within {{}} s: it may have taken the command$"
    with Show(stage.instance) as show:
        show.resume(PATIENCE_S)
        server.process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, server.process.pid, os.WSTOPPED)
        for timeout_s, printed in ((0.5, "0.5"), (0, "0")):
            with pytest.raises(NoAnswer, match=expected.format(printed)):
                show.pause(timeout_s)
        server.process.send_signal(signal.SIGCONT)
        assert show.resume(PATIENCE_S) > 0
    server.stop()


def test_ctrl_c_ends_a_command_to_a_suspended_server(stage):
    server = stage.serve("--rate", "20")
    script = "import sys; from bench_dragon import Show; show = Show(sys.argv[1]); print(flush=True); show.pause(None)"
    reader = stage.start_python("-c", "import sys; sys.stdin.readline();" + script, stage.instance, stdin=subprocess.PIPE)
    reader.stdin.write("\n")
    reader.stdin.flush()
    reader.stdout.readline()
    server.suspend()
    reader.send_signal(signal.SIGINT)
    assert reader.wait(PATIENCE_S) in (-signal.SIGINT, 0), "an accepted pause ends the program, too"
    server.process.send_signal(signal.SIGCONT)
    server.stop()


def test_a_hold_does_not_wait_for_the_command_of_another_thread(stage):
    server = stage.serve("--rate", "20")
    with Show(stage.instance) as show:
        show.resume(PATIENCE_S)
        server.suspend()
        threads = [threading.Thread(target=show.pause, args=(PATIENCE_S,)) for _ in range(2)]
        for thread in threads:
            thread.start()
        with pytest.raises(NoAnswer):
            show.hold(0.1)
        assert all(thread.is_alive() for thread in threads), "the other commands still wait"
        server.process.send_signal(signal.SIGCONT)
        for thread in threads:
            thread.join(PATIENCE_S)
    server.stop()
