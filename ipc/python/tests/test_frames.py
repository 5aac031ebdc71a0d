"""Frames in shared memory: their values, gaps and lifetimes."""

import gc
import json
import math
import threading

import numpy as np
import pytest
from bench_dragon import Continuity, NoServer, Show, ShowState, TooManyFramesHeld
from stage import PATIENCE_S, read_until, wait_for_tick


def printed_frames(stage, count):
    lines = stage.run("echo", "--count", str(count), "--format", "json").stdout.splitlines()
    assert len(lines) == count
    return [json.loads(line) for line in lines]


def test_every_value_of_every_frame_is_the_one_that_echo_prints(stage):
    server = stage.serve("--rate", "20", "--time-scale", "10")
    with Show(stage.instance) as show:
        printed = {line["tick"]: line for line in printed_frames(stage, 10)}
        for frame in show.frames(PATIENCE_S):
            header = frame.header.fields()
            if line := printed.pop(header["tick"], None):
                handles = line.pop("handles")
                # JSON keeps the older name of the show time.
                line["show_time_ns"] = line.pop("sim_time_ns")
                # What follows in a header is the dragon, whose values these are.
                [motion] = header.pop("dragons")
                course = [header.pop(name) for name in ("course_m", "course_mps", "dragon_count", "is_plan")]
                assert course == [motion.travel_m, motion.speed_mps, 1, 0]
                assert course[:2] == [header["head_travel_m"], header["head_speed_mps"]]
                assert header == line
                assert frame.positions.tolist() == [handle["position_m"] for handle in handles]
                assert frame.velocities.tolist() == [handle["velocity_mps"] for handle in handles]
            if not printed:
                break
        assert frame.header.run_id == server.run_id
        del frame
    server.stop()


def test_a_reader_from_the_start_gets_every_frame_of_the_run(stage):
    server = stage.serve("--readers", "1", "--rate", "100", "--catch-up", "10", "--until", "1")
    with Show(stage.instance) as show:
        headers = read_until(show, "the show ends", lambda header: header.show_state is ShowState.ENDED)
        summary = server.summary()
        assert [header.tick for header in headers] == list(range(summary["frames"]))
        since_start_ns = [header.scheduled_ns - headers[0].scheduled_ns for header in headers]
        assert [header.show_time_ns for header in headers] == [min(time_ns, 1_000_000_000) for time_ns in since_start_ns]
        assert (headers[0].show_time_s, headers[-1].show_time_s) == (0.0, 1.0)
        assert str(headers[0].show_state) == "running"
        assert show.lost == 0


def test_a_reader_by_the_clock_gets_every_frame(stage):
    server = stage.serve("--readers", "1", "--rate", "200", "--catch-up", "10", "--until", "1")
    with Show(stage.instance) as show:
        ticks = []
        while (frame := show.wait_until_due(PATIENCE_S)) is not None:
            ticks.append(frame.header.tick)
            if frame.header.show_state is ShowState.ENDED:
                break
        assert ticks == list(range(server.summary()["frames"]))
        for spin_us in (-1, float("nan"), 1e7):
            with pytest.raises(ValueError, match="spin_us is .*, must be from 0 to 1000000"):
                show.wait_until_due(PATIENCE_S, spin_us=spin_us)
        del frame


def test_the_first_positions_are_those_of_the_paper(stage):
    server = stage.serve("--readers", "1", "--start-at", "300", "--rate", "10")
    with Show(stage.instance) as show:
        positions = show.wait(PATIENCE_S).positions
        assert positions.shape == (224, 3)
        expected = {0: (4.420274, 2.320429), 1: (2.459489, 4.402476), 223: (1.785033, 9.301164)}
        for handle, (x, y) in expected.items():
            assert positions[handle].tolist() == pytest.approx([x, y, 0.0], abs=1e-6)
        del positions
    server.stop()


def test_one_handle_is_read_without_an_array(stage):
    server = stage.serve("--rate", "20", "--start-at", "100")
    with Show(stage.instance) as show:
        frame = show.wait(PATIENCE_S)
        for each in (frame, frame.copy()):
            for handle in (0, 7, 223, -1, -224):
                assert each.position(handle) == tuple(frame.positions[handle])
                assert each.velocity(handle) == tuple(frame.velocities[handle])
            for handle in (224, -225):
                with pytest.raises(IndexError):
                    each.position(handle)
        del frame, each
    server.stop()


