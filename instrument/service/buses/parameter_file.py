"""File in which a CANopen master stores the parameters of the node. It is written in a background thread."""

from __future__ import annotations

import logging
import os
from concurrent.futures import Future
from functools import partial
from pathlib import Path

from pneuforce.errors import ConfigurationError
from pneuforce.registers.canopen.parameter_storage import ParameterStorage
from pneuforce.support.atomic_file import read_file, replaced_file
from pneuforce.support.background import start_in_background

log = logging.getLogger("pneuforce")


def storage_of(file: Path | None, configured_node_id: int) -> ParameterStorage:
    """Return the storage with the content of a file. Without a file, a master cannot store parameters.

    A file that is damaged or cannot be read is not used. `problem` of the storage then says why.
    """
    if file is None:
        return ParameterStorage(configured_node_id)
    content, problem = None, ""
    try:
        content = read_file(file) if file.exists() else None
    except (ConfigurationError, OSError) as error:
        problem = str(error)
    return ParameterStorage(configured_node_id, content, partial(write_in_background, file), problem)


def write_in_background(file: Path, content: bytes) -> Future[None]:
    """Start to replace a file, and return at once. The new file is on the disk when the future is done."""
    return start_in_background(partial(_write, file, content))


def _write(file: Path, content: bytes) -> None:
    try:
        with replaced_file(file) as temporary, temporary.open("wb") as opened:
            opened.write(content)
            opened.flush()
            os.fsync(opened.fileno())
    except OSError as error:
        log.warning("CANopen parameters not stored: %s: %s", file, error.strerror or error)
        raise
    log.info("CANopen parameters stored in %s", file)
