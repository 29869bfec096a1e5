"""Error of a file that cannot be written: a wrong name, or a disk that is full or defective."""

from __future__ import annotations

import errno
from pathlib import Path

from pneuforce.errors import ConfigurationError, PneuforceError, WriteFailed

#: Errors of the disk. Another name on the same disk does not help.
_DISK_ERRORS = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO})
REMEDY = "free space on the disk, or write to another disk"


def write_error(path: Path, error: OSError) -> PneuforceError:
    """Return WriteFailed with a remedy for an error of the disk, and ConfigurationError for a wrong name."""
    message = f"{path}: cannot be written: {error.strerror or error}"
    return WriteFailed(f"{message}: {REMEDY}") if is_disk_error(error) else ConfigurationError(message)


def is_disk_error(error: OSError) -> bool:
    """Return True if the disk is full or defective, or the file has reached its size limit."""
    return error.errno in _DISK_ERRORS
