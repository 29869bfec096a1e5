"""Error of a file that cannot be written: a wrong name, or a disk that is full or defective."""

from __future__ import annotations

import errno
from pathlib import Path

from pneuforce.errors import ConfigurationError, PneuforceError, WriteFailed

#: Errors of the disk. Another name on the same disk does not help.
_DISK_ERRORS = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO})
REMEDY = "free space on the disk, or write to another disk"
_OTHER_USER = "run the command as a user who can write to the folder {}, or name another file"
#: Remedies for errors of the folder.
_FOLDER_REMEDIES = {
    errno.ENOENT: "create the folder {}, or name another file",
    errno.EACCES: _OTHER_USER,
    errno.EPERM: _OTHER_USER,
    errno.EROFS: "name a file on another disk",
}


def write_error(path: Path, error: OSError) -> PneuforceError:
    """Return WriteFailed with a remedy for an error of the disk, and ConfigurationError for a wrong name."""
    message = f"{path}: cannot be written: {error.strerror or error}"
    if is_disk_error(error):
        return WriteFailed(f"{message}: {REMEDY}")
    remedy = _FOLDER_REMEDIES.get(error.errno or 0, "").format(path.absolute().parent)
    return ConfigurationError(f"{message}: {remedy}" if remedy else message)


def is_disk_error(error: OSError) -> bool:
    """Return True if the disk is full or defective, or the file has reached its size limit."""
    return error.errno in _DISK_ERRORS
