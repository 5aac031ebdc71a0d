"""The description, the status and the alerts of a show."""

import json
import math
import os
import signal
import threading
import time

import pytest
from bench_dragon import (
    Alert,
    AlertKind,
    EventKind,
    NoServer,
    Refusal,
    Refused,
    Sender,
    Show,
    ShowState,
    SourceState,
)
from stage import PATIENCE_S


def test_the_description_is_the_configuration(stage):
    config = "[dragon]\nbenches = 12\n\n[serve]\nrate_hz = 20\n"
    path = stage.folder / "small.toml"
    path.write_text(config)
    server = stage.serve("--config", str(path))
    with Show(stage.instance) as show:
        description = show.description(PATIENCE_S)
        assert description.run_id == server.run_id
        assert description.config["dragon"]["benches"] == 12
        assert description.config["serve"]["rate_hz"] == 20
        route = description.config["route"]
        assert (route["kind"], route["pitch_m"], route["start_turns"]) == ("spiral", 0.55, 16.0)
        assert show.description() == description
        assert show.wait(PATIENCE_S).positions.shape == (13, 3)
    server.stop()


def test_the_status_is_the_servers(stage):
    server = stage.serve("--rate", "20", "--catch-up", "10")
    with Show(stage.instance) as show:
        before, status = show.status(PATIENCE_S), show.status(PATIENCE_S)
        assert (status.run_id, status.pid, status.rate_hz) == (server.run_id, server.process.pid, 20)
        assert status.tick >= before.tick and status.show_state is ShowState.RUNNING
        assert status.show_time_ns == (status.tick + status.overruns) * 50_000_000
        assert (status.behind_ns, status.most_behind_ns) == (0, 0)
        assert math.isnan(status.granted_to_m) and math.isnan(status.asked_m)
        for histogram, median_ns, max_ns in (
            (status.lateness, status.lateness_p50_ns, status.lateness_max_ns),
            (status.tick_time, status.tick_p50_ns, status.tick_max_ns),
        ):
            assert median_ns <= max_ns == histogram.max_ns
            assert sum(histogram.counts) >= status.tick
    summary = server.stop()
    assert summary["frames"] > status.tick


def test_the_latest_status_is_returned_at_once_and_outlives_its_server(stage):
    first = stage.serve("--rate", "20")
    with Show(stage.instance) as show:
        show.status(PATIENCE_S)
        show.status(0)
        frames = first.stop()["frames"]
        last = show.status(0)
        assert (last.run_id, last.tick) == (first.run_id, frames - 1)
        assert show.status(0).tick == last.tick
        second = stage.serve("--rate", "20")
        for frame in show.frames(PATIENCE_S):
            if show.status(0).run_id == second.run_id:
                break
            assert frame.header.tick < 20 * PATIENCE_S
        del frame
    second.stop()


@pytest.mark.parametrize("read", [Show.description, Show.status])
@pytest.mark.parametrize("end", ["stop", "kill"])
def test_the_last_description_and_status_of_a_server_are_returned_also_if_they_were_never_read(stage, read, end):
    server = stage.serve("--rate", "20")
    with Show(stage.instance) as show, Show(stage.instance) as witness:
        # The server sends both to all readers alike.
        witness.description(PATIENCE_S), witness.status(PATIENCE_S)
        getattr(server, end)()
        assert read(show, 0).run_id == server.run_id


@pytest.mark.parametrize("read", [Show.description, Show.status])
def test_what_a_killed_server_has_sent_is_returned_also_after_another_client_has_cleaned_up(stage, read):
    server = stage.serve("--rate", "20")
    with Show(stage.instance) as show, Show(stage.instance) as witness:
        witness.description(PATIENCE_S), witness.status(PATIENCE_S)
        server.kill()
        with pytest.raises(NoServer):
            Show(stage.instance, timeout_s=0)
        assert read(show, 0).run_id == server.run_id


# At 1 Hz the reader gets no frame of the first server, so that the second one's frame is its first.
@pytest.mark.parametrize("rate", ["20", "1"])
def test_what_a_killed_second_server_has_sent_is_returned_to_a_reader_of_frames(stage, rate):
    first = stage.serve("--rate", rate)
    with Show(stage.instance) as show, Show(stage.instance) as witness:
        show.status(PATIENCE_S)
        first.kill()
        second = stage.serve("--rate", "20")
        while show.wait(PATIENCE_S).header.run_id != second.run_id:
            pass
        while witness.status(PATIENCE_S).run_id != second.run_id or witness.description().run_id != second.run_id:
            assert witness.wait(PATIENCE_S) is not None
        second.kill()
        with pytest.raises(NoServer):
            Show(stage.instance, timeout_s=0)
        assert (show.status(0).run_id, show.description(0).run_id) == (second.run_id, second.run_id)


