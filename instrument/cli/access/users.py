"""`pneuforce users`: changes of the file of the users, and the input of a password."""

from __future__ import annotations

import sys
from getpass import getpass
from pathlib import Path

from pneuforce.errors import UsageError
from pneuforce.instrument.cli.terminal.output import done_json, print_done, print_text
from pneuforce.instrument.users.file import (
    MAX_USERS,
    NAME,
    NAME_RULE,
    User,
    load_users,
    write_users,
)
from pneuforce.instrument.users.password import MAX_CHARACTERS, PasswordHash, hash_password
from pneuforce.support.atomic_file import check_writable
from pneuforce.support.counted import counted


def add_user(path: Path, name: str, role: str, as_json: bool) -> None:
    """Add a user. Raises UsageError or ConfigurationError."""
    users = load_users(path)
    if not NAME.fullmatch(name):
        raise UsageError(f"{name!r} cannot be the name of a user: use {NAME_RULE}")
    if name in users:
        raise UsageError(
            f"{name} exists in {path}: pneuforce users password sets a new password, pneuforce users remove "
            "removes the user"
        )
    if len(users) >= MAX_USERS:
        raise UsageError(f"{path} contains {MAX_USERS} users, which is the maximum: remove one first")
    check_writable(path)  # before a person types a password
    write_users(path, users | {name: User(name, role, _new_hash(name))})
    print_done(f"{name} can log in as {role}; {path} is changed", as_json, name=name, role=role)


def list_users(path: Path, as_json: bool) -> None:
    """Print names and roles. Raises ConfigurationError."""
    roles = {user.name: user.role for user in load_users(path).values()}
    if as_json:
        print_text(done_json(counted(len(roles), "user"), file=str(path), users=roles))
    else:
        print_text("\n".join(f"{name:32} {role}" for name, role in sorted(roles.items())) or "no users")


def remove_user(path: Path, name: str, as_json: bool) -> None:
    """Remove a user. Raises UsageError or ConfigurationError."""
    users = load_users(path)
    _known(users, path, name)
    write_users(path, {other: user for other, user in users.items() if other != name})
    print_done(f"{name} can no longer log in; {path} is changed", as_json, name=name)


def set_password(path: Path, name: str, as_json: bool) -> None:
    """Set the password of a user. Raises UsageError or ConfigurationError."""
    users = load_users(path)
    role = _known(users, path, name).role
    check_writable(path)  # before a person types a password
    write_users(path, users | {name: User(name, role, _new_hash(name))})
    print_done(f"{name} has a new password; {path} is changed", as_json, name=name, role=role)


def _known(users: dict[str, User], path: Path, name: str) -> User:
    """Return a user. Raises UsageError if there is no user of this name."""
    if name not in users:
        raise UsageError(f"{path} contains no user {name!r}: its users are {', '.join(users) or 'none'}")
    return users[name]


def _new_hash(name: str) -> PasswordHash:
    """Return the hash of a password that a person types twice, or that is the first line of stdin.

    Raises UsageError if the password is not allowed. No message contains a password.
    """
    try:
        if sys.stdin.isatty():
            password = getpass(f"New password of {name}: ")
            if getpass("The same again: ") != password:
                raise UsageError("the two passwords differ: nothing was changed")
        else:
            password = sys.stdin.readline(MAX_CHARACTERS + 2).rstrip("\r\n")
        return hash_password(password)
    except EOFError:
        raise UsageError("no password was typed: nothing was changed") from None
    except UnicodeDecodeError:
        raise UsageError("the password is not UTF-8 text: nothing was changed") from None
    except ValueError as error:
        raise UsageError(f"{error}. Nothing was changed") from None
