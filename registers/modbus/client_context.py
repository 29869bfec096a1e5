"""TLS context of a client of Modbus/TCP Security."""

from __future__ import annotations

import socket
import ssl
from pathlib import Path
from typing import Any, NamedTuple

from pneuforce.support.permissions import read_problem
from pneuforce.support.tls_failure import client_failure_reason


class ClientFiles(NamedTuple):
    """Files of a client in PEM format: authority of the instrument, own certificate and its key."""

    ca: Path
    certificate: Path
    key: Path


class ClientContext(ssl.SSLContext):
    """Context that verifies the host name, also if the program that wraps a socket does not pass the name."""

    server_hostname: str

    def wrap_socket(self, sock: socket.socket, *words: Any, **options: Any) -> ssl.SSLSocket:
        """Return a TLS socket for the host of this context."""
        return super().wrap_socket(sock, *words, **{"server_hostname": self.server_hostname} | options)


def client_context(host: str, files: ClientFiles) -> ClientContext:
    """Return the context for the instrument `host`. Raises OSError with a sentence that names the file."""
    if problems := [*filter(None, map(read_problem, files))]:
        raise OSError("; ".join(problems))
    context = ClientContext(ssl.PROTOCOL_TLS_CLIENT)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.server_hostname = host
    try:
        context.load_verify_locations(files.ca)
        context.load_cert_chain(files.certificate, files.key)
    except ssl.SSLError as error:
        names = ", ".join(map(str, files))
        raise OSError(
            f"{names}: not an authority, a certificate and its key ({error.reason or error})"
        ) from None
    return context


def handshake_problem(host: str, port: int, context: ssl.SSLContext, wait_s: float) -> str:
    """Return why a connection fails, empty if it does not fail."""
    try:
        with (
            socket.create_connection((host, port), timeout=wait_s) as plain,
            context.wrap_socket(plain) as secured,
        ):
            secured.recv(1)  # with TLS 1.3, a server rejects the certificate of a client after the handshake
    except ssl.SSLError as error:
        return client_failure_reason(error)
    except TimeoutError:
        return ""
    except OSError as error:
        return str(error.strerror or error)
    return ""
