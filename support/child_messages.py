"""Messages of a process to the host process that has started it."""

from __future__ import annotations

import asyncio
import json
import os
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from pneuforce.support.readiness import is_writable


def read_options() -> dict[str, Any]:
    """Return the options: one line of JSON from stdin."""
    options: dict[str, Any] = json.loads(sys.stdin.readline() or "null")
    return options


def send(message: Mapping[str, Any]) -> None:
    """Write a message to stdout, for the start of the process. Blocks while the pipe is full."""
    print(json.dumps(message), flush=True)


def send_heartbeat(message: Mapping[str, Any]) -> None:
    """Write a message to stdout. A full or closed pipe is ignored, so that the process never waits."""
    stdout = sys.stdout.fileno()
    with suppress(OSError):
        if is_writable(stdout, 0):
            os.write(stdout, json.dumps(message).encode() + b"\n")


def call_at_end_of_stdin(stop: Callable[[], object]) -> None:
    """Call `stop` when the host process closes stdin, because it ends."""

    def read() -> None:
        if not os.read(sys.stdin.fileno(), 4096):
            asyncio.get_running_loop().remove_reader(sys.stdin.fileno())
            stop()

    asyncio.get_running_loop().add_reader(sys.stdin.fileno(), read)
