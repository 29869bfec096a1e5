"""RDT server of the host. The server is an output channel: the host polls its socket."""

from __future__ import annotations

import logging

from pneuforce.errors import ConfigurationFileError, ServerError
from pneuforce.instrument.config import RdtSection
from pneuforce.registers.rdt.options import RdtOptions
from pneuforce.registers.rdt.server import RdtServer
from pneuforce.registers.source import Source
from pneuforce.support.background import run_in_background
from pneuforce.support.listening import listen_failure, needs_privilege

log = logging.getLogger("pneuforce")


def rdt_server_of(source: Source, settings: RdtSection) -> RdtServer | None:
    """Return the RDT server of a configuration, or None if it is disabled."""
    if not settings.enabled:
        return None
    options = RdtOptions(
        host=settings.host,
        port=settings.port,
        allow=tuple(settings.allow),
        stream_timeout_s=settings.stream_timeout_s,
    )
    return RdtServer(source, options)


async def open_rdt(server: RdtServer) -> None:
    """Open the port.

    Raises ConfigurationFileError if the port needs a privilege, ServerError for every other reason.
    """
    host, port = server.options.host, server.options.port
    try:
        await run_in_background(server.open)  # the name of the host may need a name server
    except OSError as error:
        kind = ConfigurationFileError if needs_privilege(error) else ServerError
        why = listen_failure(error, "rdt", port)
        raise kind(f"RDT cannot use UDP port {host}:{port}: {why}") from None
    log.info("RDT on UDP %s:%d, read-only", server.options.host, server.port)
