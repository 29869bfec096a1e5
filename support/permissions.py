"""Sentences about files that a user cannot read or write, with the command that corrects the permissions."""

from __future__ import annotations

import os
import stat
from pathlib import Path

_GROUP_BITS = {"r": stat.S_IRGRP, "x": stat.S_IXGRP}
SERVICE_FOLDER = Path("/var/lib/pneuforce")  #: folder of the service for files that it writes
_FIRST_PERSON = 1000  #: smallest user id of a person; those of services are below (Debian Policy 9.2.2)


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


def write_problem(file: Path) -> str:
    """Return why the user may not create or write a file, "" if this is possible.

    Raises PermissionError. A read-only file system is no problem, because it may become writable again
    without a change of names or permissions.
    """
    if (problem := folder_problem(file.parent)) or not file.exists() or is_read_only(file.parent):
        return problem
    is_permitted = permitted(file, os.R_OK | os.W_OK)
    return "" if is_permitted else f"{user_name()} cannot write to {file}: chown {account()} {file}"


def folder_problem(folder: Path) -> str:
    """Return why the user may not create a file in a folder; "" if this is possible.

    Raises PermissionError.
    """
    try:
        if not stat.S_ISDIR(folder.stat().st_mode):
            return f"{folder} is a file, not a folder: choose another folder"
    except (FileNotFoundError, NotADirectoryError):
        return f"the folder {folder} is missing: create the folder, or choose another one"
    if permitted(folder, os.W_OK | os.X_OK) or is_read_only(folder):
        return ""
    if folder.absolute().is_relative_to(SERVICE_FOLDER):
        remedy = f"chown {account()} {folder} && chmod u+rwx {folder}"
    else:
        remedy = f"choose another folder, for a service {SERVICE_FOLDER}"
    return f"{user_name()} cannot write to the folder {folder}: {remedy}"


def unreadable(path: Path) -> str:
    """Return which user cannot read a file, and the remedy: permission for the group of this user."""
    path = path.absolute()
    closed = next((folder for folder in reversed(path.parents) if not permitted(folder, os.X_OK)), None)
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


def permitted(path: Path, access: int) -> bool:
    """Return True if the user may access a file or folder. `access` is os.R_OK, os.W_OK or os.X_OK."""
    return os.access(path, access, effective_ids=True)


def is_read_only(folder: Path) -> bool:
    """Return True if the file system of a folder is read-only, for example after a disk error."""
    try:
        return bool(os.statvfs(folder).f_flag & os.ST_RDONLY)
    except FileNotFoundError:
        return False


def _remedy(path: Path, permission: str) -> str:
    """Return the command that permits the access.

    If another group has this permission already, for example that of the service, a person must not change
    the group: the service could no longer read the file.
    """
    status = path.stat()
    if os.geteuid() >= _FIRST_PERSON and status.st_gid and status.st_mode & _GROUP_BITS[permission]:
        return f"run the command as a member of the group {_group(status.st_gid)}, or with sudo"
    return f"chgrp {_group(os.getegid())} {path} && chmod g+{permission} {path}"


def _group(number: int) -> str:
    """Return the name of a group, or its number."""
    import grp  # Windows has no such module

    try:
        return grp.getgrgid(number).gr_name
    except KeyError:
        return str(number)
