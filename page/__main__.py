"""`python -P -m page`: serves the page of a running instrument until its stdin ends.

What it is to do is one line of JSON on stdin: "socket", "host", "port", "allow", "token". It answers with one
line on stdout: {"page": port}, or {"page": null, "why": sentence} where it cannot serve. From then on it says
{"beat": n} each second, for a page that hangs has neither an end nor a complaint.
"""

from __future__ import annotations

import asyncio
import errno
import json
import logging
import os
import select
import socket
import sys
import time
from contextlib import suppress
from itertools import count
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

from uvicorn import Config, Server

from page.app import Parts, application
from page.client import Instrument
from page.connection import in_crowd
from page.crowd import Crowd
from page.door import AT_ONCE, door
from page.streams import NOTHING, Streams
from page.tokens import Tokens
from page.view import View

TICK_S = 0.05
BEAT_S = 1.0
NICER = 5  #: the instrument goes first, where the machine is busy
SIGN_OF_LIFE_S = 10.0


class Options(NamedTuple):
    """What the page is told at its start."""

    socket: str
    host: str
    port: int
    allow: list[str]
    token: str


class PageServer(Server):
    """A server that ends at once: what still streams is not waited for."""

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:  # noqa: ARG002
        """End, on a signal."""
        self.end()

    def end(self) -> None:
        """End."""
        self.should_exit = self.force_exit = True


def parts_of(options: Options) -> Parts:
    """What a page with these options is made of. Raises ValueError where `allow` names no network."""
    view = View()
    return Parts(
        view=view,
        instrument=Instrument(Path(options.socket), view),
        streams=Streams(),
        crowd=Crowd(options.allow),
        tokens=Tokens(options.token),
    )


def server_of(parts: Parts) -> PageServer:
    """What serves these parts over HTTP."""
    return PageServer(
        Config(
            application(parts),
            http=in_crowd(parts.crowd),
            ws="none",
            lifespan="off",
            proxy_headers=False,  # who asks is who has connected
            server_header=False,
            access_log=False,
            log_config=None,
            backlog=AT_ONCE,
            log_level=logging.CRITICAL,  # what others send us wrongly is no line of the log
        )
    )


async def serve(parts: Parts, server: PageServer, bound: socket.socket) -> None:
    """Serve until the server ends."""
    async with asyncio.TaskGroup() as work:
        tasks = [work.create_task(parts.instrument.follow()), work.create_task(_tell(parts))]
        await server.serve([bound])
        parts.streams.end()
        for task in tasks:
            task.cancel()


async def _tell(parts: Parts) -> None:
    """Have each browser told what is due, and now and then that nothing is."""
    alive_s = 0.0
    while True:
        now_s = time.monotonic()
        parts.streams.send(parts.view.due(now_s), now_s)
        if now_s >= alive_s:
            alive_s = now_s + SIGN_OF_LIFE_S
            parts.streams.send_bytes(NOTHING, now_s)
        await asyncio.sleep(TICK_S)


async def _run(options: Options, bound: socket.socket) -> None:
    parts = parts_of(options)
    server = server_of(parts)
    asyncio.get_running_loop().add_reader(sys.stdin.fileno(), _read_on, server)
    print(json.dumps({"page": bound.getsockname()[1]}), flush=True)
    beating = asyncio.create_task(_beat(sys.stdout.fileno()))
    await serve(parts, server, bound)
    beating.cancel()


async def _beat(told: int) -> None:
    """Say each second that this loop turns, where there is room for it and somebody hears it."""
    for number in count(1):
        await asyncio.sleep(BEAT_S)
        with suppress(OSError):
            if select.select((), (told,), (), 0)[1]:
                os.write(told, b'{"beat": %d}\n' % number)


def _read_on(server: PageServer) -> None:
    if not os.read(sys.stdin.fileno(), 4096):
        asyncio.get_running_loop().remove_reader(sys.stdin.fileno())
        server.end()


def main() -> int:
    """Run the page; returns the exit code."""
    os.nice(NICER)
    logging.basicConfig(format="%(message)s")
    facts: dict[str, Any] = json.loads(sys.stdin.readline() or "null")
    options = Options(**facts)
    try:
        bound = door(options.host, options.port)
    except OSError as error:
        busy = error.errno == errno.EADDRINUSE
        why = "it is in use by another program; change [page] port" if busy else error.strerror or str(error)
        sentence = f"the page cannot listen on {options.host}:{options.port}: {why}"
        print(json.dumps({"page": None, "why": sentence}), flush=True)
        return 1
    asyncio.run(_run(options, bound))
    return 0


if __name__ == "__main__":
    sys.exit(main())
