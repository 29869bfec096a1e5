"""Daemon threads for calls that may block for long, for example to open a port."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from threading import Thread
from typing import Any, TypeVar

Result = TypeVar("Result")


async def run_in_background(call: Callable[[], Result]) -> Result:
    """Run `call` in a new daemon thread. Return its result, or raise its exception.

    A process that ends does not wait for a daemon thread. It would wait for the worker threads of asyncio.
    """
    return await asyncio.wrap_future(start_in_background(call))


def start_in_background(call: Callable[[], Result]) -> Future[Result]:
    """Start `call` in a new daemon thread, and return the future of its result."""
    outcome: Future[Result] = Future()
    outcome.set_running_or_notify_cancel()  # a cancelled caller must not cancel the outcome
    Thread(target=_run, args=(call, outcome), name="background", daemon=True).start()
    return outcome


def _run(call: Callable[[], Result], outcome: Future[Result]) -> None:
    try:
        result = call()
    except BaseException as error:
        outcome.set_exception(error)
    else:
        outcome.set_result(result)


async def cancel_on(stop: asyncio.Event, work: Coroutine[Any, Any, Result]) -> Result | None:
    """Run `work`. Return its result, or raise its exception.

    If `stop` is set first, cancel `work` and return None.
    """
    working, stopping = asyncio.ensure_future(work), asyncio.ensure_future(stop.wait())
    try:
        await asyncio.wait({working, stopping}, return_when=asyncio.FIRST_COMPLETED)
        return working.result() if working.done() else None
    finally:
        working.cancel()
        stopping.cancel()
