"""Validity of a list of revoked certificates (CRL)."""

from __future__ import annotations

from datetime import UTC, datetime

from pneuforce.support.counted import counted


def overdue_days(crl: bytes, now_s: float) -> int | None:
    """Return the complete days since a list (PEM) should have been replaced, None if it is not overdue.

    `now_s` is in seconds since 1970-01-01 UTC. Raises ValueError if the list cannot be decoded.
    """
    from cryptography import x509  # slow to import, and only needed for a list

    end = x509.load_pem_x509_crl(crl).next_update_utc
    now = datetime.fromtimestamp(now_s, UTC)
    return (now - end).days if end is not None and end < now else None


def overdue_warning(crl: bytes, now_s: float) -> str:
    """Return a clause if a list (PEM) is overdue, otherwise an empty text. Raises ValueError."""
    days = overdue_days(crl, now_s)
    if days is None:
        return ""
    since = f"overdue for {counted(days, 'day')}" if days else "overdue since today"
    return (
        f"the list of revoked certificates is {since}: the instrument rejects all clients over TLS; copy the "
        "current list of the authority to the instrument"
    )
