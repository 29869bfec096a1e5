"""Files of a TLS server: certificate, key, authorities and revoked certificates."""

from __future__ import annotations

import os
import ssl
from pathlib import Path
from typing import NamedTuple

from pneuforce.support.certificate_purpose import is_server_certificate
from pneuforce.support.pem_problem import pem_problem
from pneuforce.support.permissions import read_problem

#: Cipher suites of TLS 1.2 with forward secrecy and authenticated encryption. TLS 1.3 has no others.
CIPHERS = "ECDHE+AESGCM:ECDHE+CHACHA20"


class _Version(NamedTuple):
    changed_ns: int
    size: int
    inode: int


class TlsFiles:
    """Files in PEM format.

    With `ca`, each client needs a certificate from one of these authorities. `crl` may be empty.
    """

    def __init__(self, *, certificate: str, key: str, ca: str | None = None, crl: str = "") -> None:
        self._paths = {"certificate": certificate, "key": key}
        if ca is not None:
            self._paths |= {"ca": ca} | ({"crl": crl} if crl else {})
        self._versions: dict[str, _Version | None] = {}

    def unreadable(self) -> dict[str, str]:
        """Return why files cannot be read, with the remedy, by the names of the arguments."""
        empty = "the name of the file is empty: name a file"
        problems = {name: read_problem(Path(path)) if path else empty for name, path in self._paths.items()}
        return {name: problem for name, problem in problems.items() if problem}

    def load(self) -> ssl.SSLContext:
        """Return a context for a server.

        Raises OSError with a sentence that names the file.
        """
        self._versions = self._read_versions()
        if problems := self.unreadable():
            raise OSError("; ".join(problems.values()))
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        context.set_ciphers(CIPHERS)
        # A resumed session is not verified again. It ends with the context: after each change of the files.
        context.options |= ssl.OP_NO_TICKET | ssl.OP_NO_RENEGOTIATION
        context.num_tickets = 0
        self._load_own(context)
        if "ca" in self._paths:
            context.verify_mode = ssl.CERT_REQUIRED
            _load_verification(context, self._paths["ca"], "x509", "certificate")
        if "crl" in self._paths:
            _load_verification(context, self._paths["crl"], "crl", "list of revoked certificates (CRL)")
            context.verify_flags |= ssl.VERIFY_CRL_CHECK_LEAF
        return context

    def changed(self) -> set[str]:
        """Return the names of the files that have changed since the last `load`."""
        versions = self._read_versions()
        return {name for name, version in versions.items() if version != self._versions.get(name)}

    def own_certificate(self) -> bytes:
        """Return the bytes of the certificate file (PEM). Raises OSError."""
        with open(self._paths["certificate"], "rb") as file:
            return file.read()

    def revocation_list(self) -> bytes:
        """Return the list of revoked certificates (PEM), empty without a list. Raises OSError."""
        return Path(self._paths["crl"]).read_bytes() if "crl" in self._paths else b""

    def _load_own(self, context: ssl.SSLContext) -> None:
        certificate, key = self._paths["certificate"], self._paths["key"]
        try:
            context.load_cert_chain(certificate, key, password=_no_password)
        except (ssl.SSLError, ValueError):
            raise OSError(pem_problem(certificate, key)) from None
        if not is_server_certificate(self.own_certificate()):
            raise OSError(
                f"{certificate} is not for server authentication (extended key usage): use the certificate "
                "of a server, not that of a client"
            )

    def _read_versions(self) -> dict[str, _Version | None]:
        return {name: _version(path) for name, path in self._paths.items()}


def _load_verification(context: ssl.SSLContext, path: str, kind: str, content: str) -> None:
    """Load a file for the verification of clients. Raises OSError if it has no object of this kind."""
    before = context.cert_store_stats()[kind]
    try:
        context.load_verify_locations(path)
    except ssl.SSLError:
        what = "contains no valid" if os.path.getsize(path) else "is empty: copy it again. It must contain a"
        raise OSError(f"{path} {what} {content} in PEM format") from None
    if context.cert_store_stats()[kind] == before:
        raise OSError(f"{path} contains no {content}: name another file")


def _no_password() -> str:
    raise ValueError("the key is encrypted")


def _version(path: str) -> _Version | None:
    try:
        status = os.stat(path)
    except OSError:
        return None
    return _Version(status.st_mtime_ns, status.st_size, status.st_ino)
