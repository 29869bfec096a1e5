"""Service processes with a certificate, and the status bit for a certificate that expires soon."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from typing import Any

from pneuforce.instrument.service.host.loop import HostLoop
from pneuforce.instrument.service.processes.service_process import ServiceProcess
from pneuforce.support.certificate_days import renewal_warning


class TlsProcess(ServiceProcess):
    """Service process whose heartbeat contains the validity of its files."""

    certificate_days: float | None = None  #: None without a certificate, or if its end is unknown
    list_warning: str = ""  #: clause about the list of revoked certificates, "" if the list is valid

    def on_heartbeat(self, message: Mapping[str, Any]) -> None:
        """Log a certificate that expires soon. Raises TypeError or ValueError for an invalid message."""
        days = message.get("certificate_days")
        self.certificate_days = None if days is None else float(days)
        if warning := renewal_warning(self.certificate_days):
            self.log(logging.WARNING, f"{self._service}: {warning}")
        self.list_warning = str(message.get("list_warning", ""))
        if self.list_warning:
            self.log(logging.WARNING, f"{self._service}: {self.list_warning}")

    @property
    def must_be_renewed(self) -> bool:
        """Return True if the certificate or the list of revoked certificates has ended or ends soon."""
        return bool(renewal_warning(self.certificate_days) or self.list_warning)


class CertificateMonitor:
    """Output channel that tells the instrument whether a certificate of its processes expires soon."""

    def __init__(self, host: HostLoop, processes: Sequence[TlsProcess]) -> None:
        self._host = host
        self._processes = processes

    def on_sample(self, now_s: float) -> None:
        """Do nothing: the time of a sample does not matter."""

    def tick(self, now_s: float) -> None:  # noqa: ARG002
        """Update the flag of the instrument."""
        self._host.instrument.certificate_expiring = any(each.must_be_renewed for each in self._processes)
