"""Frames in an event loop."""

import asyncio
import select
import threading

import pytest
from bench_dragon import Show, ShowState
from stage import PATIENCE_S


def test_a_task_reads_every_frame(stage):
    server = stage.serve("--readers", "1", "--rate", "200", "--until", "1")

    async def read(show):
        ticks = []
        async for frame in show:
            ticks.append(frame.header.tick)
            if frame.header.show_state is ShowState.ENDED:
                return ticks

    with Show(stage.instance) as show:
        ticks = asyncio.run(asyncio.wait_for(read(show), PATIENCE_S))
    assert ticks == list(range(server.summary()["frames"]))


def test_cancelling_a_task_ends_its_wait_and_the_client_can_still_be_read(stage):
    first = stage.serve("--rate", "50")

    async def wait(show):
        reading = asyncio.create_task(anext(aiter(show)))
        await asyncio.sleep(0)
        reading.cancel()
        with pytest.raises(asyncio.CancelledError):
            await reading

    with Show(stage.instance) as show:
        first.stop()
        show.latest()
        asyncio.run(asyncio.wait_for(wait(show), PATIENCE_S))
        second = stage.serve("--rate", "50")
        assert show.wait(PATIENCE_S).header.run_id == second.run_id
    second.stop()


def test_closing_from_another_thread_ends_the_wait_of_a_task(stage):
    server = stage.serve("--rate", "50")

    async def wait(show):
        closing = threading.Thread(target=show.close)
        closing.start()
        with pytest.raises(ValueError, match="is closed"):
            await anext(aiter(show))
        closing.join(PATIENCE_S)

    show = Show(stage.instance)
    server.stop()
    show.latest()
    asyncio.run(asyncio.wait_for(wait(show), PATIENCE_S))


def test_the_descriptor_is_readable_as_long_as_a_frame_may_be_unread(stage):
    server = stage.serve("--rate", "50")
    with Show(stage.instance) as show:
        poll = select.poll()
        poll.register(show, select.POLLIN)
        for _ in range(5):
            assert poll.poll(PATIENCE_S * 1000) != []
            while show.receive() is not None:
                pass
        server.stop()
        assert poll.poll(PATIENCE_S * 1000) != []
        states = []
        while (frame := show.receive()) is not None:
            states.append(frame.header.show_state)
        assert states[-1] is ShowState.ENDED
        del frame
        assert show.receive() is None
        assert poll.poll(0) == []
