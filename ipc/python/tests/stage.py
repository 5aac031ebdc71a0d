"""An instance for one test, and the program's processes on it."""

import itertools
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

PROGRAM = os.environ["BENCH_DRAGON"]
EXAMPLES = Path(__file__).parents[3] / "examples"
PATIENCE_S = 60.0
"""Timeout of every wait of a test, in seconds. The test fails after it."""

_NUMBERS = itertools.count()


class Stage:
    """An instance. The program reports which files belong to it, so the check does not use the package under test."""

    def __init__(self, folder):
        self.folder = folder
        self.instance = f"py-{os.getpid()}-{next(_NUMBERS)}"
        self.root, self.prefix = self.printed_domain()
        self._processes = []

    def printed_domain(self):
        """Returns root path and prefix, as the program prints them."""
        [_, root, prefix, *_] = self.run("iox2-config").stdout.splitlines()
        return Path(json.loads(root.partition(" = ")[2])), json.loads(prefix.partition(" = ")[2])

    def run(self, *args):
        """Runs a command until it ends, and returns its output."""
        return subprocess.run(self._command(args), capture_output=True, text=True, check=False, timeout=PATIENCE_S)

    def start(self, *args):
        """Starts a command."""
        return self._start(self._command(args))

    def start_python(self, *args, **options):
        """Starts a Python program. Ctrl-C can end it even if the tests run in the background."""

        def restore_ctrl_c():
            signal.signal(signal.SIGINT, signal.SIG_DFL)

        return self._start([sys.executable, *args], preexec_fn=restore_ctrl_c, **options)

    def serve(self, *args):
        """Starts a server and waits until its services exist."""
        return Server(self.start("serve", "--format", "json", *args))

    def remains(self):
        """Returns all files of this instance on the machine."""
        shared = [path for path in Path("/dev/shm").iterdir() if path.name.startswith(self.prefix)]
        return shared + ([self.root, *self.root.iterdir()] if self.root.exists() else [])

    def close(self):
        """Kills processes that a failing test has left. Returns the remaining files, and removes them."""
        for process in self._processes:
            process.kill()
            process.communicate(timeout=PATIENCE_S)
        remains = self.remains()
        shutil.rmtree(self.root, ignore_errors=True)
        for path in remains:
            if path.is_file():
                path.unlink()
        return remains

    def _command(self, args):
        return [PROGRAM, *args, "--instance", self.instance]

    def _start(self, command, **options):
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **options)
        self._processes.append(process)
        return process


class Server:
    """A running server."""

    def __init__(self, process):
        self.process = process
        started = json.loads(process.stdout.readline())
        assert started["type"] == "started"
        self.run_id = started["run_id"]

    def stop(self):
        """Ends the server by a signal and returns its summary."""
        self.process.terminate()
        return self.summary()

    def kill(self):
        """Kills the server, like a crash."""
        self.process.kill()
        self.process.wait(PATIENCE_S)

    def suspend(self):
        """Suspends the server, and waits until it stands."""
        self.process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, self.process.pid, os.WSTOPPED)

    def summary(self):
        """Waits until the server ends by itself and returns its summary."""
        last = self.process.stdout.read().splitlines()[-1]
        assert self.process.wait(PATIENCE_S) == 0
        return json.loads(last)


def read_until(show, what, is_wanted):
    """Returns the headers of all frames up to the first wanted one. `what` completes "waited until"."""
    headers = []
    deadline_s = time.monotonic() + PATIENCE_S
    for frame in show.frames(PATIENCE_S):
        headers.append(frame.header)
        if is_wanted(frame.header):
            return headers
        assert time.monotonic() < deadline_s, f"waited {PATIENCE_S} s until {what}; the last frame has tick {headers[-1].tick}"
    raise AssertionError(f"no frame for {PATIENCE_S} s while waiting until {what}; received {len(headers)} before")


def wait_for_tick(show, tick):
    """Waits until the server has published a tick, without reading frames."""
    deadline_s = time.monotonic() + PATIENCE_S
    while (seen := show.status(PATIENCE_S).tick) < tick:
        assert time.monotonic() < deadline_s, f"waited {PATIENCE_S} s until tick {tick}; the last published tick is {seen}"
        time.sleep(0.02)
