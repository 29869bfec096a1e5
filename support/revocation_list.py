"""Validity of a list of revoked certificates (CRL)."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from pneuforce.support.counted import counted

#: Share of the period of validity, and longest time before its end, in which a list should be replaced.
RENEWAL_SHARE, LONGEST_RENEWAL = 0.1, timedelta(days=7)


def list_warning(crl: bytes, now_s: float) -> str:
    """Return a clause if a list (PEM) is overdue or ends soon, otherwise an empty text.

    `now_s` is in seconds since 1970-01-01 UTC. Raises ValueError if the list cannot be decoded.
    """
    from cryptography import x509  # slow to import, and only needed for a list

    decoded = x509.load_pem_x509_crl(crl)
    begin, end, now = decoded.last_update_utc, decoded.next_update_utc, datetime.fromtimestamp(now_s, UTC)
    if end is None or end - now >= min(RENEWAL_SHARE * (end - begin), LONGEST_RENEWAL):
        return ""
    remedy = "copy the current list of the authority to the instrument"
    if now <= end:
        return (
            f"the list of revoked certificates ends at {end:%Y-%m-%d %H:%M} UTC: the instrument then rejects "
            f"all clients over TLS; {remedy}"
        )
    days = (now - end).days
    since = f"overdue for {counted(days, 'day')}" if days else "overdue since today"
    return (
        f"the list of revoked certificates is {since}: the instrument rejects all clients over TLS; {remedy}"
    )
