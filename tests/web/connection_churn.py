"""`python -m tests.web.connection_churn PORT`: keep 400 connections open that send nothing.

A connection that is closed is opened again at once. Half of the connections close immediately. The other half
wait until the web server closes them.
"""

import asyncio
import sys


async def connect(port, stays):
    """Connect again and again."""
    while True:
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            if stays:
                await reader.read(1)
            writer.close()
        except OSError:
            await asyncio.sleep(0.001)


async def churn(port):
    """Start all connections and print one line."""
    tasks = [asyncio.create_task(connect(port, stays)) for stays in (True, False) for _ in range(200)]
    print("started", flush=True)
    await asyncio.gather(*tasks)


asyncio.run(churn(int(sys.argv[1])))
