"""Files of `pneuforce certificates`."""

from __future__ import annotations

import os
import re
import shlex
from datetime import UTC, datetime
from pathlib import Path

from cryptography.exceptions import InvalidSignature

from pneuforce.errors import ConfigurationError, UsageError
from pneuforce.instrument.commissioning.certificates import (
    KeyPair,
    certificate_pem,
    key_pem,
    new_authority,
    new_client,
    new_instrument,
    read_authority,
    read_certificate,
    revocation_dates,
    revocation_list,
)
from pneuforce.support.atomic_file import read_file, replaced_file
from pneuforce.support.counted import counted
from pneuforce.support.revocation_list import lists_in

CA, CRL = "ca", "crl.pem"
_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,31}")


def make_authority(folder: Path, name: str) -> str:
    """Make the authority of a folder. Return what to do next. Raises PneuforceError or OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    _write(folder, CA, new_authority(name, _now()))
    return (
        f"{folder}/ca.pem and {folder}/ca.key are made, valid for ten years. Who has ca.key can make "
        "certificates that all instruments accept: keep it on another computer than the instrument."
    )


def make_instrument(folder: Path, name: str, hosts: list[str], days: int) -> str:
    """Make the certificate of an instrument. Return what to do next. Raises PneuforceError or OSError."""
    authority = _authority(folder)
    try:
        pair = new_instrument(authority, hosts, _now(), days)
    except (ValueError, UnicodeError) as error:
        raise UsageError(f"--host: {error}") from None
    _write(folder, name, pair)
    return (
        f"{folder}/{name}.pem and {folder}/{name}.key are made, for {', '.join(hosts)}, valid until "
        f"{_end(pair)}. Copy both and {folder}/ca.pem to the instrument and name them in "
        "[modbus_security] or [web]."
    )


def make_client(folder: Path, name: str, role: str, days: int) -> str:
    """Make the certificate of a client. Return what to do next. Raises PneuforceError or OSError."""
    authority = _authority(folder)
    try:
        pair = new_client(authority, name, role, _now(), days)
    except ValueError as error:
        raise UsageError(str(error)) from None
    _write(folder, name, pair)
    return (
        f"{folder}/{name}.pem and {folder}/{name}.key are made, role {role or 'none'}, valid until "
        f"{_end(pair)}. Copy both and {folder}/ca.pem to the client."
    )


def revoke(folder: Path, path: Path) -> str:
    """Add a certificate to the list of revoked certificates. Raises PneuforceError or OSError."""
    authority, certificate = _authority(folder), read_certificate(path)
    try:
        certificate.verify_directly_issued_by(authority.certificate)
    except (ValueError, TypeError, InvalidSignature):
        raise UsageError(f"{path} was not signed by {folder}/ca.pem") from None
    crl = folder / CRL
    old = read_file(crl) if crl.exists() else b""
    if crl.exists() and not old.strip():
        raise ConfigurationError(
            f"{crl} is empty: the earlier revocations would be lost. Copy the list from an instrument or "
            "from a backup; if no certificate was revoked before, delete the file"
        )
    try:
        dates = revocation_dates(old) if old else {}
        others = [each for each in lists_in(old) if each.issuer != certificate.issuer] if old else []
    except ValueError:
        raise ConfigurationError(f"{crl} is not a list of revoked certificates in PEM format") from None
    if others:
        raise ConfigurationError(
            f"{crl} also contains the list of another authority, which would be lost: keep each list in the "
            "folder of its authority, and join the lists only on the instrument"
        )
    dates.setdefault(certificate.serial_number, _now())
    content = revocation_list(authority, dates, _now())
    with replaced_file(crl) as temporary:
        temporary.write_bytes(content)
    revoked = counted(len(dates), "revoked certificate")
    return f"{crl} contains {revoked}: copy it to each instrument, and name it in crl."


def _authority(folder: Path) -> KeyPair:
    """Return the authority of a folder. Raises ConfigurationError."""
    certificate, key = folder / f"{CA}.pem", folder / f"{CA}.key"
    if not certificate.exists():
        raise ConfigurationError(
            f"{folder} contains no authority (ca.pem and ca.key), which signs the certificates: make the "
            f"authority first with pneuforce certificates authority {shlex.quote(str(folder))}"
        )
    return read_authority(certificate, key)


def _write(folder: Path, name: str, pair: KeyPair) -> None:
    """Write new files for certificate and key. Raises UsageError if a name is invalid or a file exists."""
    if not _NAME.fullmatch(name):
        raise UsageError(
            f"{name!r} cannot be the name of a file: use up to 32 of the characters A-Z a-z 0-9 . _ -"
        )
    paths = (folder / f"{name}.pem", folder / f"{name}.key")
    for path in paths:
        if path.exists():
            raise UsageError(f"{path} exists: choose another name, or move the old file away")
    _write_new(paths[1], key_pem(pair.key), 0o600)
    _write_new(paths[0], certificate_pem(pair.certificate), 0o644)


def _write_new(path: Path, content: bytes, mode: int) -> None:
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as file:
        file.write(content)


def _end(pair: KeyPair) -> str:
    return f"{pair.certificate.not_valid_after_utc:%Y-%m-%d}"


def _now() -> datetime:
    return datetime.now(UTC)
