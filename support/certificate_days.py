"""Time until a certificate expires, and the warnings before its begin and before its end."""

from __future__ import annotations

import math
from datetime import UTC, datetime

from pneuforce.support.counted import counted

MIN_CERTIFICATE_DAYS = 30  #: below this number of days, a certificate must be renewed


def days_left(certificate: bytes, now_s: float) -> float:
    """Return the days until a certificate (PEM) expires; negative after its end.

    `now_s` is in seconds since 1970-01-01 UTC. Raises ValueError if the certificate cannot be decoded.
    """
    from cryptography import x509  # slow to import, and only needed by servers with a certificate

    decoded = x509.load_pem_x509_certificate(certificate)
    return (decoded.not_valid_after_utc.timestamp() - now_s) / 86_400


def renewal_warning(days: float | None) -> str:
    """Return a clause if a certificate has expired or expires soon, otherwise an empty text.

    `days` is the time until the end of validity; None if it is unknown.
    """
    if days is None or days >= MIN_CERTIFICATE_DAYS:
        return ""
    end = "has expired" if days < 0 else f"expires in {duration_text(days)}"
    return f"the certificate {end}: replace certificate and key"


def begin_warning(certificate: bytes, now_s: float) -> str:
    """Return a clause if a certificate (PEM) is not yet valid, otherwise an empty text.

    `now_s` is in seconds since 1970-01-01 UTC. Raises ValueError if the certificate cannot be decoded.
    """
    from cryptography import x509  # slow to import, and only needed by servers with a certificate

    begin = x509.load_pem_x509_certificate(certificate).not_valid_before_utc
    if begin <= datetime.fromtimestamp(now_s, UTC):
        return ""
    return (
        f"the certificate is valid from {begin:%Y-%m-%d %H:%M} UTC: clients reject it until then; check the "
        "clock of this computer"
    )


def duration_text(days: float) -> str:
    """Return a time in days, below one day in hours, and below one hour in minutes."""
    hours = days * 24
    if days >= 1:
        return counted(round(days), "day")
    return counted(int(hours), "hour") if hours >= 1 else counted(math.ceil(hours * 60), "minute")
