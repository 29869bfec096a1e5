"""Calls that may block for long, as opening a port far away: beside the loop, and no reason not to end."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from threading import Thread
from typing import Any, TypeVar

Result = TypeVar("Result")


async def aside(call: Callable[[], Result]) -> Result:
    """What `call` returns or raises, from a thread of its own.

    asyncio's threads are waited for at the end of the process; this one is left alone.
    """
    outcome: Future[Result] = Future()
    outcome.set_running_or_notify_cancel()  # else a waiter that is cancelled would cancel it
    Thread(target=_carry_out, args=(call, outcome), name="aside", daemon=True).start()
    return await asyncio.wrap_future(outcome)


def _carry_out(call: Callable[[], Result], outcome: Future[Result]) -> None:
    try:
        result = call()
    except BaseException as error:
        outcome.set_exception(error)
    else:
        outcome.set_result(result)


async def unless(stop: asyncio.Event, work: Coroutine[Any, Any, Result]) -> Result | None:
    """What `work` returns or raises; None, and the work is cancelled, where `stop` is set first."""
    working, stopping = asyncio.ensure_future(work), asyncio.ensure_future(stop.wait())
    try:
        await asyncio.wait({working, stopping}, return_when=asyncio.FIRST_COMPLETED)
        return working.result() if working.done() else None
    finally:
        working.cancel()
        stopping.cancel()
