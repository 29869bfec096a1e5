"""Clients that open connections again and again: `python -m tests.web.connection_churn PORT`.

400 clients open a connection and send nothing. Half of them close it at once; the others wait until the web
server closes it. Then each client opens a new connection.
"""

import asyncio
import sys


async def connect(port, stays):
    """Open connections one after the other. Close each at once or, if `stays`, after the server closes it."""
    while True:
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            if stays:
                await reader.read(1)
            writer.close()
        except OSError:
            await asyncio.sleep(0.001)


async def churn(port):
    """Start all clients and print one line."""
    tasks = [asyncio.create_task(connect(port, stays)) for stays in (True, False) for _ in range(200)]
    print("started", flush=True)
    await asyncio.gather(*tasks)


asyncio.run(churn(int(sys.argv[1])))
