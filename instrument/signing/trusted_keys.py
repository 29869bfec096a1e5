"""File of the keys that an administrator trusts, in the format of the allowed signers of OpenSSH."""

from __future__ import annotations

import base64
import binascii
import os
import re
import stat
from pathlib import Path
from typing import NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.signing.ssh_signature import KEY_TYPE, NAMESPACE, decode_public_key
from pneuforce.support.atomic_file import read_file

#: Name of the file in the folder of the configuration.
FILE_NAME = "trusted-keys"
#: Names of signers. Patterns such as * are not permitted, because the name is shown as the signer.
SIGNER_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@+-]{0,63}")
_FORM = f"signer's name, {KEY_TYPE.decode()}, key"
_PERMITTED_OPTION = f'namespaces="{NAMESPACE}"'


class TrustedKey(NamedTuple):
    """Public key and the name of its owner."""

    name: str
    public_key: bytes


class TrustedKeys(NamedTuple):
    """Keys that may sign the files of an instrument."""

    keys: tuple[TrustedKey, ...] = ()
    file: Path | None = None
    required: bool = False  #: refuse a file that none of these keys has signed

    def owner_of(self, public_key: bytes) -> str:
        """Return the name of the owner of a key, "" if the key is not trusted."""
        return next((key.name for key in self.keys if key.public_key == public_key), "")


NO_TRUSTED_KEYS = TrustedKeys()


def trusted_keys_of(configuration_file: Path, required_file: Path | None) -> TrustedKeys:
    """Return the keys in `required_file`. Without it, return the keys beside the configuration, if any.

    Raises ConfigurationError if the file is invalid, or if it is required and cannot protect anything.
    """
    if required_file is None:
        file = configuration_file.parent / FILE_NAME
        if not os.path.lexists(file):
            return NO_TRUSTED_KEYS
        return TrustedKeys(parse_trusted_keys(read_file(file), file), file)
    keys = parse_trusted_keys(read_file(required_file), required_file)
    if not keys:
        raise ConfigurationError(f"{required_file}: the file contains no key: add a line with {_FORM}")
    if required_file.stat().st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise ConfigurationError(
            f"{required_file}: other users may write this file, so it proves nothing: "
            f"chmod go-w {required_file}"
        )
    return TrustedKeys(keys, required_file, required=True)


def parse_trusted_keys(content: bytes, file: Path) -> tuple[TrustedKey, ...]:
    """Return the keys in the content of a file. Raises ConfigurationError with the number of a wrong line."""
    try:
        lines = content.decode("utf-8").splitlines()
    except UnicodeDecodeError:
        raise ConfigurationError(f"{file}: not UTF-8 text") from None
    keys = []
    for number, line in enumerate(lines, 1):
        words = line.split()
        if words and not words[0].startswith("#"):
            try:
                keys.append(_trusted_key(words))
            except ValueError as error:
                raise ConfigurationError(f"{file}: line {number}: {error}") from None
    return tuple(keys)


def _trusted_key(words: list[str]) -> TrustedKey:
    """Return the key of a line. Raises ValueError."""
    name, *rest = words
    if rest and rest[0] == _PERMITTED_OPTION:
        rest = rest[1:]
    if not SIGNER_NAME.fullmatch(name) or len(rest) < 2 or rest[0] != KEY_TYPE.decode():
        raise ValueError(f"expected: {_FORM}; the only option is {_PERMITTED_OPTION}")
    try:
        return TrustedKey(name, decode_public_key(base64.b64decode(rest[1], validate=True)))
    except (binascii.Error, ValueError):
        raise ValueError("the key is damaged: copy the line of the file .pub again") from None
