"""Gateway process: `python -P -m pneuforce.registers.modbus_security` serves Modbus/TCP Security.

stdin: one line of JSON with the keys of `GatewayOptions`.
stdout: one line {"port": number} when the gateway listens, or {"port": null, "why": sentence} if it cannot
listen. Then one object each second, see `_heartbeat`. The process ends when stdin is closed.
"""

from __future__ import annotations

import asyncio
import logging
import socket
import sys
import time
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

from pneuforce.registers.modbus_security.gateway import Gateway
from pneuforce.support.child_messages import call_at_end_of_stdin, read_options, send, send_heartbeat
from pneuforce.support.listening import listen_failure
from pneuforce.support.priority import reduce_priority
from pneuforce.support.tls_files import TlsFiles

HEARTBEAT_PERIOD_S = 1.0
NICENESS = 5  #: reduces the priority, so that the host process runs first on a busy machine
BACKLOG = 128
MAX_REPORTS = 16  #: failures that one heartbeat reports


class GatewayOptions(NamedTuple):
    """Options of the gateway, sent by the host process as one line of JSON."""

    instrument: str  #: Unix socket on which the host accepts forwarded connections
    host: str
    port: int
    allow: list[str]
    ca: str
    certificate: str
    key: str
    crl: str = ""


def heartbeat(number: int, gateway: Gateway) -> dict[str, Any]:
    """Return the heartbeat: counters, failures since the last one, and the validity of the files."""
    failures = [(*key, times) for key, times in gateway.failures.most_common(MAX_REPORTS)]
    for address, reason, _ in failures:
        del gateway.failures[address, reason]
    counters, now_s = gateway.counters, time.time()
    return {
        "heartbeat": number,
        "handshakes": counters.handshakes,
        "failed": counters.failed.total(),
        "not_allowed": counters.not_allowed,
        "failures": failures,
        "certificate_days": gateway.tls.certificate_days(now_s),
        "list_warning": gateway.tls.list_warning(now_s),
    }


async def _send_heartbeats(gateway: Gateway) -> None:
    for number in count(1):
        send_heartbeat(heartbeat(number, gateway))
        await asyncio.sleep(HEARTBEAT_PERIOD_S)


async def _run(gateway: Gateway, listener: socket.socket) -> None:
    serving = asyncio.create_task(gateway.run(listener))
    call_at_end_of_stdin(serving.cancel)
    send({"port": listener.getsockname()[1]})
    heartbeats = asyncio.create_task(_send_heartbeats(gateway))
    with suppress(asyncio.CancelledError):
        await serving
    heartbeats.cancel()


def open_listener(host: str, port: int) -> socket.socket:
    """Return a socket that listens on an address. Raises OSError if the address is invalid or in use."""
    family, *_ = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
    return socket.create_server((host, port), family=family, backlog=BACKLOG)


def main() -> int:
    """Run the gateway. Return the exit code."""
    reduce_priority(NICENESS)
    logging.basicConfig(format="%(message)s", level=logging.WARNING)
    options = GatewayOptions(**read_options())
    files = TlsFiles(ca=options.ca, certificate=options.certificate, key=options.key, crl=options.crl)
    try:
        gateway = Gateway(files, Path(options.instrument), options.allow)
    except OSError as error:
        send({"port": None, "why": str(error)})
        return 1
    try:
        listener = open_listener(options.host, options.port)
    except OSError as error:
        why = listen_failure(error, "modbus_security", options.port)
        send({"port": None, "why": f"it cannot listen on {options.host}:{options.port}: {why}"})
        return 1
    asyncio.run(_run(gateway, listener))
    return 0


if __name__ == "__main__":
    sys.exit(main())
