"""RDT server of the host. The server is an output channel: the host polls its socket."""

from __future__ import annotations

import errno
import logging

from pneuforce.errors import ServerError
from pneuforce.instrument.config import RdtSection
from pneuforce.registers.rdt.options import RdtOptions
from pneuforce.registers.rdt.server import RdtServer
from pneuforce.registers.source import Source
from pneuforce.support.background import run_in_background

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
    """Open the port. Raises ServerError if the port is in use or the address is not available."""
    at = f"{server.options.host}:{server.options.port}"
    try:
        await run_in_background(server.open)  # the name of the host may need a name server
    except OSError as error:
        in_use = error.errno == errno.EADDRINUSE
        why = "it is in use; end the other program, or change [rdt] port"
        if not in_use:
            why = f"{error.strerror or error}; correct [rdt] host, or set [rdt] enabled = false"
        raise ServerError(f"RDT cannot use UDP port {at}: {why}") from None
    log.info("RDT on UDP %s:%d, read-only", server.options.host, server.port)
