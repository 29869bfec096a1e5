"""Certificates for people without a PKI: authority, instruments, clients, revocation."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from typing import NamedTuple

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from pneuforce.errors import ConfigurationError
from pneuforce.registers.modbus_security.certificate import ROLE_OID, encode_role
from pneuforce.support.atomic_file import read_file
from pneuforce.support.revocation_list import lists_in

AUTHORITY_DAYS = 3650
CLOCK_TOLERANCE = timedelta(hours=1)  #: a certificate is valid this time before it was made


class KeyPair(NamedTuple):
    """Certificate and its private key."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey


def new_authority(name: str, now: datetime) -> KeyPair:
    """Return an authority that is valid for AUTHORITY_DAYS."""
    key = ec.generate_private_key(ec.SECP256R1())
    builder = (
        _builder(name, name, key, now, AUTHORITY_DAYS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_key_usage(authority=True), critical=True)
    )
    return KeyPair(builder.sign(key, SHA256()), key)


def new_instrument(authority: KeyPair, hosts: list[str], now: datetime, days: int) -> KeyPair:
    """Return the certificate of an instrument. `hosts` are its addresses and host names.

    Raises ValueError without a host.
    """
    if not hosts:
        raise ValueError("a certificate of an instrument needs at least one address or host name")
    names = x509.SubjectAlternativeName([_general_name(host) for host in hosts])
    return _signed(authority, hosts[0], [names], ExtendedKeyUsageOID.SERVER_AUTH, now, days)


def new_client(authority: KeyPair, name: str, role: str, now: datetime, days: int) -> KeyPair:
    """Return the certificate of a client; without a role if `role` is empty. Raises ValueError."""
    extensions: list[x509.ExtensionType] = []
    if role:
        extensions.append(x509.UnrecognizedExtension(ROLE_OID, encode_role(role)))
    return _signed(authority, name, extensions, ExtendedKeyUsageOID.CLIENT_AUTH, now, days)


def revocation_list(authority: KeyPair, dates: Mapping[int, datetime], now: datetime) -> bytes:
    """Return the list of revoked certificates (PEM). It is valid as long as the authority.

    `dates` are the times of the revocations by the serial numbers of the certificates.
    """
    builder = (
        x509.CertificateRevocationListBuilder()
        .issuer_name(authority.certificate.subject)
        .last_update(now - CLOCK_TOLERANCE)
        .next_update(authority.certificate.not_valid_after_utc)
        .add_extension(_authority_id(authority), critical=False)
    )
    for number, date in sorted(dates.items()):
        revoked = x509.RevokedCertificateBuilder().serial_number(number).revocation_date(date).build()
        builder = builder.add_revoked_certificate(revoked)
    return builder.sign(authority.key, SHA256()).public_bytes(Encoding.PEM)


def revocation_dates(crl: bytes) -> dict[int, datetime]:
    """Return the times of the revocations in all lists (PEM) by serial number. Raises ValueError."""
    entries = (entry for each in lists_in(crl) for entry in each)
    return {entry.serial_number: entry.revocation_date_utc for entry in entries}


def certificate_pem(certificate: x509.Certificate) -> bytes:
    """Return a certificate in PEM format."""
    return certificate.public_bytes(Encoding.PEM)


def key_pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    """Return a private key in PEM format, without a password."""
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())


def read_certificate(path: Path) -> x509.Certificate:
    """Return the first certificate of a PEM file. Raises ConfigurationError."""
    content = read_file(path)
    try:
        return x509.load_pem_x509_certificate(content)
    except ValueError:
        raise ConfigurationError(f"{path} contains no certificate in PEM format") from None


def read_authority(certificate: Path, key: Path) -> KeyPair:
    """Return the authority in two PEM files. Raises ConfigurationError."""
    authority, content = read_certificate(certificate), read_file(key)
    try:
        private_key = load_pem_private_key(content, password=None)
    except (ValueError, TypeError):
        raise ConfigurationError(f"{key} contains no private key without a password") from None
    if not isinstance(private_key, ec.EllipticCurvePrivateKey):
        raise ConfigurationError(f"{key} is not an elliptic-curve key, as `pneuforce certificates` makes it")
    if private_key.public_key() != authority.public_key():
        raise ConfigurationError(f"{key} is not the key of {certificate}")
    return KeyPair(authority, private_key)


def _signed(
    authority: KeyPair,
    name: str,
    extensions: list[x509.ExtensionType],
    usage: x509.ObjectIdentifier,
    now: datetime,
    days: int,
) -> KeyPair:
    key = ec.generate_private_key(ec.SECP256R1())
    issuer = authority.certificate
    builder = (
        _builder(name, _common_name(issuer), key, now, days, issuer.not_valid_after_utc)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_key_usage(authority=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage([usage]), critical=False)
        .add_extension(_authority_id(authority), critical=False)
    )
    for extension in extensions:
        builder = builder.add_extension(extension, critical=False)
    return KeyPair(builder.sign(authority.key, SHA256()), key)


def _builder(
    name: str,
    issuer: str,
    key: ec.EllipticCurvePrivateKey,
    now: datetime,
    days: int,
    latest_end: datetime | None = None,
) -> x509.CertificateBuilder:
    end = now + timedelta(days=days)
    return (
        x509.CertificateBuilder()
        .subject_name(_name(name))
        .issuer_name(_name(issuer))
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - CLOCK_TOLERANCE)
        .not_valid_after(min(end, latest_end or end))
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
    )


def _authority_id(authority: KeyPair) -> x509.AuthorityKeyIdentifier:
    return x509.AuthorityKeyIdentifier.from_issuer_public_key(authority.key.public_key())


def _name(common_name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])


def _common_name(certificate: x509.Certificate) -> str:
    return str(certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value)


def _general_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _key_usage(*, authority: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not authority,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=not authority,
        key_cert_sign=authority,
        crl_sign=authority,
        encipher_only=False,
        decipher_only=False,
    )
