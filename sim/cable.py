"""The far end of the serial cable: a pty whose other end looks like a serial port to the host."""

from __future__ import annotations

import os
import tty
from pathlib import Path

READ_BYTES = 4096


class Cable:
    """A pty pair, raw. Like a UART it never waits: what nobody reads is lost once the buffer is full."""

    def __init__(self, link: Path | None = None) -> None:
        """Open the pair and point the symlink `link` to the host's end.

        Raises FileExistsError where `link` is something else than a symlink, or OSError.
        """
        self._board_end, self._host_end = os.openpty()
        tty.setraw(self._host_end)
        os.set_blocking(self._board_end, False)
        self.port = os.ttyname(self._host_end)
        self._link = link
        if link:
            _point(link, self.port)

    def fileno(self) -> int:
        """Descriptor that becomes readable when the host has written."""
        return self._board_end

    def read(self) -> bytes:
        """Bytes that the host has written, without waiting."""
        try:
            return os.read(self._board_end, READ_BYTES)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        """Send to the host; what does not fit is dropped."""
        try:
            os.write(self._board_end, data)
        except BlockingIOError:
            return

    def close(self) -> None:
        """Unplug, and take the symlink away if it still is ours."""
        if self._link and self._link.is_symlink() and os.readlink(self._link) == self.port:
            self._link.unlink()
        os.close(self._board_end)
        os.close(self._host_end)


def _point(link: Path, target: str) -> None:
    """Make `link` a symlink to `target`, replacing an older symlink in one step."""
    if link.exists() and not link.is_symlink():
        raise FileExistsError(f"{link} exists and is not a symlink: choose another place for the rig's port")
    fresh = link.with_name(f".{link.name}.{os.getpid()}")
    fresh.symlink_to(target)
    fresh.replace(link)
