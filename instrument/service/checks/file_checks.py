"""Check of the files and folders of a configuration: what the instrument could not use later."""

from __future__ import annotations

import os
import sqlite3
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.audit.store import check_event_log
from pneuforce.instrument.config import Configuration
from pneuforce.instrument.recording.limits import RecordingLimits
from pneuforce.instrument.service.buses.parameter_file import storage_of
from pneuforce.instrument.service.checks.configured_files import ConfiguredFile, configured_files
from pneuforce.instrument.service.checks.service_user import SERVICE_USER, service_permissions
from pneuforce.instrument.users.file import load_users
from pneuforce.support.atomic_file import STDIN
from pneuforce.support.permissions import (
    account,
    folder_problem,
    is_read_only,
    permitted,
    read_problem,
    user_name,
    write_problem,
)

#: Folders that systemd creates when the service starts: StateDirectory and RuntimeDirectory of the unit. The
#: unit pneuforce@NAME creates the folder NAME in them. The service can write to no other folder.
SERVICE_FOLDERS = (Path("/var/lib/pneuforce"), Path("/run/pneuforce"))
RECORDINGS = "web.recordings"  #: key of the folder of the recordings that operators make on the page


class FileReport(NamedTuple):
    """Result of the checks. Each problem and each remark is one clause that begins with the key."""

    problems: list[str]  #: must be corrected before the start
    remarks: list[str]  #: do not prevent the start, or are correct if systemd starts the instrument


def check_files(configuration: Configuration, path: Path, user: str = SERVICE_USER) -> FileReport:
    """Check each file that a configuration names, without creating or changing a file.

    `path` is the configuration file, to which the names of files are relative. Root checks the files with the
    permissions of the user of the service, if this user exists.
    """
    report = FileReport([], [])
    with service_permissions(user) as is_service_user:
        for file in configured_files(configuration, path):
            _check_file(file._replace(path=file.path.absolute()), path, is_service_user, report)
            if file.key == RECORDINGS:
                report.remarks.extend(_full_disk_remarks(file.path.absolute(), configuration))
    return report


def _full_disk_remarks(folder: Path, configuration: Configuration) -> Iterator[str]:
    """Yield a clause if the disk has too little free space for a recording of the page."""
    limits = RecordingLimits(min_free_bytes=configuration.web.recording_min_free_mb * 1e6)
    try:
        reason = limits.reached(_existing(folder), 0)
    except OSError:
        return  # the check of the folder reports it
    if reason:
        yield f"{RECORDINGS}: no recording can start: {reason}: delete files, or choose another folder"


def _check_file(file: ConfiguredFile, configuration: Path, is_service_user: bool, report: FileReport) -> None:
    folder = file.path.parent
    own_folders = [*SERVICE_FOLDERS, *(shared / configuration.stem for shared in SERVICE_FOLDERS)]
    try:
        if file.is_written and folder in own_folders and not os.path.lexists(folder):
            report.remarks.append(
                f"{file.key}: the folder {folder} is missing until systemd starts the service"
            )
        elif problem := _CHECKS.get(file.key, _read_problem)(file.path):
            report.problems.append(f"{file.key}: {problem}")
        elif file.is_written and is_read_only(folder):
            report.remarks.append(f"{file.key}: the file system of {folder} is read-only: nothing is written")
        elif file.is_written and is_service_user and not any(map(file.path.is_relative_to, SERVICE_FOLDERS)):
            report.remarks.append(
                f"{file.key}: the systemd unit permits no writing to {folder}: choose a folder in "
                f"{SERVICE_FOLDERS[0]}, or add ReadWritePaths={folder} to the unit"
            )
        elif file.key in _SECRETS and file.path.exists() and _is_public(file.path):
            report.remarks.append(f"{file.key}: every user can read {file.path}: chmod o-r {file.path}")
    except PermissionError:
        if is_service_user:  # otherwise the user of the service may have this permission
            report.problems.append(
                f"{file.key}: {user_name()} cannot open the folders of {file.path}: chmod o+x them"
            )
    except OSError as error:
        report.problems.append(f"{file.key}: {file.path}: {error.strerror}: choose another name")


def _is_public(file: Path) -> bool:
    """Return True if every user of the computer can open the folders of a file and read the file."""
    modes = [folder.stat().st_mode for folder in file.parents]
    return bool(file.stat().st_mode & stat.S_IROTH) and all(mode & stat.S_IXOTH for mode in modes)


def _read_problem(file: Path) -> str:
    """Return why a file cannot be read, "" if this is possible."""
    if file == STDIN or permitted(file, os.R_OK):
        return ""
    return read_problem(file)


def _event_log_problem(file: Path) -> str:
    if problem := write_problem(file):
        return problem
    try:
        check_event_log(file)
    except ConfigurationError as error:
        return str(error)
    except sqlite3.Error as error:
        return f"{file} cannot be read: {error}: move the file away"
    return ""


def _socket_problem(file: Path) -> str:
    if (problem := folder_problem(file.parent)) or not file.exists() or file.is_socket():
        return problem
    return f"{file} is a file, not a socket: choose another name"


def _parameter_problem(file: Path) -> str:
    problem = storage_of(file, configured_node_id=1).problem
    return f"{file}: {problem}: move the file away" if problem else folder_problem(file.parent)


def _users_problem(file: Path) -> str:
    """Return why a file of users cannot be used."""
    if file.exists() and not permitted(file, os.R_OK):
        return f"{user_name()} cannot read {file}: chown {account()} {file}"
    try:
        load_users(file)
    except ConfigurationError as error:
        return str(error)
    if file.exists() and file.stat().st_mode & stat.S_IWOTH:
        return f"every user can write {file}, and so create a user of the page: chmod 600 {file}"
    return ""


def _recordings_problem(folder: Path) -> str:
    """Return why a folder of recordings cannot be used. The first recording creates a missing folder."""
    if folder.exists() and not folder.is_dir():
        return f"{folder} is a file, not a folder: choose another name"
    return folder_problem(_existing(folder))


def _existing(folder: Path) -> Path:
    """Return a folder, or the nearest folder above it that exists."""
    return next(each for each in (folder, *folder.parents) if each.exists())


#: Keys of the files that only the service may read. An instrument starts nevertheless.
_SECRETS = frozenset({"modbus_security.key", "web.key", "mqtt.key", "mqtt.password_file", "web.users_file"})

#: Checks by the key of the file. Every other file is only read.
_CHECKS: dict[str, Callable[[Path], str]] = {
    "events.file": _event_log_problem,
    "local.socket": _socket_problem,
    "can.parameter_file": _parameter_problem,
    "mqtt.store": write_problem,
    "web.users_file": _users_problem,
    RECORDINGS: _recordings_problem,
}
