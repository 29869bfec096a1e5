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
        self._open()
        self.plug()

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
        with suppress(BlockingIOError):
            os.write(self._board_end, data)

    def plug(self) -> None:
        """Plug in: the link points to the port."""
        self.plugged = True
        if self._link:
            _point(self._link, self.port)

    def pull(self) -> None:
        """Unplug: the port is gone, and the link. The next port has another name, as an adapter's may."""
        self._unlink()
        ends = self._board_end, self._host_end
        self._open()
        for end in ends:
            os.close(end)

    def close(self) -> None:
        """Unplug for good."""
        self._unlink()
        os.close(self._board_end)
        os.close(self._host_end)

    def _open(self) -> None:
        self._board_end, self._host_end = os.openpty()
        tty.setraw(self._host_end)
        os.set_blocking(self._board_end, False)
        self.port = os.ttyname(self._host_end)

    def _unlink(self) -> None:
        """Take the link away if it still is ours."""
        self.plugged = False
        if self._link and self._link.is_symlink() and os.readlink(self._link) == self.port:
            self._link.unlink()


def _point(link: Path, target: str) -> None:
    """Make `link` a symlink to `target`, replacing an older symlink in one step."""
    if link.exists() and not link.is_symlink():
        raise FileExistsError(f"{link} exists and is not a symlink: choose another place for the rig's port")
    fresh = link.with_name(f".{link.name}.{os.getpid()}")
    fresh.symlink_to(target)
    fresh.replace(link)
