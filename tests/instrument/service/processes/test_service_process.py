"""Tests of the messages between the host and a process of its own."""

import asyncio
import time
from asyncio import StreamReader

import pytest

from pneuforce.instrument.service.processes.service_process import _read_line

HEARTBEAT = b"{}\n"


def read(time_s, sent_s, stall_s=0.0):
    """Return the line that is sent after `sent_s`. The event loop stands still for `stall_s` before."""

    async def receive():
        reader, loop = StreamReader(), asyncio.get_running_loop()
        loop.call_later(0.01, time.sleep, stall_s)
        loop.call_later(sent_s, reader.feed_data, HEARTBEAT)
        return await _read_line(reader, time_s)

    return asyncio.run(receive())


def test_a_process_that_sends_nothing_is_reported():
    with pytest.raises(TimeoutError):
        read(time_s=0.2, sent_s=60.0)


def test_a_stall_of_the_host_is_no_silence_of_the_process():
    """The host reads nothing for three times the longest silence. The heartbeat waits for it."""
    assert read(time_s=0.4, sent_s=0.5, stall_s=1.2) == HEARTBEAT
