"""Link to the serial port of a simulator, and its lock file, which show if the simulator still runs.

The system gives the name of a pseudo-terminal, for example /dev/pts/3, to the next program as soon as it is
free. The link of a killed simulator can therefore lead to the port of another program.
"""

from __future__ import annotations

import fcntl
import os
from pathlib import Path


def control_port_file(link: Path) -> Path:
    """Return the path of the file that contains the control port, next to the link to the serial port.

    A running simulator has locked this file.
    """
    return link.with_name(f"{link.name}.control")


def is_left_behind(link: Path) -> bool:
    """Return True if `link` is a link whose simulator was killed.

    A link without a control port file is not the link of a simulator, and counts as valid.
    """
    if not (link.name and link.is_symlink()):
        return False
    try:
        descriptor = os.open(
            control_port_file(link), os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
        )
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return False
    finally:
        os.close(descriptor)
    return True
