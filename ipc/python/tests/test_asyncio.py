"""Frames in an event loop."""

import asyncio
import select
import threading

import pytest
from bench_dragon import Dragon, ShowState
from stage import PATIENCE_S


def test_a_task_reads_every_frame(stage):
    server = stage.serve("--readers", "1", "--rate", "200", "--until", "1")

    async def read(dragon):
        ticks = []
        async for frame in dragon:
            ticks.append(frame.header.tick)
            if frame.header.show_state is ShowState.ENDED:
                return ticks

    with Dragon(stage.instance) as dragon:
        ticks = asyncio.run(asyncio.wait_for(read(dragon), PATIENCE_S))
    assert ticks == list(range(server.summary()["frames"]))


def test_cancelling_a_task_ends_its_wait_and_the_dragon_can_still_be_read(stage):
    first = stage.serve("--rate", "50")

    async def wait(dragon):
        reading = asyncio.create_task(anext(aiter(dragon)))
        await asyncio.sleep(0)
        reading.cancel()
        with pytest.raises(asyncio.CancelledError):
            await reading

    with Dragon(stage.instance) as dragon:
        first.stop()
        dragon.latest()
        asyncio.run(asyncio.wait_for(wait(dragon), PATIENCE_S))
        second = stage.serve("--rate", "50")
        assert dragon.wait(PATIENCE_S).header.run_id == second.run_id
    second.stop()


def test_closing_from_another_thread_ends_the_wait_of_a_task(stage):
    server = stage.serve("--rate", "50")

    async def wait(dragon):
        closing = threading.Thread(target=dragon.close)
        closing.start()
        with pytest.raises(ValueError, match="is closed"):
            await anext(aiter(dragon))
        closing.join(PATIENCE_S)

    dragon = Dragon(stage.instance)
    server.stop()
    dragon.latest()
    asyncio.run(asyncio.wait_for(wait(dragon), PATIENCE_S))


def test_the_descriptor_is_readable_as_long_as_a_frame_may_be_unread(stage):
    server = stage.serve("--rate", "50")
    with Dragon(stage.instance) as dragon:
        poll = select.poll()
        poll.register(dragon, select.POLLIN)
        for _ in range(5):
            assert poll.poll(PATIENCE_S * 1000) != []
            while dragon.receive() is not None:
                pass
        server.stop()
        assert poll.poll(PATIENCE_S * 1000) != []
        states = []
        while (frame := dragon.receive()) is not None:
            states.append(frame.header.show_state)
        assert states[-1] is ShowState.ENDED
        del frame
        assert dragon.receive() is None
        assert poll.poll(0) == []
