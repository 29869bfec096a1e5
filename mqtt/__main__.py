"""MQTT process: `python -P -m pneuforce.mqtt` publishes the values of an instrument until stdin is closed.

stdin: one line of JSON with the path of the local socket and the settings of the publisher.
stdout: one line {"port": port of the broker} at the start. Then each second {"heartbeat": n, "connected":
bool, "stored" and "lost": numbers of records, "certificate_days": number or null}. A missing heartbeat means
that the process hangs.
"""

from __future__ import annotations

import asyncio
import gc
import logging
import resource
import sys
import time
from itertools import count
from pathlib import Path
from typing import Any

from pneuforce.mqtt.instrument_link import InstrumentLink
from pneuforce.mqtt.publisher import Publisher, PublisherSettings
from pneuforce.support.child_messages import call_at_end_of_stdin, read_options, send, send_heartbeat
from pneuforce.support.priority import reduce_priority
from pneuforce.support.together import run_together

HEARTBEAT_PERIOD_S = 1.0
CERTIFICATE_HEARTBEATS = 10  #: heartbeats after which the certificate is read again
#: Limit of the memory. A message that is too long ends the connection. Without this limit, the message could
#: use the memory of the systemd unit, to which the host process also belongs.
MAX_MEMORY_BYTES = 160_000_000
NICENESS = 5  #: reduces the priority, so that the host process runs first on a busy machine


async def publish(publisher: Publisher, socket: Path, address: str) -> None:
    """Publish the values of the instrument at a local socket until cancelled."""
    link = InstrumentLink(socket, address, publisher)
    await run_together(link.run(), publisher.run(), _execute_vents(publisher, link))


async def _execute_vents(publisher: Publisher, link: InstrumentLink) -> None:
    """Execute the requested vents. Vents that arrive during a vent cause one more vent."""
    while True:
        await publisher.vent_requested.wait()
        publisher.vent_requested.clear()
        publisher.on_vent_result(await link.vent())


async def _send_heartbeats(publisher: Publisher) -> None:
    for number in count(1):
        await asyncio.sleep(HEARTBEAT_PERIOD_S)
        if number % CERTIFICATE_HEARTBEATS == 1:
            days = publisher.certificate_days(time.time())
        store = publisher.outbox.store
        beat = {"heartbeat": number, "connected": publisher.connected, "certificate_days": days}
        send_heartbeat(beat | {"stored": store.count, "lost": store.lost})


def ignore_closed_sockets(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Ignore an error of a socket that aiomqtt has closed: the publisher connects again."""
    if not isinstance(context.get("exception"), OSError):
        loop.default_exception_handler(context)


async def _run(settings: PublisherSettings, socket: Path) -> None:
    asyncio.get_running_loop().set_exception_handler(ignore_closed_sockets)
    publisher = Publisher(settings)
    publishing = asyncio.create_task(publish(publisher, socket, settings.host))
    heartbeats = asyncio.create_task(_send_heartbeats(publisher))
    call_at_end_of_stdin(publishing.cancel)
    send({"port": settings.port})
    await asyncio.wait([publishing])
    heartbeats.cancel()
    publisher.close()
    await _end_cancelled_connection()
    if not publishing.cancelled():
        publishing.result()


async def _end_cancelled_connection() -> None:
    """Close a connection to the broker that was cancelled while a thread of aiomqtt opened it.

    aiomqtt needs the event loop to close its socket.
    """
    await asyncio.get_running_loop().shutdown_default_executor()
    gc.collect()
    await asyncio.sleep(0)


def main() -> int:
    """Run the MQTT process. Return the exit code."""
    reduce_priority(NICENESS)
    resource.setrlimit(resource.RLIMIT_DATA, (MAX_MEMORY_BYTES, MAX_MEMORY_BYTES))
    logging.basicConfig(format="%(message)s")
    options = read_options()
    socket = Path(options.pop("socket"))
    asyncio.run(_run(PublisherSettings(**options), socket))
    return 0


if __name__ == "__main__":
    sys.exit(main())
