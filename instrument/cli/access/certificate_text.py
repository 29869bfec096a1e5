"""Output of `pneuforce certificates show`: a certificate, or a list of revoked certificates."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.terminal.output import done_json
from pneuforce.instrument.commissioning.certificates import read_certificate
from pneuforce.registers.modbus_security.certificate import identity_of
from pneuforce.support.atomic_file import read_file
from pneuforce.support.certificate_days import begin_warning, duration_text
from pneuforce.support.counted import counted
from pneuforce.support.revocation_list import list_warning, lists_in

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
        facts, text = _revocation_lists(path, content, now)
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


def _revocation_lists(path: Path, content: bytes, now: datetime) -> tuple[dict[str, Any], str]:
    """Return the facts about the lists of revoked certificates for JSON, and the text for a person.

    The facts about the second and each further list are in `further_lists`.
    """
    try:
        lists = lists_in(content)
        warning = list_warning(content, now.timestamp())
    except ValueError:
        raise ConfigurationError(f"{path} contains no valid list of revoked certificates") from None
    first, *further = (_list_facts(each, now) for each in lists)
    lines = [line for each in lists for line in _list_lines(each)]
    return {**first, "further_lists": further}, "\n".join([*lines, *filter(None, [warning])])


def _list_facts(crl: x509.CertificateRevocationList, now: datetime) -> dict[str, Any]:
    following = crl.next_update_utc
    return {
        "issuer": crl.issuer.rfc4514_string(),
        "last_update": crl.last_update_utc.isoformat(),
        "next_update": following.isoformat() if following else None,
        "overdue": following is not None and following < now,
        "revoked": [
            {"serial_number": f"{each.serial_number:x}", "revoked_at": each.revocation_date_utc.isoformat()}
            for each in crl
        ],
    }


def _list_lines(crl: x509.CertificateRevocationList) -> list[str]:
    following = crl.next_update_utc
    return [
        f"issuer {crl.issuer.rfc4514_string()}",
        f"last update {crl.last_update_utc:%Y-%m-%d}",
        f"next update {f'{following:%Y-%m-%d}' if following else 'not stated'}",
        counted(len(crl), "revoked certificate"),
        *(
            f"serial number {each.serial_number:x}, revoked {each.revocation_date_utc:%Y-%m-%d}"
            for each in crl
        ),
    ]
