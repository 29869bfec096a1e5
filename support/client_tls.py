"""TLS of a client: verification of the server, and the certificate of the client."""

from __future__ import annotations

import ssl
from pathlib import Path

from pneuforce.support.pem_problem import pem_problem
from pneuforce.support.permissions import read_problem


def client_context(ca: str, certificate: str, key: str) -> ssl.SSLContext:
    """Return a context that verifies the certificate and the name of the server, with TLS 1.2 or newer.

    The arguments are paths of PEM files. Without `ca`, the authorities of the operating system are trusted.
    Without `certificate`, the client has none. Raises OSError with a sentence that names the file.
    """
    if problems := [*filter(None, map(read_problem, map(Path, filter(None, (ca, certificate, key)))))]:
        raise OSError("; ".join(problems))
    try:
        context = ssl.create_default_context(cafile=ca or None)
    except ssl.SSLError:
        raise OSError(f"{ca} contains no certificates in PEM format") from None
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    if certificate:
        try:
            context.load_cert_chain(certificate, key, password=_no_password)
        except (ssl.SSLError, ValueError):
            raise OSError(pem_problem(certificate, key)) from None
    return context


def _no_password() -> str:
    raise ValueError("the key is encrypted")
