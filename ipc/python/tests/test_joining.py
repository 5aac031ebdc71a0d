"""Joining and leaving: without a server, with a wrong directory, and in any order."""

import contextlib
import os
import signal
import subprocess
import threading

import pytest
from bench_dragon import (
    BusError,
    Domain,
    DomainError,
    NoServer,
    Show,
    ShowState,
    TooManyClients,
    VersionMismatch,
)
from stage import EXAMPLES, PATIENCE_S, read_until

LOOP = """
import sys
from bench_dragon import Show
show = Show(sys.argv[1])
for frame in show:
    positions = frame.positions
    print(frame.header.tick, flush=True)
"""


def test_the_domain_of_an_instance_is_the_one_that_the_program_prints(stage):
    domain = Domain(stage.instance)
    assert (domain.root, domain.prefix) == (stage.root, stage.prefix)


@pytest.mark.parametrize("name", ["", "Dragon", "a b", "a/b", "..", "dragön", "a\n", "a" * 25])
def test_a_bad_name_is_refused(name):
    with pytest.raises(DomainError, match="must be 1 to 24 of a-z, 0-9 and -"):
        Show(name)


def test_without_a_server_a_client_raises_no_server_and_leaves_no_files(stage):
    for timeout_s in (0, 0.1):
        with pytest.raises(NoServer, match=f'no server runs on instance "{stage.instance}"'):
            Show(stage.instance, timeout_s=timeout_s)
    assert stage.remains() == []


def test_a_client_waits_for_a_server_that_starts_later(stage):
    run_ids = []

    def read():
        with Show(stage.instance) as show:
            run_ids.append(show.wait(PATIENCE_S).header.run_id)

    reader = threading.Thread(target=read)
    reader.start()
    server = stage.serve("--rate", "50")
    reader.join(PATIENCE_S)
    assert not reader.is_alive(), f"the other thread still runs after {PATIENCE_S} s"
    assert run_ids == [server.run_id]
    server.stop()


def test_a_closed_client_reads_no_more(stage):
    server = stage.serve("--rate", "50")
    with Show(stage.instance) as show:
        assert show.wait(PATIENCE_S) is not None
    show.close()
    with pytest.raises(ValueError, match=f'the client of instance "{stage.instance}" is closed'):
        show.receive()
    assert show.lost == 0
    server.stop()


def test_others_may_not_write_into_the_directory(stage):
    server = stage.serve("--rate", "50")
    stage.root.chmod(0o777)
    with pytest.raises(DomainError, match="has mode 0777, must not be writable by others: chmod 0700 it"):
        Show(stage.instance)
    stage.root.chmod(0o700)
    server.stop()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a directory away")
def test_the_directory_must_be_the_users_own(stage):
    server = stage.serve("--rate", "50")
    os.chown(stage.root, 12345, -1)
    with pytest.raises(DomainError, match=r"belongs to user 12345, must belong to user 0"):
        Show(stage.instance)
    os.chown(stage.root, 0, -1)
    server.stop()


