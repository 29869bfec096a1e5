"""Web process: `python -P -m pneuforce.web` serves the web page of an instrument until stdin is closed.

stdin: one line of JSON with the keys of `WebProcessOptions`.
stdout: one line {"port": number} when the server listens, or {"port": null, "why": sentence} if the server
cannot listen. Then {"heartbeat": n, "recording": bool, "certificate_days": number or null} each second. A
missing heartbeat means that the process hangs.
"""

from __future__ import annotations

import asyncio
import logging
import socket
import sys
import time
from itertools import count
from pathlib import Path
from typing import NamedTuple

from pneuforce.support.child_messages import call_at_end_of_stdin, read_options, send, send_heartbeat
from pneuforce.support.listening import listen_failure
from pneuforce.support.priority import reduce_priority
from pneuforce.support.renewed_context import RenewedContext
from pneuforce.support.tls_files import TlsFiles
from pneuforce.web.app import WebServices, create_app
from pneuforce.web.browser_feed import BrowserFeed
from pneuforce.web.earlier_events import EarlierEvents
from pneuforce.web.event_stream import KEEP_ALIVE, EventBroadcaster
from pneuforce.web.instrument_client import InstrumentClient
from pneuforce.web.login.login import Logins
from pneuforce.web.login.login_events import REPORT_PERIOD_S
from pneuforce.web.login.sessions import WebSessions
from pneuforce.web.login.user_directory import UserDirectory
from pneuforce.web.page_recorder import PageRecorder, RecordingFolder
from pneuforce.web.server.connection_limiter import ConnectionLimiter
from pneuforce.web.server.listener import open_listener
from pneuforce.web.server.web_server import WebServer, web_server

BROADCAST_PERIOD_S = 0.05
KEEP_ALIVE_PERIOD_S = 10.0
HEARTBEAT_PERIOD_S = 1.0
NICENESS = 5  #: reduces the priority, so that the host process runs first on a busy machine


class WebProcessOptions(NamedTuple):
    """Options of the web process, sent by the host process as one line of JSON."""

    socket: str  #: path of the local socket
    host: str
    port: int
    allow: list[str]
    certificate: str = ""  #: path of the certificate (PEM); empty: plain HTTP
    key: str = ""
    users_file: str = ""  #: empty: no user can log in
    session_idle_timeout_s: float = 3600.0
    session_timeout_s: float = 43_200.0
    events: str = ""  #: path of the event log; empty: the page shows no events from before its start
    recordings: str = ""  #: folder of the recordings; empty: the page cannot record
    recording_max_mb: float = 4000.0
    recording_min_free_mb: float = 1000.0


def create_services(options: WebProcessOptions) -> WebServices:
    """Return the objects that the request handlers of a web server use.

    Raises ValueError if an item of `allow` is neither an address nor a network, and OSError if certificate or
    key cannot be used.
    """
    feed = BrowserFeed()
    path = Path(options.recordings) if options.recordings else None
    folder = RecordingFolder(path, options.recording_max_mb, options.recording_min_free_mb)
    files = TlsFiles(certificate=options.certificate, key=options.key)
    return WebServices(
        feed=feed,
        instrument=InstrumentClient(Path(options.socket), feed),
        earlier_events=EarlierEvents(Path(options.events) if options.events else None, feed),
        broadcaster=EventBroadcaster(),
        limiter=ConnectionLimiter(options.allow),
        logins=Logins(
            UserDirectory(Path(options.users_file) if options.users_file else None),
            WebSessions(options.session_idle_timeout_s, options.session_timeout_s),
        ),
        recorder=PageRecorder(folder, Path(options.socket)),
        tls=RenewedContext(files, "the web page") if options.certificate else None,
    )


def create_server(services: WebServices) -> WebServer:
    """Return the HTTP server for these services."""
    return web_server(create_app(services), services.limiter, services.tls)


async def serve(services: WebServices, server: WebServer, listener: socket.socket) -> None:
    """Serve until the server is stopped."""
    async with asyncio.TaskGroup() as group:
        endless = [
            services.instrument.run(),
            services.earlier_events.run(),
            services.recorder.run(),
            _broadcast(services),
            services.logins.directory.run(),
            _report_logins(services),
            *([services.tls.follow()] if services.tls else []),
        ]
        tasks = [group.create_task(each) for each in endless]
        await server.serve([listener])
        services.broadcaster.close()
        await services.recorder.close()
        for task in tasks:
            task.cancel()


async def _broadcast(services: WebServices) -> None:
    """Send due messages to all browsers, and a keep-alive comment each `KEEP_ALIVE_PERIOD_S`."""
    keep_alive_due_s = 0.0
    while True:
        now_s = time.monotonic()
        messages = [*services.feed.due_messages(now_s), *services.recorder.due_messages()]
        services.broadcaster.send(messages, now_s)
        if now_s >= keep_alive_due_s:
            keep_alive_due_s = now_s + KEEP_ALIVE_PERIOD_S
            services.broadcaster.send_bytes(KEEP_ALIVE, now_s)
        await asyncio.sleep(BROADCAST_PERIOD_S)


async def _report_logins(services: WebServices) -> None:
    """End old sessions, and report login events to the instrument, once per second."""
    while True:
        services.logins.remove_old_sessions()
        services.instrument.report(services.logins.events)
        await asyncio.sleep(REPORT_PERIOD_S)


async def _run(services: WebServices, listener: socket.socket) -> None:
    server = create_server(services)
    call_at_end_of_stdin(server.stop)
    send({"port": listener.getsockname()[1]})
    heartbeat = asyncio.create_task(_send_heartbeats(services))
    await serve(services, server, listener)
    heartbeat.cancel()


async def _send_heartbeats(services: WebServices) -> None:
    """Send a heartbeat each second: whether a recording is in progress, and when the certificate expires."""
    for number in count(1):
        await asyncio.sleep(HEARTBEAT_PERIOD_S)
        days = services.tls.certificate_days(time.time()) if services.tls else None
        recording = services.recorder.active
        send_heartbeat({"heartbeat": number, "recording": recording, "certificate_days": days})


def main() -> int:
    """Run the web process. Return the exit code."""
    reduce_priority(NICENESS)
    logging.basicConfig(format="%(message)s")
    options = WebProcessOptions(**read_options())
    try:
        services = create_services(options)
    except OSError as error:
        send({"port": None, "why": f"the web server cannot use its certificate: {error}"})
        return 1
    try:
        listener = open_listener(options.host, options.port)
    except OSError as error:
        why = listen_failure(error, "web", options.port)
        sentence = f"the web server cannot listen on {options.host}:{options.port}: {why}"
        send({"port": None, "why": sentence})
        return 1
    asyncio.run(_run(services, listener))
    return 0


if __name__ == "__main__":
    sys.exit(main())
