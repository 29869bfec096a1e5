"""Check of the files and folders of a configuration: what the instrument could not create or use later."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.audit.reading import DamagedLogError, open_event_log
from pneuforce.instrument.config import Configuration, resolve_path
from pneuforce.instrument.service.parameter_file import storage_of
from pneuforce.instrument.users.file import load_users

#: Folders that systemd creates when the service starts: StateDirectory and RuntimeDirectory of the unit.
SERVICE_FOLDERS = (Path("/var/lib/pneuforce"), Path("/run/pneuforce"))


class FileReport(NamedTuple):
    """Result of the checks. Each problem and each remark is one clause that begins with the key."""

    problems: list[str]  #: must be corrected before the start
    remarks: list[str]  #: are correct if systemd starts the instrument


def check_files(configuration: Configuration, path: Path) -> FileReport:
    """Check each file that a configuration names, without creating or changing a file.

    `path` is the configuration file, to which the names of files are relative.
    """
    report = FileReport([], [])
    for key, name, find_problem in _checked_files(configuration):
        file = resolve_path(path, name)
        if file is None:
            continue
        folder = file.absolute().parent
        if folder in SERVICE_FOLDERS and not os.path.lexists(folder):
            report.remarks.append(f"{key}: the folder {folder} is missing until systemd starts the service")
            continue
        with suppress(PermissionError):  # the user of the service may have this permission
            if problem := find_problem(file.absolute()):
                report.problems.append(f"{key}: {problem}")
    return report


def _checked_files(configuration: Configuration) -> Iterator[tuple[str, str, Callable[[Path], str]]]:
    """Yield the key, the name and the check of each file that the enabled parts use."""
    yield "events.file", configuration.events.file, _event_log_problem
    yield "local.socket", configuration.local.socket, _socket_problem
    can, web = configuration.can, configuration.web
    if can.enabled and can.mode == "canopen":
        yield "can.parameter_file", can.parameter_file, _parameter_problem
    if configuration.mqtt.enabled:
        yield "mqtt.store", configuration.mqtt.store, lambda file: _folder_problem(file.parent)
    if web.enabled:
        yield "web.users_file", web.users_file, _users_problem
        yield "web.recordings", web.recordings, _recordings_problem


def _folder_problem(folder: Path) -> str:
    """Return why no file can be created in a folder, "" if this is possible. Raises PermissionError."""
    try:
        if not stat.S_ISDIR(folder.stat().st_mode):
            return f"{folder} is a file, not a folder: choose another folder"
    except (FileNotFoundError, NotADirectoryError):
        return f"the folder {folder} is missing: create the folder, or choose another one"
    return "" if os.access(folder, os.W_OK | os.X_OK) else f"this user cannot write to the folder {folder}"


def _event_log_problem(file: Path) -> str:
    if (problem := _folder_problem(file.parent)) or not file.exists():
        return problem
    try:
        with open_event_log(file) as records:
            next(records, None)
    except ConfigurationError as error:
        return str(error)
    except DamagedLogError as error:
        return f"{error}: name another file, or move this file away"
    return ""


def _socket_problem(file: Path) -> str:
    if (problem := _folder_problem(file.parent)) or not file.exists() or file.is_socket():
        return problem
    return f"{file} is a file, not a socket: choose another name"


def _parameter_problem(file: Path) -> str:
    problem = storage_of(file, configured_node_id=1).problem
    return f"{file}: {problem}: move the file away" if problem else _folder_problem(file.parent)


def _users_problem(file: Path) -> str:
    """Return why a file of users cannot be used, or that other users of the computer can read its hashes."""
    try:
        load_users(file)
    except ConfigurationError as error:
        return str(error)
    if file.exists() and file.stat().st_mode & (stat.S_IRWXG | stat.S_IRWXO):
        return f"{file} contains hashes of passwords, and other users can read it: chmod 600 {file}"
    return ""


def _recordings_problem(folder: Path) -> str:
    """Return why a folder of recordings cannot be used. The first recording creates a missing folder."""
    is_free = not folder.exists() or folder.is_dir()
    return "" if is_free else f"{folder} is a file, not a folder: choose another name"
