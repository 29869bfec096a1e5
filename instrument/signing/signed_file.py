"""A file and its detached signature: read each once, and decide whether a trusted key has signed the file."""

from __future__ import annotations

import os
import stat
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.signing.ssh_signature import decode_signature, fingerprint
from pneuforce.instrument.signing.trusted_keys import TrustedKeys
from pneuforce.support.atomic_file import read_file
from pneuforce.support.permissions import unreadable

SUFFIX = ".sig"
MAX_SIGNATURE_BYTES = 4096  #: a signature with an Ed25519 key has 300 bytes


class SignatureState(StrEnum):
    """State of a file. The register map contains the codes."""

    UNSIGNED = "unsigned"
    SIGNED = "signed"
    ALTERED = "altered"
    UNKNOWN_KEY = "unknown_key"
    NO_FILE = "no_file"


class FileSignature(NamedTuple):
    """Result of the check of one file."""

    state: SignatureState = SignatureState.UNSIGNED
    signer: str = ""  #: name in the file of trusted keys
    fingerprint: str = ""  #: of the key that has signed the file
    reason: str = ""  #: why the signature is not accepted

    @property
    def accepted(self) -> bool:
        """Return True if a trusted key has signed the file, or if no file is used."""
        return self.state in (SignatureState.SIGNED, SignatureState.NO_FILE)

    def __str__(self) -> str:
        """Return the state in words, with the signer or the reason."""
        if self.state is SignatureState.SIGNED:
            return f"signed by {self.signer} ({self.fingerprint})"
        state = self.state.replace("_", " ")
        return f"{state}: {self.reason}" if self.reason else state


class FileSignatures(NamedTuple):
    """Signatures of the files of an instrument."""

    configuration: FileSignature = FileSignature()
    calibration: FileSignature = FileSignature(SignatureState.NO_FILE)

    def warnings(self, trusted: TrustedKeys) -> list[str]:
        """Return a warning for each file that is not what a trusted person has signed.

        An unsigned file is a warning only if there are trusted keys.
        """
        return [
            f"the {name} file is {signature}"
            for name, signature in self._asdict().items()
            if not signature.accepted and (trusted.keys or signature.state is not SignatureState.UNSIGNED)
        ]


class SignedContent(NamedTuple):
    """Content of a file, and its signature. The content is exactly the bytes that were checked."""

    content: bytes
    signature: FileSignature


def signature_path(file: Path) -> Path:
    """Return the path of the detached signature of a file."""
    return file.with_name(f"{file.name}{SUFFIX}")


def read_signed(file: Path, trusted: TrustedKeys, remedy: str = "") -> SignedContent:
    """Read a file and its signature, each once.

    `remedy` says how to get a missing file. Raises ConfigurationError if the file cannot be read, or if a
    signature is required and not accepted.
    """
    content = read_file(file, remedy)
    signature = _signature_beside(file, content, trusted)
    if trusted.required and not signature.accepted:
        raise ConfigurationError(
            f"{file}: {signature}; a signature with a key in {trusted.file} is required: "
            f"check the content of the file, then sign it with pneuforce sign file {file} --key KEY"
        )
    return SignedContent(content, signature)


def check_signature(content: bytes, armored: bytes, trusted: TrustedKeys) -> FileSignature:
    """Return whether a trusted key has signed the content. `armored` is the content of the signature file."""
    try:
        signature = decode_signature(armored)
    except ValueError as error:
        return FileSignature(SignatureState.ALTERED, reason=f"the signature cannot be used: {error}")
    key = fingerprint(signature.public_key)
    if not signature.matches(content):
        reason = "the file is not the one that was signed"
        return FileSignature(SignatureState.ALTERED, fingerprint=key, reason=reason)
    signer = trusted.owner_of(signature.public_key)
    if not signer:
        where = trusted.file or "a file of trusted keys"
        reason = f"the key {key} is not in {where}"
        return FileSignature(SignatureState.UNKNOWN_KEY, fingerprint=key, reason=reason)
    return FileSignature(SignatureState.SIGNED, signer, key)


def _signature_beside(file: Path, content: bytes, trusted: TrustedKeys) -> FileSignature:
    path = signature_path(file)
    try:
        return check_signature(content, _read_small(path), trusted)
    except FileNotFoundError:
        return FileSignature()
    except PermissionError:
        return FileSignature(SignatureState.ALTERED, reason=unreadable(path))
    except OSError as error:
        reason = f"{path} cannot be read: {error.strerror or error}"
        return FileSignature(SignatureState.ALTERED, reason=reason)


def _read_small(path: Path) -> bytes:
    """Return the first bytes of a regular file, enough for a signature. Never block. Raises OSError."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with open(descriptor, "rb") as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError("not a regular file")
        return file.read(MAX_SIGNATURE_BYTES)
