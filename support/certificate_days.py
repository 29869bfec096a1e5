"""Days until a certificate expires, and the warning before its end."""

from __future__ import annotations

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
    end = "has expired" if days < 0 else f"expires in {counted(round(days), 'day')}"
    return f"the certificate {end}: replace certificate and key"