def test_the_events_of_commands_have_sender_and_outcome(stage):
    server = stage.serve("--rate", "20")
    with Show(stage.instance) as show:
        tick = show.speed(0.75)
        with pytest.raises(Refused):
            show.release()
        stage.run("ctl", "hold")
        events = []
        while not events or events[-1].event_kind is not EventKind.HOLD:
            news = show.command_events(PATIENCE_S)
            assert news != [], "no event in time, although a command was sent"
            events += news
        assert show.command_events() == []
    start, speed, release, hold = events
    assert [event.number for event in events] == [0, 1, 2, 3]
    assert {event.run_id for event in events} == {server.run_id}
    assert (start.event_kind, start.sent_by, start.is_accepted) == (EventKind.START, Sender.SERVER, True)
    assert (speed.event_kind, speed.sent_by, speed.pid, speed.values[0]) == (EventKind.SPEED, Sender.CLIENT, os.getpid(), 0.75)
    assert (speed.tick, speed.is_accepted, speed.reason) == (tick, True, None)
    assert (release.event_kind, release.is_accepted, release.reason) == (EventKind.RELEASE, False, Refusal.NOT_HELD)
    assert (hold.sent_by, str(hold.sent_by), hold.show_time_s >= speed.show_time_s) == (Sender.CTL, "ctl", True)
    assert abs(hold.wall_ns / 1e9 - time.time()) < 3600
    server.stop()


def test_alerts_wait_for_a_server(stage):
    first = stage.serve("--rate", "20")
    servers = []
    with Show(stage.instance) as show:
        first.stop()
        for timeout_s in (0, 0.1):
            with pytest.raises(NoServer, match=f'no server runs on instance "{stage.instance}"'):
                show.alerts(timeout_s)
        thread = threading.Thread(target=lambda: servers.append(serve_with_alerts(stage)))
        thread.start()
        news = show.alerts(PATIENCE_S)
        thread.join(PATIENCE_S)
        assert not thread.is_alive(), f"the other thread still runs after {PATIENCE_S} s"
        [(second, monitor)] = servers
        assert {alert.run_id for alert in news} == {second.run_id}
        monitor.terminate()
        monitor.wait(PATIENCE_S)
    second.stop()


def serve_with_alerts(stage):
    """Starts a server whose benches come near each other, and a monitor that sends alerts."""
    server = stage.serve("--rate", "50", "--start-at", "411")
    return server, stage.start("monitor")


def test_the_alerts_are_those_that_the_monitor_prints(stage):
    server = stage.serve("--readers", "2", "--rate", "50", "--time-scale", "4", "--start-at", "412", "--until", "413")
    with Show(stage.instance) as show:
        assert show.alerts() == []
        monitor = stage.start("monitor", "--format", "json")
        heard = []
        while AlertKind.CONTACT not in [alert.alert_kind for alert in heard]:
            news = show.alerts(PATIENCE_S)
            assert news != [], "no alert in time, although a contact lies ahead"
            heard += news
        server.summary()
        monitor.terminate()
        lines = map(json.loads, monitor.stdout.read().splitlines())
        heard += show.alerts()
        assert [line_of(alert) for alert in heard] == [line for line in lines if line["type"] == "alert"]
        [contact] = [alert for alert in heard if alert.alert_kind is AlertKind.CONTACT]
        assert abs(contact.show_time_s - 412.473838) < 1e-6
        assert (contact.pair, contact.clearance_m, str(contact.alert_kind)) == ((0, 8), 0.0, "contact")


def test_an_alert_names_a_pair_one_bench_or_none():
    none = 2**32 - 1
    pair, outside, held = (Alert(bench_a=a, bench_b=b) for a, b in [(0, 8), (3, none), (none, none)])
    assert [alert.pair for alert in (pair, outside, held)] == [(0, 8), None, None]
    assert [alert.bench for alert in (pair, outside, held)] == [None, 3, None]


def line_of(alert):
    """Returns an alert as the JSON line that a monitor prints."""
    return {
        "type": "alert",
        "kind": str(alert.alert_kind),
        "time_s": alert.show_time_s,
        "tick": alert.tick,
        "run_id": alert.run_id,
        "benches": alert.pair and list(alert.pair),
        "bench": alert.bench,
        "clearance_m": alert.pair and alert.clearance_m,
        "point_m": alert.pair and list(alert.point_m),
        "forecast_s": alert.forecast_s,
    }


@pytest.mark.parametrize(
    ("end", "state", "text"),
    [
        ("stop", SourceState.ENDED, "no server runs on instance .*: the run has ended"),
        ("kill", SourceState.LOST, "no server runs on instance .*: the run was cut off"),
        ("suspend", SourceState.HANGING, "the server on instance .* has sent no frame for 0.1 s"),
    ],
)
def test_ended_lost_and_hanging_servers_differ(stage, end, state, text):
    server = stage.serve("--rate", "50")
    with Show(stage.instance) as show:
        assert show.wait(PATIENCE_S) is not None
        assert show.source(PATIENCE_S) is SourceState.PUBLISHING
        getattr(server, end)()
        with pytest.raises(NoServer, match=text):
            for _ in show.frames(0.1):
                pass
        assert show.source(0.1) is state
    if end == "suspend":
        server.process.send_signal(signal.SIGCONT)
        server.stop()


def test_a_reader_reports_what_it_has_read(stage):
    server = stage.serve("--rate", "50")
    with Show(stage.instance, name="py-reader") as show:
        deadline_s = time.monotonic() + PATIENCE_S
        for _ in show.frames(PATIENCE_S):
            lamps = json.loads(stage.run("ctl", "status", "--format", "json").stdout)["lamps"]
            [readers] = [lamp for lamp in lamps if lamp["name"] == "readers"]
            if readers["level"] == "good":
                break
            assert time.monotonic() < deadline_s, f"waited {PATIENCE_S} s for the report of the reader: {readers}"
    server.stop()
