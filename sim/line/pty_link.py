"""Pseudo-terminal that replaces the serial cable between the simulated board and the host."""

from __future__ import annotations

import os
import tty
from contextlib import suppress
from pathlib import Path
from secrets import token_hex

READ_BYTES = 4096


class PtyLink:
    """Pseudo-terminal pair in raw mode. The host end looks like a serial port.

    Like a UART, the link never blocks: when its buffer is full, further bytes are lost.
    """

    def __init__(self, link: Path | None = None) -> None:
        """Open the pair and create the symlink `link` to the host end.

        Raises FileExistsError if `link` exists and is not a symlink to a pseudo-terminal, or OSError if the
        pair or the symlink cannot be created.
        """
        self._link = link
        self._open()
        self.plug()

    def fileno(self) -> int:
        """Return the descriptor that becomes readable when the host has written."""
        return self._board_end

    def read(self) -> bytes:
        """Return the bytes that the host has written, without waiting."""
        try:
            return os.read(self._board_end, READ_BYTES)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        """Send bytes to the host. Bytes that do not fit into the buffer are lost."""
        with suppress(BlockingIOError):
            os.write(self._board_end, data)

    def plug(self) -> None:
        """Plug in the cable: create the symlink to the port."""
        self.plugged = True
        if self._link:
            _point(self._link, self.port)

    def unplug(self) -> None:
        """Unplug the cable: remove the port and the symlink.

        The next port has another name, as can happen with a USB adapter.
        """
        self._remove_link()
        ends = self._board_end, self._host_end
        self._open()
        for end in ends:
            os.close(end)

    def close(self) -> None:
        """Remove the symlink and close both ends."""
        self._remove_link()
        os.close(self._board_end)
        os.close(self._host_end)

    def _open(self) -> None:
        self._board_end, self._host_end = os.openpty()
        tty.setraw(self._host_end)
        os.set_blocking(self._board_end, False)
        self.port = os.ttyname(self._host_end)

    def _remove_link(self) -> None:
        """Remove the symlink if it still points to this port."""
        self.plugged = False
        if self._link and self._link.is_symlink() and os.readlink(self._link) == self.port:
            self._link.unlink()


def _point(link: Path, target: str) -> None:
    """Make `link` a symlink to `target`, a pseudo-terminal.

    A symlink to another pseudo-terminal, which a killed simulator has left, is replaced atomically.
    """
    with suppress(FileExistsError):
        link.symlink_to(target)
        return
    if not (link.is_symlink() and os.path.dirname(os.readlink(link)) == os.path.dirname(target)):
        raise FileExistsError(
            f"{link} exists and is not the link of a simulator: choose another path for the port of the rig "
            "(--link), or move that file"
        )
    temporary = link.with_name(f".{link.name}.{token_hex(4)}")
    temporary.symlink_to(target)
    temporary.replace(link)
