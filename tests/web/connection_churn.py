"""`python -m tests.page.churn PORT`: 400 connections at a time that ask nothing, begun anew as they end.

Half of them end at once, the others when the page has had enough of them.
"""

import asyncio
import sys


async def connect(port, stays):
    """Connect for ever."""
    while True:
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            if stays:
                await reader.read(1)
            writer.close()
        except OSError:
            await asyncio.sleep(0.001)


async def churn(port):
    """Begin all, and say so."""
    work = [asyncio.create_task(connect(port, stays)) for stays in (True, False) for _ in range(200)]
    print("begun", flush=True)
    await asyncio.gather(*work)


asyncio.run(churn(int(sys.argv[1])))
