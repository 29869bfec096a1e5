"""Signature files of `ssh-keygen -Y sign` (format SSHSIG of OpenSSH) with Ed25519 keys: decode and verify.

The format is described in the file PROTOCOL.sshsig of OpenSSH.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
from typing import NamedTuple

#: Purpose in the signature. A signature that was made for a mail or a commit is invalid.
NAMESPACE = "pneuforce"
KEY_TYPE = b"ssh-ed25519"
KEY_BYTES, SIGNATURE_BYTES = 32, 64
_MAGIC, _VERSION = b"SSHSIG", 1
_BEGIN, _END = b"-----BEGIN SSH SIGNATURE-----", b"-----END SSH SIGNATURE-----"
_DIGESTS = {b"sha256": hashlib.sha256, b"sha512": hashlib.sha512}


class SshSignature(NamedTuple):
    """Content of a signature file."""

    public_key: bytes  #: Ed25519 key of the signer, 32 bytes
    hash_name: bytes  #: sha256 or sha512
    signature: bytes  #: 64 bytes

    def matches(self, content: bytes) -> bool:
        """Return True if the owner of `public_key` has signed exactly these bytes."""
        # Imported here, because the library is needed only for an instrument with a signed file.
        from cryptography.exceptions import InvalidSignature
        from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

        digest = _DIGESTS[self.hash_name](content).digest()
        signed = _MAGIC + b"".join(map(_field, (NAMESPACE.encode(), b"", self.hash_name, digest)))
        try:
            Ed25519PublicKey.from_public_bytes(self.public_key).verify(self.signature, signed)
        except (InvalidSignature, ValueError):
            return False
        return True


def decode_signature(armored: bytes) -> SshSignature:
    """Return the content of a signature file.

    Raises ValueError with the reason if the file is malformed, or not made with an Ed25519 key for this
    program.
    """
    data = _Reader(_unarmored(armored))
    if data.take(len(_MAGIC)) != _MAGIC or data.number() != _VERSION:
        raise ValueError("it is not a signature of ssh-keygen")
    public_key = decode_public_key(data.field())
    if data.field() != NAMESPACE.encode():
        raise ValueError(f"it was made for another purpose: sign with the namespace {NAMESPACE}")
    data.field()  # reserved
    hash_name = data.field()
    if hash_name not in _DIGESTS:
        raise ValueError("its hash is neither sha256 nor sha512")
    inner = _Reader(data.field())
    is_ed25519, signature = inner.field() == KEY_TYPE, inner.field()
    if not is_ed25519 or len(signature) != SIGNATURE_BYTES or inner.rest or data.rest:
        raise ValueError("it is not one Ed25519 signature")
    return SshSignature(public_key, hash_name, signature)


def decode_public_key(blob: bytes) -> bytes:
    """Return the 32 bytes of the Ed25519 key in a public key of OpenSSH.

    Raises ValueError for another type of key.
    """
    data = _Reader(blob)
    if data.field() != KEY_TYPE:
        raise ValueError("its key is not of the type ssh-ed25519")
    key = data.field()
    if len(key) != KEY_BYTES or data.rest:
        raise ValueError("its key is not an Ed25519 key")
    return key


def fingerprint(public_key: bytes) -> str:
    """Return the fingerprint of an Ed25519 key as `ssh-keygen -l` prints it."""
    digest = hashlib.sha256(_field(KEY_TYPE) + _field(public_key)).digest()
    return "SHA256:" + base64.b64encode(digest).decode().rstrip("=")


def _unarmored(armored: bytes) -> bytes:
    text = armored.strip()
    if not (text.startswith(_BEGIN) and text.endswith(_END)):
        raise ValueError("it does not begin and end as a signature of ssh-keygen")
    try:
        return base64.b64decode(b"".join(text[len(_BEGIN) : -len(_END)].split()), validate=True)
    except binascii.Error:
        raise ValueError("it is damaged") from None


def _field(content: bytes) -> bytes:
    return len(content).to_bytes(4, "big") + content


class _Reader:
    """Reader of the binary format of OpenSSH. Each method raises ValueError at the end of the data."""

    def __init__(self, data: bytes) -> None:
        self.rest = data

    def take(self, count: int) -> bytes:
        if len(self.rest) < count:
            raise ValueError("it is cut short")
        taken, self.rest = self.rest[:count], self.rest[count:]
        return taken

    def number(self) -> int:
        return int.from_bytes(self.take(4), "big")

    def field(self) -> bytes:
        return self.take(self.number())
