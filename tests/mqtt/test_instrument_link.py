"""Tests of the connection to the instrument: the end of the process while bytes arrive."""

import asyncio
from tempfile import TemporaryDirectory

import pytest

from pneuforce.instrument.stream.entry import EntryKind, encode, json_entry
from pneuforce.mqtt.instrument_link import InstrumentLink


class Sink:
    def on_reading(self, reading, t_s):
        pass

    def on_lost(self, why):
        pass


async def cancelled_after(steps, socket):
    """Cancel a link `steps` steps of the event loop after bytes were sent. Return True if it ends."""
    streams = []
    server = await asyncio.start_unix_server(lambda _, writer: streams.append(writer), socket)
    async with server:
        running = asyncio.create_task(InstrumentLink(socket, "127.0.0.1", Sink()).run())
        while not streams:
            await asyncio.sleep(0)
        await asyncio.sleep(0.01)
        streams[0].write(encode(json_entry(EntryKind.HEADER, 0.0, {})))
        for _ in range(steps):
            await asyncio.sleep(0)
        running.cancel()
        done, _ = await asyncio.wait([running], timeout=0.3)
        running.cancel()
        streams[0].close()
        return bool(done)


@pytest.mark.parametrize("steps", range(5))
def test_the_link_ends_although_bytes_arrive_at_the_same_time(steps):
    with TemporaryDirectory() as folder:
        assert asyncio.run(cancelled_after(steps, f"{folder}/socket"))
