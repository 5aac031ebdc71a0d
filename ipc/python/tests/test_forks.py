"""A forked child inherits a client. Whatever the child does with it, the parent continues to read."""

import os
import subprocess

import pytest
from stage import PATIENCE_S

WAIT = "assert os.waitpid(child, 0)[1] == 0"

PARENT = """
import gc, os, signal, sys
from bench_dragon import Show
show = Show(sys.argv[1])
frame = show.wait(60)
positions, before = frame.positions, frame.positions.tolist()
show.description(60), show.status(60), show.alerts(), show.resume(60)
if (child := os.fork()) == 0:
    # Ends a child that hangs.
    signal.alarm(60)
    {child}
{wait}
tick = show.pause(60)
for next_frame in show.frames(60):
    if next_frame.header.tick >= tick:
        break
assert positions.tolist() == before
assert show.description(0).run_id == show.status(0).run_id == frame.header.run_id
show.alerts(0.01)
print("read on", flush=True)
{end}
"""

CHILDREN = {
    "exits": "sys.exit()",
    "drops everything": """
    show.close()
    del show, frame, positions
    gc.collect()
    os._exit(0)
""",
    "forks": """
    if (grandchild := os.fork()) == 0:
        sys.exit()
    sys.exit(os.waitpid(grandchild, 0)[1])
""",
    "uses it": """
    with show:
        for use in (show.receive, show.status, show.alerts, show.pause, lambda: next(show.frames())):
            try:
                use()
            except ValueError as error:
                text = f'the client of instance "{sys.argv[1]}" was opened in another process: open one here'
                assert str(error) == text
            else:
                os._exit(1)
    assert positions.tolist() == before
    sys.exit()
""",
    "opens its own": """
    with Show(sys.argv[1]) as own:
        assert own.wait(60).header.run_id == frame.header.run_id
        own.resume(60)
    del own
    sys.exit()
""",
}

EXITS, CLOSES = "sys.exit()", "del frame, next_frame, positions; show.close(); sys.exit()"
IS_KILLED = "os.kill(os.getpid(), signal.SIGKILL)"


@pytest.mark.parametrize("child", CHILDREN)
@pytest.mark.parametrize("end", [EXITS, CLOSES], ids=["exits", "closes"])
def test_the_parent_of_a_forked_child_continues_to_read(stage, child, end):
    server = stage.serve("--rate", "50")
    script = PARENT.format(child=CHILDREN[child], wait=WAIT, end=end)
    parent = stage.start_python("-c", script, stage.instance, stderr=subprocess.PIPE)
    assert parent.communicate(timeout=PATIENCE_S) == ("read on\n", "")
    server.stop()


@pytest.mark.parametrize("end", [EXITS, IS_KILLED], ids=["exits", "is killed"])
def test_a_child_that_outlives_its_parent_does_not_keep_the_instance(stage, end):
    server = stage.serve("--rate", "50")
    # The child lives until this test closes its standard input.
    child = "os.close(1); sys.stdin.read(); sys.exit()"
    script = PARENT.format(child=child, wait="", end=end)
    stdin, held = os.pipe()
    parent = stage.start_python("-c", script, stage.instance, stdin=stdin)
    os.close(stdin)
    assert parent.stdout.read() == "read on\n"
    parent.wait(PATIENCE_S)
    server.stop()
    assert stage.remains() == []
    os.close(held)
