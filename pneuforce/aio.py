"""Force sensor for asyncio: `async with pneuforce.aio.connect(url) as sensor`."""

from pneuforce.client.async_sensor import AsyncForceSensor, AsyncHold, connect

__all__ = ["AsyncForceSensor", "AsyncHold", "connect"]
