"""Coroutines that run together and end together."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any

#: A task that has not ended after this time is cancelled again. Libraries can lose a cancellation: in Python
#: 3.11, `asyncio.wait_for` ignores it if its result is ready at the same time.
CANCEL_PERIOD_S = 1.0


async def run_together(*works: Coroutine[Any, Any, None]) -> None:
    """Run coroutines until one of them ends, or until this coroutine is cancelled. Then end all others.

    Raises the exception of the coroutine that ended first.
    """
    tasks = [asyncio.create_task(work) for work in works]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        while running := [task for task in tasks if not task.done()]:
            for task in running:
                task.cancel()
            await asyncio.wait(running, timeout=CANCEL_PERIOD_S)
        await asyncio.gather(*tasks, return_exceptions=True)
