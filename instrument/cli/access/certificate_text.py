"""Output of `pneuforce certificates show`: a certificate, or a list of revoked certificates."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.terminal.output import done_json
from pneuforce.instrument.commissioning.certificates import read_certificate, revocation_dates
from pneuforce.registers.modbus_security.certificate import identity_of
from pneuforce.support.atomic_file import read_file
from pneuforce.support.certificate_days import begin_warning, duration_text
from pneuforce.support.counted import counted
from pneuforce.support.revocation_list import list_warning

_CRL_HEADER = b"-----BEGIN X509 CRL-----"


def show(path: Path, as_json: bool) -> str:
    """Return the content of a certificate or of a list of revoked certificates.

    Raises ConfigurationError if the file contains neither of them.
    """
    now = datetime.now(UTC)
    content = read_file(path)
    if not content.strip():
        raise ConfigurationError(
            f"{path} is empty: a certificate or a list of revoked certificates in PEM format was expected. "
            "The file was probably copied incompletely: copy it again from the authority"
        )
    if _CRL_HEADER in content:
        facts, text = _revocation_list(path, content, now)
    else:
        facts, text = _certificate(read_certificate(path), now)
    return done_json(text.replace("\n", ", "), **facts) if as_json else text


def _certificate(certificate: x509.Certificate, now: datetime) -> tuple[dict[str, Any], str]:
    """Return the facts about a certificate for JSON, and the lines for a person."""
    name, role, _ = identity_of(certificate.public_bytes(Encoding.DER))
    begin, end = certificate.not_valid_before_utc, certificate.not_valid_after_utc
    serial_number = f"{certificate.serial_number:x}"
    facts = {
        "name": name,
        "role": role,
        "serial_number": serial_number,
        "valid_from": begin.isoformat(),
        "valid_until": end.isoformat(),
        "days_left": (end - now).days,
    }
    early = begin_warning(certificate.public_bytes(Encoding.PEM), now.timestamp())
    lines = [
        f"name {name}",
        f"role {role or 'none'}",
        f"serial number {serial_number}",
        f"valid from {begin:%Y-%m-%d}" + (f" ({early})" if early else ""),
        f"valid until {end:%Y-%m-%d} ({_time_text((end - now).total_seconds() / 86_400)})",
    ]
    return facts, "\n".join(lines)


def _time_text(days_left: float) -> str:
    """Return the time until or since the end of validity."""
    if days_left >= 0:
        return duration_text(days_left)
    return f"expired {counted(int(-days_left), 'day')} ago" if days_left <= -1 else "expired today"


def _revocation_list(path: Path, content: bytes, now: datetime) -> tuple[dict[str, Any], str]:
    """Return the facts about a list of revoked certificates for JSON, and the lines for a person."""
    try:
        crl, dates = x509.load_pem_x509_crl(content), revocation_dates(content)
        warning = list_warning(content, now.timestamp())
    except ValueError:
        raise ConfigurationError(f"{path} contains no valid list of revoked certificates") from None
    issuer, last, following = crl.issuer.rfc4514_string(), crl.last_update_utc, crl.next_update_utc
    facts = {
        "issuer": issuer,
        "last_update": last.isoformat(),
        "next_update": following.isoformat() if following else None,
        "overdue": following is not None and following < now,
        "revoked": [
            {"serial_number": f"{number:x}", "revoked_at": date.isoformat()} for number, date in dates.items()
        ],
    }
    lines = [
        f"issuer {issuer}",
        f"last update {last:%Y-%m-%d}",
        f"next update {f'{following:%Y-%m-%d}' if following else 'not stated'}"
        + (f" ({warning})" if warning else ""),
        counted(len(dates), "revoked certificate"),
        *(f"serial number {number:x}, revoked {date:%Y-%m-%d}" for number, date in dates.items()),
    ]
    return facts, "\n".join(lines)
