"""The far end of the serial cable: a pty whose other end looks like a serial port to the host."""

from __future__ import annotations

import os
import tty
from contextlib import suppress
from pathlib import Path

READ_BYTES = 4096


class Cable:
    """A pty pair, raw. Like a UART it never waits: what nobody reads is lost once the buffer is full."""

    def __init__(self, link: Path | None = None) -> None:
        """Open the pair and point the symlink `link` to the host's end.

        Raises FileExistsError where `link` is something else than a symlink, or OSError.
        """
        self._link = link
        self.plug()

    def plug(self) -> None:
        """Plug in: the port may have another name than before, the link points to it."""
        self._board_end, self._host_end = os.openpty()
        tty.setraw(self._host_end)
        os.set_blocking(self._board_end, False)
        self.port = os.ttyname(self._host_end)
        self.plugged = True
        if self._link:
            _point(self._link, self.port)

    def pull(self) -> None:
        """Unplug: the host's port is gone, and the link if it still is ours."""
        self.plugged = False
        if self._link and self._link.is_symlink() and os.readlink(self._link) == self.port:
            self._link.unlink()
        os.close(self._board_end)
        os.close(self._host_end)

    def fileno(self) -> int:
        """Descriptor that becomes readable when the host has written."""
        return self._board_end

    def read(self) -> bytes:
        """Bytes that the host has written, without waiting."""
        if not self.plugged:
            return b""
        try:
            return os.read(self._board_end, READ_BYTES)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        """Send to the host; what does not fit, or finds nobody, is dropped."""
        if not self.plugged:
            return
        with suppress(BlockingIOError):
            os.write(self._board_end, data)

    def close(self) -> None:
        """Unplug for good."""
        if self.plugged:
            self.pull()


def _point(link: Path, target: str) -> None:
    """Make `link` a symlink to `target`, replacing an older symlink in one step."""
    if link.exists() and not link.is_symlink():
        raise FileExistsError(f"{link} exists and is not a symlink: choose another place for the rig's port")
    fresh = link.with_name(f".{link.name}.{os.getpid()}")
    fresh.symlink_to(target)
    fresh.replace(link)
