"""Tests of coroutines that run together: the end of one, an error, and lost cancellations."""

import asyncio

import pytest

from pneuforce.support import together
from pneuforce.support.together import run_together


async def forever(ended):
    try:
        await asyncio.sleep(60)
    finally:
        ended.append("forever")


async def fail():
    await asyncio.sleep(0)
    raise OSError("failed")


async def lose_the_first_cancellation(ended):
    try:
        await asyncio.sleep(60)
    except asyncio.CancelledError:
        await forever(ended)


def test_the_error_of_one_ends_the_others():
    ended = []
    with pytest.raises(OSError, match="failed"):
        asyncio.run(run_together(forever(ended), fail()))
    assert ended == ["forever"]


def test_the_end_of_one_ends_the_others():
    ended = []
    asyncio.run(run_together(forever(ended), asyncio.sleep(0)))
    assert ended == ["forever"]


def test_a_lost_cancellation_is_repeated(monkeypatch):
    monkeypatch.setattr(together, "CANCEL_PERIOD_S", 0.01)
    ended = []

    async def cancel():
        running = asyncio.create_task(run_together(lose_the_first_cancellation(ended), forever(ended)))
        await asyncio.sleep(0.01)
        running.cancel()
        await asyncio.wait_for(asyncio.wait([running]), 5)
        return running.cancelled()

    assert asyncio.run(cancel())
    assert ended == ["forever", "forever"]
