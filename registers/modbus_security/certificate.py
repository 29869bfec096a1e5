"""Identity of a client: name, role and end of validity in its X.509 certificate."""

from __future__ import annotations

from typing import NamedTuple

from cryptography import x509
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.x509.oid import NameOID

#: Extension that contains the role (MB-TCP-Security v36, section 8.3: id of the Modbus Organization).
ROLE_OID = x509.ObjectIdentifier("1.3.6.1.4.1.50316.802.1")
MAX_ROLE_BYTES = 64
MAX_NAME = 32
FINGERPRINT_DIGITS = 20  #: 80 of the 256 bits of the fingerprint
_UTF8_STRING = 0x0C
_SHORT_LENGTHS = 0x80  #: a DER length below this value is one byte


class ClientIdentity(NamedTuple):
    """Identity of a client whose certificate TLS has verified."""

    name: str  #: common name of the certificate and its fingerprint; unique for each certificate
    role: str  #: empty without a role, or with a malformed one
    valid_until_s: float  #: end of validity, in seconds since 1970-01-01 UTC


def identity_of(certificate: bytes) -> ClientIdentity:
    """Return the identity in a certificate (DER). Raises ValueError if it cannot be decoded."""
    try:
        decoded = x509.load_der_x509_certificate(certificate)
    except ValueError:
        raise ValueError("malformed certificate") from None
    fingerprint = decoded.fingerprint(SHA256()).hex()[:FINGERPRINT_DIGITS]
    names = decoded.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    common_name = _plain(str(names[0].value)) if names else ""
    valid_until_s = decoded.not_valid_after_utc.timestamp()
    return ClientIdentity(f"{common_name} {fingerprint}".strip(), _role_of(decoded), valid_until_s)


def encode_role(role: str) -> bytes:
    """Return the value of the role extension: an ASN.1 UTF8String (DER).

    Raises ValueError if the role is empty or longer than MAX_ROLE_BYTES.
    """
    text = role.encode()
    if not 0 < len(text) <= MAX_ROLE_BYTES:
        raise ValueError(f"a role has 1 to {MAX_ROLE_BYTES} bytes, not {len(text)}")
    return bytes((_UTF8_STRING, len(text))) + text


def _role_of(certificate: x509.Certificate) -> str:
    """Return the role; empty if there is none, more than one, or a malformed one."""
    try:
        value = certificate.extensions.get_extension_for_oid(ROLE_OID).value
    except (x509.ExtensionNotFound, x509.DuplicateExtension, ValueError):
        return ""
    assert isinstance(value, x509.UnrecognizedExtension)
    return _decode_role(value.value)


def _decode_role(value: bytes) -> str:
    """Return the text of an ASN.1 UTF8String (DER), empty if the value is anything else."""
    if len(value) < 3 or value[0] != _UTF8_STRING or value[1] >= _SHORT_LENGTHS or value[1] != len(value) - 2:
        return ""
    try:
        role = value[2:].decode()
    except UnicodeDecodeError:
        return ""
    return role if role.isprintable() and len(value) - 2 <= MAX_ROLE_BYTES else ""


def _plain(text: str) -> str:
    """Return a name for the log: printable ASCII without spaces, at most MAX_NAME characters."""
    return "".join(each if each.isascii() and each.isprintable() and each != " " else "_" for each in text)[
        :MAX_NAME
    ]
