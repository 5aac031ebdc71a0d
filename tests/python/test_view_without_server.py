"""A view before, between and after servers."""

import json
import os
import signal
import subprocess

from view import TIMEOUT_S, next_frame, viewing

PROGRAM = os.environ["BENCH_DRAGON"]
INSTANCE = os.environ["BENCH_DRAGON_INSTANCE"]


def serve():
    process = subprocess.Popen([PROGRAM, "serve", "--rate", "100", "--format", "json", "--instance", INSTANCE], stdout=subprocess.PIPE, text=True)
    return process, json.loads(process.stdout.readline())["run_id"]


def until(stream, is_wanted):
    """Reads messages up to the first wanted one, and acknowledges frames."""
    while True:
        _, told = next_message(stream)
        if told is not None and is_wanted(told):
            return told


def next_message(stream):
    message = stream.recv(timeout=TIMEOUT_S)
    if isinstance(message, bytes):
        sequence = int.from_bytes(message[4:8], "little")
        stream.send(json.dumps({"ack": sequence}))
        return message, None
    return None, json.loads(message)


def link(state):
    return lambda told: told["type"] == "status" and told["link"]["state"] == state


def test_a_page_gets_the_start_the_silence_the_death_and_the_restart_of_the_server():
    with viewing(PROGRAM, INSTANCE) as view, view.stream() as stream:
        assert until(stream, lambda told: told["type"] == "status")["link"]["state"] == "waiting"
        refused, text = view.command({"command": "pause"})
        assert refused == 503 and "no server runs" in json.loads(text)["error"]

        server, run_id = serve()
        assert until(stream, lambda told: told["type"] == "run")["run_id"] == run_id
        until(stream, link("live"))

        server.send_signal(signal.SIGSTOP)
        assert until(stream, link("silent"))["link"]["age_s"] > 0.5
        server.send_signal(signal.SIGCONT)
        until(stream, link("live"))

        server.kill()
        server.wait(TIMEOUT_S)
        assert until(stream, link("gone"))["link"]["age_s"] > 0

        server, run_id = serve()
        assert until(stream, lambda told: told["type"] == "run")["run_id"] == run_id
        restarted = until(stream, link("live"))
        assert restarted["traffic"]["restarts"] >= 1
        frame, _ = next_frame(stream)
        assert frame.benches == 223
        server.terminate()
        assert server.wait(TIMEOUT_S) == 0
        until(stream, link("ended"))
