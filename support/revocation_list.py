"""Validity of a list of revoked certificates (CRL). A file can contain the lists of several authorities."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

from pneuforce.support.counted import counted

if TYPE_CHECKING:
    from cryptography import x509

#: Share of the period of validity, and longest time before its end, in which a list should be replaced.
RENEWAL_SHARE, LONGEST_RENEWAL = 0.1, timedelta(days=7)
REMEDY = "copy the current list of the authority to the instrument"
_PEM = re.compile(rb"-----BEGIN X509 CRL-----.*?-----END X509 CRL-----", re.DOTALL)


def lists_in(crl: bytes) -> list[x509.CertificateRevocationList]:
    """Return the lists in a file (PEM). Raises ValueError if there is none, or if one cannot be decoded."""
    from cryptography import x509  # slow to import, and only needed for a list

    lists = [x509.load_pem_x509_crl(part) for part in _PEM.findall(crl)]
    if not lists:
        raise ValueError("the file contains no list of revoked certificates")
    return lists


def authorities_without_list(crl: bytes, ca: bytes) -> list[str]:
    """Return the names of the authorities in `ca` (PEM) without a list in `crl` (PEM).

    The instrument rejects the clients of such an authority. Raises ValueError if a file cannot be decoded.
    """
    from cryptography import x509

    issuers = {each.issuer for each in lists_in(crl)}
    subjects = [certificate.subject for certificate in x509.load_pem_x509_certificates(ca)]
    return [subject.rfc4514_string() for subject in subjects if subject not in issuers]


def list_warning(crl: bytes, now_s: float) -> str:
    """Return a clause if a list in a file (PEM) is overdue or ends soon, otherwise an empty text.

    `now_s` is in seconds since 1970-01-01 UTC. Raises ValueError if a list cannot be decoded.
    """
    now = datetime.fromtimestamp(now_s, UTC)
    lists = lists_in(crl)
    return next(filter(None, (_warning(each, now, len(lists) > 1) for each in lists)), "")


def _warning(crl: x509.CertificateRevocationList, now: datetime, is_one_of_several: bool) -> str:
    name, clients = "the list of revoked certificates", "all clients"
    if is_one_of_several:
        name, clients = f"{name} of {crl.issuer.rfc4514_string()}", "the clients of this authority"
    begin, end = crl.last_update_utc, crl.next_update_utc
    if end is None or end - now >= min(RENEWAL_SHARE * (end - begin), LONGEST_RENEWAL):
        return ""
    if now <= end:
        at = f"{end:%Y-%m-%d %H:%M} UTC"
        return f"{name} ends at {at}: the instrument then rejects {clients} over TLS; {REMEDY}"
    days = (now - end).days
    since = f"overdue for {counted(days, 'day')}" if days else "overdue since today"
    return f"{name} is {since}: the instrument rejects {clients} over TLS; {REMEDY}"
