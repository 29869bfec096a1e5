"""Sentence about a file that a user cannot read, with the command that corrects its permissions."""

from __future__ import annotations

import os
from pathlib import Path


def read_problem(path: Path) -> str:
    """Return why a file cannot be read, with the remedy; "" if this is possible."""
    try:
        with path.open("rb"):
            return ""
    except FileNotFoundError:
        return f"{path}: no such file: create the file, or correct its name"
    except PermissionError as error:
        return unreadable(path) if os.name == "posix" else f"{path}: {error.strerror}"
    except OSError as error:
        return f"{path}: {error.strerror}"


def unreadable(path: Path) -> str:
    """Return which user cannot read a file, and the remedy: permission for the group of this user."""
    path = path.absolute()
    closed = next((folder for folder in reversed(path.parents) if not _permitted(folder, os.X_OK)), None)
    if closed is None:
        return f"{user_name()} cannot read {path}: {_remedy(path, 'r')}"
    return f"{user_name()} cannot open the folder {closed}: move the file, or {_remedy(closed, 'x')}"


def user_name() -> str:
    """Return the user whose permissions apply, in words."""
    return f"the user {account()}"


def account() -> str:
    """Return the user whose permissions apply, as an argument of chown: the name, or the number."""
    import pwd  # Windows has no such module

    number = os.geteuid()
    try:
        return pwd.getpwuid(number).pw_name
    except KeyError:
        return str(number)


def _permitted(folder: Path, access: int) -> bool:
    return os.access(folder, access, effective_ids=True)


def _remedy(path: Path, permission: str) -> str:
    import grp  # Windows has no such module

    number = os.getegid()
    try:
        group = grp.getgrgid(number).gr_name
    except KeyError:
        group = str(number)
    return f"chgrp {group} {path} && chmod g+{permission} {path}"
