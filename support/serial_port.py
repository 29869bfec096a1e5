"""Serial port to the rig: a device, a pty, or pyserial's `socket://host:port` for a remote rig."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Protocol

import serial

from pneuforce.errors import PortBusy, PortUnavailable
from pneuforce.protocol.frames import BAUD
from pneuforce.support.network_name import is_socket_url
from pneuforce.support.readiness import is_writable
from pneuforce.support.simulator_link import is_left_behind
from pneuforce.support.user_part import without_user

MAX_READ_BYTES = 4096
#: Time after which a board that accepts no bytes counts as disconnected.
#: The event loop waits for at most this time.
WRITE_TIMEOUT_S = 0.02


class BytePort(Protocol):
    """Interface between the rig link and the hardware: bytes in and out, with a file descriptor."""

    def fileno(self) -> int:
        """Return the file descriptor that becomes readable when bytes arrive."""
        ...

    def read(self) -> bytes:
        """Return the received bytes without waiting. Raises OSError if the connection is lost."""
        ...

    def write(self, data: bytes) -> None:
        """Send bytes. Raises OSError if the connection is lost."""
        ...

    def close(self) -> None:
        """Close the port."""
        ...


class SerialPort:
    """Open serial port. A local device is locked for this process."""

    def __init__(self, url: str) -> None:
        """Open `url`. Raises PortBusy or PortUnavailable."""
        self.url = url
        if not is_port_name(url):
            raise PortUnavailable(without_user(url), "it is neither a device nor socket://host:port")
        if is_left_behind(Path(url)):
            raise PortUnavailable(
                url,
                f"the simulator that made this link was killed, and {os.readlink(url)} can belong to another "
                f"program now. Start the simulator again: pneuforce sim run --link {url}",
            )
        try:
            options: dict[str, bool] = {} if "://" in url else {"exclusive": True}
            self._serial = serial.serial_for_url(url, baudrate=BAUD, timeout=0, **options)
            self._serial.fileno()
        except (serial.SerialException, OSError, ValueError) as error:
            raise _port_error(url, error) from None

    def fileno(self) -> int:
        """Return the file descriptor that becomes readable when bytes arrive."""
        return int(self._serial.fileno())

    def read(self) -> bytes:
        """Return the received bytes without waiting. Raises OSError if the connection is lost."""
        return bytes(self._serial.read(MAX_READ_BYTES))

    def write(self, data: bytes) -> None:
        """Send bytes. Raises OSError if the connection is lost.

        pyserial's own timeout is not used, because it fails after a successful write if the process was
        suspended for longer than the timeout.
        """
        if not is_writable(self.fileno(), WRITE_TIMEOUT_S):
            raise TimeoutError(f"{self.url} accepts no bytes")
        os.write(self.fileno(), data)

    def close(self) -> None:
        """Close the port."""
        self._serial.close()


def is_port_name(url: str) -> bool:
    """Return True if `url` can be a device, or if it is `socket://host:port`.

    The library pyserial knows more URLs. Some of these open other files, or load other modules.
    """
    return is_socket_url(url) if "://" in url else "\0" not in url


def _port_error(url: str, error: Exception) -> PortBusy | PortUnavailable:
    """Return the exception whose message explains why a port cannot be opened."""
    code = getattr(error, "errno", None)
    if "exclusively lock" in str(error) or code == errno.EBUSY:
        return PortBusy(url)
    if code == errno.EACCES:
        return PortUnavailable(url, "no permission (add your user to the group of the device: dialout)")
    if code == errno.ENOENT:
        return PortUnavailable(
            url, "there is no such port: plug the board in, or correct the name (ls -l /dev/serial/by-id)"
        )
    return PortUnavailable(url, os.strerror(code) if code else str(error))
