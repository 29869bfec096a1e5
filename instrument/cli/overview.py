"""`pneuforce overview`: a web page with the state of all instruments of this computer."""

from __future__ import annotations

import json
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pneuforce.instrument.cli.terminal.options import CHECKED_LATER, checked_host

if TYPE_CHECKING:
    from pneuforce.support.renewed_context import RenewedContext
    from pneuforce.web.overview.watched_instrument import WatchedInstrument

commands = typer.Typer()


@commands.command()
def overview(
    configurations: Annotated[
        list[Path],
        typer.Argument(help="The instrument.toml of each instrument.", readable=CHECKED_LATER),
    ],
    host: Annotated[str, typer.Option(help="Address to listen on.", callback=checked_host)] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="TCP port; 0 selects a free port.", min=0, max=65535)] = 8000,
    allow: Annotated[
        list[str] | None,
        typer.Option(help="Address or network that may connect, besides this computer; can be repeated."),
    ] = None,
    certificate: Annotated[
        Path | None, typer.Option(help="Certificate of the page for HTTPS, with its chain (PEM).")
    ] = None,
    key: Annotated[Path | None, typer.Option(help="Key of --certificate (PEM).")] = None,
) -> None:
    """Serve a page with state and force of all instruments of this computer, until Ctrl-C.

    The page reads the local sockets of the instruments, so it must run as their user. It cannot write.
    A program reads /api/instruments.

    Example: pneuforce overview /etc/pneuforce/left.toml /etc/pneuforce/right.toml
    """
    import asyncio

    from pneuforce.errors import ConfigurationError, ServerError
    from pneuforce.web.overview.server import serve_overview
    from pneuforce.web.server.listener import open_listener

    instruments = [_watched(path) for path in configurations]
    if not allow and not _is_loopback(host):
        raise ConfigurationError(
            f"--host {host} can be reached from the network: name the clients with --allow"
        )
    tls = _tls_of(certificate, key)
    try:
        listener = open_listener(host, port)
    except OSError as error:
        raise ServerError(f"the overview cannot listen on {host}:{port}: {error.strerror or error}") from None
    typer.echo(json.dumps({"overview": listener.getsockname()[1]}))
    try:
        asyncio.run(serve_overview(instruments, allow or [], listener, tls))
    except ValueError as error:
        raise ConfigurationError(f"--allow: {error}") from None


def _watched(path: Path) -> WatchedInstrument:
    from pneuforce.errors import ConfigurationError
    from pneuforce.instrument.config import load, resolve_path
    from pneuforce.web.overview.watched_instrument import WatchedInstrument

    configuration = load(path)
    socket = resolve_path(path, configuration.local.socket)
    if socket is None:
        raise ConfigurationError(f"{path}: local.socket is empty, and the overview needs it: set it")
    web = configuration.web
    scheme = "https" if web.certificate else "http"
    return WatchedInstrument(path.stem, socket, web.port if web.enabled else None, scheme)


def _tls_of(certificate: Path | None, key: Path | None) -> RenewedContext | None:
    """Return the certificate of the page, None without one. Raises ConfigurationError."""
    from pneuforce.errors import ConfigurationError
    from pneuforce.support.renewed_context import RenewedContext
    from pneuforce.support.tls_files import TlsFiles

    if certificate is None and key is None:
        return None
    if certificate is None or key is None:
        raise ConfigurationError("--certificate and --key belong together: give both of them, or none")
    try:
        return RenewedContext(TlsFiles(certificate=str(certificate), key=str(key)), "overview")
    except OSError as error:
        raise ConfigurationError(f"--certificate: {error}") from None


def _is_loopback(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
