"""Serial lines made of ptys. Bytes that are sent at one end arrive at all other ends."""

from __future__ import annotations

import asyncio
import os
import select
import threading
import tty
from contextlib import contextmanager

from pneuforce.registers.modbus.rtu_server import ModbusRtuOptions, ModbusRtuServer
from tests.registers.modbus.serving import IDENTITY


class Cable:
    """Line whose ends can be opened as serial ports. The ends in `echoing` also receive their own bytes."""

    def __init__(self, ends=2, echoing=()):
        self._pairs = [os.openpty() for _ in range(ends)]
        for _, near in self._pairs:
            tty.setraw(near)
        self.ports = [os.ttyname(near) for _, near in self._pairs]
        self._echoing = {self._pairs[end][0] for end in echoing}
        self._ending, self._end = os.pipe()
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    def _carry(self):
        far = [far for far, _ in self._pairs]
        while True:
            for ready in select.select([*far, self._ending], [], [])[0]:
                if ready == self._ending:
                    return
                data = os.read(ready, 4096)
                for other in far:
                    if other != ready or ready in self._echoing:
                        os.write(other, data)

    def unplug(self):
        """Close all ends. Processes that have opened a port receive a hang-up."""
        os.write(self._end, b"x")
        self._thread.join()
        for descriptor in (*(fd for pair in self._pairs for fd in pair), self._end, self._ending):
            os.close(descriptor)


@contextmanager
def cable(ends=2, echoing=()):
    cable = Cable(ends, echoing)
    try:
        yield cable
    finally:
        cable.unplug()


@contextmanager
def in_a_loop(start, close):
    """Run `start()` in an event loop in a separate thread, and `close()` at the end."""
    loop = asyncio.new_event_loop()
    loop.run_until_complete(start())
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    try:
        yield
    finally:
        loop.call_soon_threadsafe(close)
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.run_until_complete(asyncio.sleep(0))
        loop.run_until_complete(loop.shutdown_default_executor())
        loop.close()


@contextmanager
def serving_on(port, source, **options):
    """Run a server on `port` in a separate thread until the block ends."""
    server = ModbusRtuServer(source, ModbusRtuOptions(port=str(port), **options), IDENTITY)
    with in_a_loop(server.start, server.close):
        yield server