def test_the_runtime_directory_must_exist_and_be_short(stage, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/nowhere")
    with pytest.raises(DomainError, match="XDG_RUNTIME_DIR is /nowhere, must be an existing directory"):
        Show(stage.instance, timeout_s=0)
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/" + "a" * 60)
    with pytest.raises(DomainError, match="under 60 bytes"):
        Show(stage.instance)


@pytest.mark.parametrize(("name", "shown"), [(b"\xff", "\ufffd"), ("\u00fc".encode(), "\u00fc"), (b'"', '"'), (b"*", "*"), (b"\x1b", "\ufffd")])
def test_a_runtime_directory_with_other_characters_is_refused_as_by_the_program(stage, monkeypatch, name, shown):
    monkeypatch.setenv("XDG_RUNTIME_DIR", os.fsdecode(b"/tmp/" + name))
    with pytest.raises(DomainError) as refused:
        Show(stage.instance)
    assert str(refused.value).startswith(f"the bus directory is /tmp/{shown}/bench-dragon/{stage.instance}, must be")
    assert str(refused.value) in stage.run("iox2-config").stderr


STOCK_NODE = """
import ctypes, sys
import iceoryx2 as iox2
config = iox2.config.default()
config.global_cfg.root_path = iox2.Path.new(sys.argv[1])
config.global_cfg.prefix = iox2.FileName.new(sys.argv[2])
node = iox2.NodeBuilder.new().config(config).create(iox2.ServiceType.Ipc)
frames = node.service_builder(iox2.ServiceName.new("bench-dragon/frames"))
"""

OTHER_LAYOUT = STOCK_NODE + """
import fcntl
# A source holds this lock.
lock = open(sys.argv[1] + "/source.lock", "w")
fcntl.flock(lock, fcntl.LOCK_EX)
service = frames.publish_subscribe(iox2.Slice[ctypes.c_uint8]).create()
print("created", flush=True)
sys.stdin.read()
"""


def start_stock(stage, script, ready):
    """Starts a program of the stock package, in a process of its own, and waits until it prints `ready`."""
    stock = stage.start_python("-c", script, str(stage.root), stage.prefix, stdin=subprocess.PIPE)
    assert stock.stdout.readline() == ready + "\n"
    return stock


def test_a_server_with_another_layout_is_a_version_mismatch(stage):
    stage.root.mkdir(mode=0o700, parents=True)
    stage.root.parent.chmod(0o700)
    other = start_stock(stage, OTHER_LAYOUT, "created")
    with pytest.raises(VersionMismatch, match="bench-dragon/frames has another layout than this program's"):
        Show(stage.instance)
    other.kill()
    other.wait(PATIENCE_S)
    with pytest.raises(NoServer):
        Show(stage.instance, timeout_s=0)


@pytest.mark.parametrize("name", ["", "x" * 129, "b\u00e4r", "a\nb"])
def test_a_bad_name_of_a_client_is_refused(stage, name):
    server = stage.serve("--rate", "50")
    with pytest.raises(ValueError, match="^name is \".*\", must be 1 to 128 printable ASCII characters$"):
        Show(stage.instance, name=name)
    server.stop()


@pytest.mark.parametrize("end", ["stop", "kill"])
def test_the_services_that_another_reader_keeps_are_no_server(stage, end):
    server = stage.serve("--rate", "50")
    with Show(stage.instance):
        getattr(server, end)()
        with pytest.raises(NoServer):
            Show(stage.instance, timeout_s=0)


def test_too_few_open_files_are_out_of_resources(stage):
    server = stage.serve("--rate", "50")
    script = f"""
import resource
from bench_dragon import OutOfResources, Show
resource.setrlimit(resource.RLIMIT_NOFILE, (16, 16))
try:
    Show("{stage.instance}")
except OutOfResources as error:
    print(error)
"""
    printed = stage.start_python("-c", script).stdout.read()
    assert printed.startswith("this process may not open the 48 more files that it needs: raise the limit")
    server.stop()


LIE = STOCK_NODE + """
from bench_dragon import FrameHeader, HandleState
service = frames.publish_subscribe(iox2.Slice[HandleState]).user_header(FrameHeader).open()
publisher = service.publisher_builder().initial_max_slice_len(3).create()
sample = publisher.loan_slice_uninit(3)
sample.user_header().contents.bench_count = 10**9
sample.assume_init().send()
print("published", flush=True)
sys.stdin.read()
"""


def test_a_frame_with_fewer_handles_than_its_header_has_is_refused(stage):
    server = stage.serve("--rate", "10")
    with Show(stage.instance) as show:
        other = start_stock(stage, LIE, "published")
        with pytest.raises(VersionMismatch, match="bench-dragon/frames has another layout"):
            read_until(show, "another dragon", lambda header: header.bench_count != 223)
        other.kill()
        other.wait(PATIENCE_S)
    server.stop()


def test_one_reader_too_many_is_refused(stage):
    server = stage.serve("--rate", "10")
    with contextlib.ExitStack() as crowd:
        for _ in range(24):
            crowd.enter_context(Show(stage.instance))
        with pytest.raises(TooManyClients, match="has as many clients as it allows: stop one of them"):
            Show(stage.instance)
    server.stop()


def test_ctrl_c_ends_the_example(stage):
    server = stage.serve("--rate", "50")
    example = stage.start_python(str(EXAMPLES / "head.py"), stage.instance)
    assert example.stdout.readline().partition(" s: front hinge ")[2] != ""
    example.send_signal(signal.SIGINT)
    assert example.wait(PATIENCE_S) == 0
    server.stop()


def test_ctrl_c_ends_a_wait_for_a_server(stage):
    script = "import sys; from bench_dragon import Show; print(flush=True); Show(sys.argv[1])"
    waiting = stage.start_python("-c", script, stage.instance)
    waiting.stdout.readline()
    waiting.send_signal(signal.SIGINT)
    assert waiting.wait(PATIENCE_S) == -signal.SIGINT


def test_the_last_process_to_leave_removes_everything_even_while_it_holds_a_frame(stage):
    server = stage.serve("--rate", "50")
    reader = stage.start_python("-c", LOOP, stage.instance, stderr=subprocess.PIPE)
    reader.stdout.readline()
    server.stop()
    assert stage.remains() != [], "the reader is still a member"
    reader.send_signal(signal.SIGINT)
    assert reader.wait(PATIENCE_S) == -signal.SIGINT
    assert reader.stderr.read().splitlines()[-1] == "KeyboardInterrupt", "the reader prints no other error"
    assert stage.remains() == []


def test_two_clients_of_one_process_leave_one_by_one(stage):
    server = stage.serve("--rate", "50")
    first, second = Show(stage.instance), Show(stage.instance)
    server.stop()
    first.close()
    assert stage.remains() != []
    second.latest()
    second.close()
    assert stage.remains() == []


def test_the_server_removes_the_files_of_a_killed_reader(stage):
    server = stage.serve("--rate", "50")
    reader = stage.start_python("-c", LOOP, stage.instance)
    reader.stdout.readline()
    reader.kill()
    reader.wait(PATIENCE_S)
    with Show(stage.instance) as show:
        assert show.wait(PATIENCE_S) is not None
    server.stop()
    assert stage.remains() == []


def test_the_next_process_removes_the_files_of_a_reader_killed_after_the_server_left(stage):
    server = stage.serve("--rate", "50")
    reader = stage.start_python("-c", LOOP, stage.instance)
    reader.stdout.readline()
    server.stop()
    reader.kill()
    reader.wait(PATIENCE_S)
    with pytest.raises(NoServer):
        Show(stage.instance, timeout_s=0)
    assert stage.remains() == []


def test_the_next_process_removes_the_files_of_a_killed_server(stage):
    server = stage.serve("--rate", "50")
    server.kill()
    with pytest.raises(NoServer):
        Show(stage.instance, timeout_s=0)
    assert stage.remains() == []


@pytest.mark.parametrize("timeout_s", [-1, float("nan")])
def test_a_negative_timeout_or_nan_is_refused(timeout_s):
    with pytest.raises(ValueError, match="timeout_s is .*, must be at least 0"):
        Show("nobody-is-there", timeout_s=timeout_s)


@pytest.mark.parametrize("use", [Show.wait, lambda show: next(iter(show)), lambda show: show.alerts(None)])
def test_closing_from_another_thread_ends_every_wait(stage, use):
    server = stage.serve("--rate", "50")
    show = Show(stage.instance)
    show.alerts()
    server.stop()
    show.latest()
    ended = []

    def wait():
        with pytest.raises(ValueError, match=f'the client of instance "{stage.instance}" is closed'):
            use(show)
        ended.append(True)

    threads = [threading.Thread(target=wait) for _ in range(3)]
    for thread in threads:
        thread.start()
    show.close()
    for thread in threads:
        thread.join(PATIENCE_S)
    assert ended == [True] * 3


def test_several_threads_read_one_client_and_each_frame_goes_to_one_of_them(stage):
    server = stage.serve("--readers", "1", "--rate", "200", "--until", "1")
    ticks = []
    with Show(stage.instance) as show:

        def read():
            with contextlib.suppress(ValueError):
                for frame in show:
                    ticks.append(frame.header.tick)
                    if frame.header.show_state is ShowState.ENDED:
                        show.close()

        # Each holds two frames: the current and the next one.
        threads = [threading.Thread(target=read) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(PATIENCE_S)
    assert sorted(ticks) == list(range(server.summary()["frames"]))


def test_waiting_for_a_server_is_logged_once(stage):
    script = "import sys; from bench_dragon import Show; Show(sys.argv[1], timeout_s=0.3)"
    waiting = stage.start_python("-c", script, stage.instance, stderr=subprocess.PIPE)
    lines = waiting.communicate(timeout=PATIENCE_S)[1].splitlines()
    command = f"`bench-dragon serve --config FILE --held --instance {stage.instance}`"
    hint = f'no server runs on instance "{stage.instance}": start the show, or by hand {command}'
    assert lines[0] == f"waiting: {hint}"
    assert [line for line in lines[1:] if line.startswith("waiting")] == []
