"""Limit of open files of this process.

Each connection needs a file descriptor. Without a free descriptor no client can connect, not even to vent.
"""

from __future__ import annotations

import errno
import resource

#: Connections that asyncio accepts in one pass of the event loop.
ACCEPTED_PER_PASS = 128
#: Number of passes of the event loop until evicted connections are closed.
_PASSES_UNTIL_CLOSED = 4
#: Number of other files that this process opens: rig, CAN, logs, libraries.
_OTHER_FILES = 64


def raise_open_file_limit(connections: int) -> None:
    """Raise the soft limit of open files, if needed, so that `connections` clients can connect.

    Raises OSError if the hard limit is too low.
    """
    needed = connections + _PASSES_UNTIL_CLOSED * ACCEPTED_PER_PASS + _OTHER_FILES
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if _is_enough(soft, needed):
        return
    if not _is_enough(hard, needed):
        raise OSError(
            errno.EMFILE,
            f"{connections} connections need up to {needed} open files, but the limit is {hard}: raise it "
            "(ulimit -n), or configure fewer connections",
        )
    resource.setrlimit(resource.RLIMIT_NOFILE, (needed, hard))


def _is_enough(limit: int, needed: int) -> bool:
    return limit == resource.RLIM_INFINITY or limit >= needed
