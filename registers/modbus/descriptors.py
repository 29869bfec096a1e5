"""Open files: a connection takes one, and where none is left nobody can connect, not even to vent."""

from __future__ import annotations

import errno
import resource

#: Connections that asyncio accepts in one pass of the loop.
ACCEPTED_AT_ONCE = 128
#: So many passes go by before those that a newcomer evicts are closed.
_PASSES = 4
#: Of the rest of the process: the rig, CAN, logs, libraries.
_OTHERS = 64


def make_room(connections: int) -> None:
    """Let this process open as many files as `connections` need. Raises OSError where it may not."""
    needed = connections + _PASSES * ACCEPTED_AT_ONCE + _OTHERS
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if _reaches(soft, needed):
        return
    if not _reaches(hard, needed):
        raise OSError(
            errno.EMFILE,
            f"{connections} connections need up to {needed} open files, and {hard} are allowed (ulimit -n)",
        )
    resource.setrlimit(resource.RLIMIT_NOFILE, (needed, hard))


def _reaches(limit: int, needed: int) -> bool:
    return limit == resource.RLIM_INFINITY or limit >= needed
