"""TLS context of a running server. Renewed files are used without a restart."""

from __future__ import annotations

import asyncio
import logging
import ssl
import time
from contextlib import suppress

from pneuforce.support.certificate_days import begin_warning, days_left
from pneuforce.support.revocation_list import list_warning
from pneuforce.support.tls_files import TlsFiles

RELOAD_PERIOD_S = 5.0  #: period at which the files are read again if they have changed

log = logging.getLogger("pneuforce")


class RenewedContext:
    """Context for new connections. If renewed files cannot be used, the earlier context stays in use."""

    def __init__(self, files: TlsFiles, service: str) -> None:
        """Read the files. `service` is the name of the server in the log.

        Raises OSError with a sentence that names the file. A certificate that has expired or is not yet valid
        is used, so that the server can start. The clients then decide.
        """
        self._files, self._service = files, service
        self.current: ssl.SSLContext = files.load()
        self._certificate, self._list = files.own_certificate(), files.revocation_list()
        self._log_begin(time.time())

    def certificate_days(self, now_s: float) -> float | None:
        """Return the days until the certificate in use expires, None if it cannot be decoded.

        `now_s` is in seconds since 1970-01-01 UTC.
        """
        return _days_left(self._certificate, now_s)

    def list_warning(self, now_s: float) -> str:
        """Return a clause if the list of revoked certificates in use is overdue or ends soon."""
        with suppress(ValueError):
            return list_warning(self._list, now_s) if self._list else ""
        return ""

    def renew(self, now_s: float) -> set[str]:
        """Read changed files. Return the names of the files that are used from now on, and log them."""
        changed = self._files.changed()
        if not changed:
            return set()
        try:
            context, certificate = self._files.load(), self._files.own_certificate()
            revoked = self._files.revocation_list()
            days = _days_left(certificate, now_s)
            if certificate != self._certificate and days is not None and days < 0:
                raise OSError("the new certificate has expired")
        except OSError as error:
            log.warning("%s: the changed files are not used: %s", self._service, error)
            return set()
        self.current, self._certificate, self._list = context, certificate, revoked
        log.warning("%s: read again: %s", self._service, ", ".join(sorted(changed)))
        self._log_begin(now_s)
        return changed

    def _log_begin(self, now_s: float) -> None:
        """Log a warning if the certificate in use is not yet valid."""
        with suppress(ValueError):
            if warning := begin_warning(self._certificate, now_s):
                log.warning("%s: %s", self._service, warning)

    async def follow(self) -> None:
        """Read changed files each `RELOAD_PERIOD_S` until the task is cancelled."""
        while True:
            await asyncio.sleep(RELOAD_PERIOD_S)
            self.renew(time.time())


def _days_left(certificate: bytes, now_s: float) -> float | None:
    try:
        return round(days_left(certificate, now_s), 3)
    except ValueError:
        return None
