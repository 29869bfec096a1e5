"""Lower priority of a process or of a thread, so that the instrument runs first on a busy computer."""

from __future__ import annotations

import os
from contextlib import suppress


def reduce_priority(niceness: int, thread_id: int = 0) -> None:
    """Set the niceness of this process, or of one of its threads.

    Do nothing if the system forbids it: the systemd unit of the instrument forbids changes of the priority.
    """
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, thread_id, niceness)
