"""File of the users of the web page: TOML with one table for each user, readable only for its owner."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.users.password import PasswordHash
from pneuforce.registers.rights import DEFAULT_ROLES
from pneuforce.support.atomic_file import read_file, replaced_user_file
from pneuforce.support.toml_sections import decode_text, parse_tables

MAX_USERS = 64
MAX_FILE_BYTES = 65_536
FILE_MODE = 0o600
ROLES = tuple(DEFAULT_ROLES)
NAME = re.compile(r"[a-z0-9][a-z0-9._-]{0,31}")
NAME_RULE = "1 to 32 characters: small letters, digits, and after the first character also . _ -"
_HEAD = "# Users of the web page of pneuforce. Change this file with: pneuforce users\n"
_NUMBERS = {"cost": "scrypt_n", "block_size": "scrypt_r", "parallelism": "scrypt_p"}
_BYTES = {"salt": "salt", "digest": "hash"}
_KEYS = {"role", *_NUMBERS.values(), *_BYTES.values()}


@dataclass(frozen=True, slots=True)
class User:
    """User of the web page."""

    name: str
    role: str  #: a role of `registers/rights.py`
    password: PasswordHash


def load_users(path: Path) -> dict[str, User]:
    """Return the users of a file by name. A missing file contains no users.

    Raises ConfigurationError if the file cannot be read or is damaged.
    """
    with suppress(PermissionError):  # read_file reports this error
        if not path.exists():
            return {}
    content, name = read_file(path), f"{path}: the file of the users is damaged"
    try:
        if len(content) > MAX_FILE_BYTES:
            raise ValueError(f"{name}: it is larger than {MAX_FILE_BYTES} bytes")
        return parse_users(decode_text(content, name), name)
    except ValueError as error:
        raise ConfigurationError(
            f"{error}; restore a copy, or move the file away and create the users again with: "
            "pneuforce users add"
        ) from None


def parse_users(text: str, name: str = "the users") -> dict[str, User]:
    """Return the users in a TOML document by name.

    Raises ValueError if the document is damaged. `name` begins the message.
    """
    document = parse_tables(text, name)
    try:
        return _users_of(document)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def _users_of(document: dict[str, Any]) -> dict[str, User]:
    tables = document.pop("users", {})
    if document or not isinstance(tables, dict):
        raise ValueError("only tables [users.NAME] are allowed")
    if len(tables) > MAX_USERS:
        raise ValueError(f"it contains more than {MAX_USERS} users")
    return {name: _parse_user(name, table) for name, table in tables.items()}


def _parse_user(name: str, table: Any) -> User:
    if not NAME.fullmatch(name):
        raise ValueError(f"{name!r:.80} is not a name of a user ({NAME_RULE})")
    if not isinstance(table, dict) or table.keys() != _KEYS:
        raise ValueError(f"the user {name} needs exactly these keys: {', '.join(sorted(_KEYS))}")
    if table["role"] not in ROLES:
        raise ValueError(f"the role of {name} must be {' or '.join(ROLES)}")
    try:
        values: dict[str, Any] = {field: _number(table[key]) for field, key in _NUMBERS.items()}
        values |= {field: bytes.fromhex(table[key]) for field, key in _BYTES.items()}
        return User(name, table["role"], PasswordHash(**values))
    except (TypeError, ValueError) as error:
        raise ValueError(f"the hash of {name} is invalid: {error}") from None


def _number(value: Any) -> int:
    if not isinstance(value, int) or isinstance(value, bool):
        raise TypeError("a parameter is not a whole number")
    return value


def format_users(users: Mapping[str, User]) -> str:
    """Return the users as a TOML document, sorted by name."""
    return _HEAD + "".join(_format_user(users[name]) for name in sorted(users))


def _format_user(user: User) -> str:
    lines = ["", f'[users."{user.name}"]', f'role = "{user.role}"']
    lines += [f"{key} = {getattr(user.password, field)}" for field, key in _NUMBERS.items()]
    lines += [f'{key} = "{getattr(user.password, field).hex()}"' for field, key in _BYTES.items()]
    return "\n".join(lines) + "\n"


def write_users(path: Path, users: Mapping[str, User]) -> None:
    """Replace the file by one with these users, which only its owner can read.

    The owner stays the same; a new file belongs to the owner of its folder. The command can therefore be run
    by root for an instrument that runs as another user.

    Raises ConfigurationError if the file cannot be written, WriteFailed if the disk is full.
    """
    with replaced_user_file(path) as temporary:
        file = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, FILE_MODE)
        with open(file, "w", encoding="utf-8") as new:
            model = (path if path.exists() else path.absolute().parent).stat()
            if os.geteuid() == 0:
                os.fchown(file, model.st_uid, model.st_gid)
            new.write(format_users(users))
            new.flush()
            os.fsync(file)