def test_benches_lie_between_their_handles(stage):
    server = stage.serve("--rate", "20", "--start-at", "100")
    with Show(stage.instance) as show:
        frame = show.wait(PATIENCE_S)
        benches = frame.benches
        assert len(benches) == 223
        handles = list(zip(frame.positions.tolist(), frame.velocities.tolist(), strict=True))
        for bench in range(223):
            (front, front_velocity), (rear, rear_velocity) = handles[bench : bench + 2]
            assert benches.centres[bench].tolist() == [(a + b) / 2 for a, b in zip(front, rear, strict=True)]
            velocity = [(a + b) / 2 for a, b in zip(front_velocity, rear_velocity, strict=True)]
            assert benches.velocities[bench].tolist() == velocity
            assert benches.speeds[bench] == pytest.approx(math.hypot(*velocity), rel=1e-15)
            x, y, _ = (a - b for a, b in zip(front, rear, strict=True))
            u, v, _ = (a - b for a, b in zip(front_velocity, rear_velocity, strict=True))
            # numpy's arctangent may differ from the C library's in the last place.
            assert benches.headings[bench] == pytest.approx(math.atan2(y, x), rel=1e-15)
            assert benches.turn_rates[bench] == (x * v - y * u) / (x * x + y * y)
            assert benches.pitches[bench] == 0.0, "the ground is level"
        del frame
        assert not np.shares_memory(benches.centres, show.wait(PATIENCE_S).positions)
    server.stop()


def test_turn_rates_are_the_derivatives_of_the_headings(stage):
    server = stage.serve("--readers", "1", "--rate", "100", "--start-at", "50", "--until", "50.5")
    with Show(stage.instance) as show:
        times_ns, headings, turn_rates = [], [], []
        for frame in show.frames(PATIENCE_S):
            if frame.header.show_state is ShowState.ENDED:
                break
            times_ns.append(frame.header.show_time_ns)
            headings.append(frame.benches.headings)
            turn_rates.append(frame.benches.turn_rates)
        del frame
        assert show.lost == 0
        turned = (np.array(headings[2:]) - np.array(headings[:-2]) + np.pi) % (2 * np.pi) - np.pi
        # A period that the server has missed makes a step of another length.
        steps_ns = np.diff(times_ns)
        even = (steps_ns[:-1] == 10_000_000) & (steps_ns[1:] == 10_000_000)
        assert even.any(), steps_ns
        np.testing.assert_allclose(turned[even] / 0.02, np.array(turn_rates[1:-1])[even], atol=1e-5)
    server.summary()


def test_frames_that_a_slow_reader_loses_are_counted(stage):
    server = stage.serve("--rate", "1000")
    with Show(stage.instance) as show:
        first = show.wait(PATIENCE_S)
        assert (first.continuity, first.lost) == (Continuity.FIRST, 0)
        wait_for_tick(show, first.header.tick + 600)
        server.stop()
        first_tick, last, count = first.header.tick, first.header, 1
        del first
        while (frame := show.receive()) is not None:
            gap = frame.header.tick - last.tick - 1
            assert frame.lost == gap
            assert frame.continuity is (Continuity.LOST if gap else Continuity.NEXT)
            last, count = frame.header, count + 1
        assert count + show.lost == last.tick - first_tick + 1
        assert show.lost >= 600 - 256


@pytest.mark.parametrize("end", ["stop", "kill"])
def test_a_restart_differs_from_a_gap_and_reading_continues(stage, end):
    first = stage.serve("--rate", "50")
    with Show(stage.instance) as show:
        assert show.wait(PATIENCE_S).header.run_id == first.run_id
        assert show.description(PATIENCE_S).run_id == first.run_id
        getattr(first, end)()
        second = stage.serve("--rate", "40")
        for frame in show.frames(PATIENCE_S):
            if frame.header.run_id == second.run_id:
                break
            assert frame.continuity is Continuity.NEXT
        assert (frame.continuity, frame.lost, show.lost) == (Continuity.RESTARTED, 0, 0)
        assert next(iter(show)).continuity is Continuity.NEXT
        while show.description(PATIENCE_S).run_id != second.run_id:
            # The server sends late joiners the description ten times a second.
            assert show.wait(PATIENCE_S).header.tick < 40 * PATIENCE_S
        assert show.description().config["serve"]["rate_hz"] == 40
        assert show.pause(PATIENCE_S) > 0
        del frame
    second.stop()


def test_arrays_are_read_only_views_on_the_servers_shared_memory(stage):
    server = stage.serve("--rate", "20")
    with Show(stage.instance) as show:
        frame = show.wait(PATIENCE_S)
        for array in (frame.positions, frame.velocities):
            assert any(array.ctypes.data in mapped for mapped in segments(stage.prefix))
            with pytest.raises(ValueError, match="read-only"):
                array[0, 0] = 1.0
            with pytest.raises(ValueError, match="WRITEABLE"):
                array.flags.writeable = True
        del array, frame
    server.stop()


def segments(prefix):
    """Returns the address ranges of an instance's shared memory in this process."""
    with open("/proc/self/maps") as maps:
        lines = [line.split() for line in maps if f"/dev/shm/{prefix}" in line]
    bounds = [[int(bound, 16) for bound in line[0].split("-")] for line in lines]
    return [range(start, end) for start, end in bounds]


def test_an_array_keeps_its_values_after_its_frame_the_client_and_the_server_are_gone(stage):
    server = stage.serve("--rate", "1000", "--start-at", "100")
    show = Show(stage.instance)
    frame = show.wait(PATIENCE_S)
    head, tick = frame.positions[0], frame.header.tick
    before = head.tolist()
    assert math.hypot(*before) > 1
    del frame
    gc.collect()
    # During this time the server reuses each slot of its memory several times.
    read_until(show, "a thousand ticks later", lambda header: header.tick > tick + 1000)
    assert head.tolist() == before
    server.stop()
    show.close()
    del show
    gc.collect()
    assert head.tolist() == before
    assert stage.remains() != [], "this process is still a member"
    del head
    assert stage.remains() == []


def test_four_frames_may_be_held(stage):
    server = stage.serve("--rate", "20")
    with Show(stage.instance) as show:
        held = [show.wait(PATIENCE_S).positions for _ in range(4)]
        with pytest.raises(TooManyFramesHeld, match="4 frames are held, the most that a reader may hold"):
            show.wait(PATIENCE_S)
        del held[2:]
        # A loop releases a frame when it receives the next one.
        assert len(read_until(show, "tick 21", lambda header: header.tick > 20)) > 4
        assert show.lost == 0
        held.clear()
    server.stop()


def test_any_number_of_copies_may_be_kept(stage):
    server = stage.serve("--rate", "100")
    with Show(stage.instance) as show:
        copies = [show.wait(PATIENCE_S).copy() for _ in range(20)]
        stacked = np.stack([frame.positions for frame in copies])
        assert stacked.shape == (20, 224, 3)
        assert len({frame.header.tick for frame in copies}) == 20
        assert not np.shares_memory(copies[0].positions, show.wait(PATIENCE_S).positions)
    server.stop()


def test_seconds_are_the_nearest_to_the_nanoseconds(stage):
    server = stage.serve("--readers", "1", "--rate", "1000", "--start-at", "123.461")
    with Show(stage.instance) as show:
        assert show.wait(PATIENCE_S).header.show_time_s == 123.461
    server.stop()


def test_the_latest_frame_is_the_newest_and_skipped_frames_are_not_lost(stage):
    server = stage.serve("--rate", "20")
    with Show(stage.instance) as show:
        held = [show.wait(PATIENCE_S).positions for _ in range(3)]
        tick = show.status(PATIENCE_S).tick + 5
        wait_for_tick(show, tick)
        assert show.latest().header.tick >= tick
        assert show.lost == 0
        held.clear()
        server.stop()
        show.latest()
        assert show.latest() is None and show.receive() is None


def test_a_wait_ends_with_its_timeout(stage):
    server = stage.serve("--rate", "20")
    with Show(stage.instance) as show:
        server.stop()
        show.latest()
        assert show.wait(0) is None
        assert show.wait(0.01) is None
        with pytest.raises(NoServer, match="no server runs on instance"):
            next(show.frames(timeout_s=0.01))


def test_other_threads_run_while_one_waits(stage):
    first = stage.serve("--rate", "50")
    with Show(stage.instance) as show:
        first.stop()
        show.latest()
        servers = []
        thread = threading.Thread(target=lambda: servers.append(stage.serve("--rate", "50")))
        thread.start()
        run_id = show.wait(PATIENCE_S).header.run_id
        thread.join(PATIENCE_S)
        assert not thread.is_alive(), f"the other thread still runs after {PATIENCE_S} s"
        assert run_id == servers[0].run_id
    servers[0].stop()
