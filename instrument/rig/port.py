"""The serial port: a device, a pty, or pyserial's `socket://host:port` for a remote rig."""

from __future__ import annotations

import errno
import os
import select
from typing import Protocol

import serial

from instrument.errors import PortBusy, PortUnavailable
from instrument.rig.frames import BAUD

READ_BYTES = 4096
WRITE_S = 0.02  #: a board that takes no bytes for longer is gone; the loop waits no longer for it


class RigLink(Protocol):
    """The seam to hardware: bytes in and out of something that a loop can wait for."""

    def fileno(self) -> int:
        """Descriptor that becomes readable when bytes have come."""
        ...

    def read(self) -> bytes:
        """Bytes that have come, without waiting; raises OSError where the far end is gone."""
        ...

    def write(self, data: bytes) -> None:
        """Send; raises OSError where the far end is gone."""
        ...

    def close(self) -> None:
        """Give the port back."""
        ...


class SerialPort:
    """An opened serial port, exclusive to this process where it is a device of this machine."""

    def __init__(self, url: str) -> None:
        """Open `url`. Raises PortBusy or PortUnavailable."""
        self.url = url
        try:
            own: dict[str, bool] = {} if "://" in url else {"exclusive": True}
            self._serial = serial.serial_for_url(url, baudrate=BAUD, timeout=0, **own)
            self._serial.fileno()
        except (serial.SerialException, OSError, ValueError) as error:
            raise _sentence(url, error) from None

    def fileno(self) -> int:
        """Descriptor that becomes readable when bytes have come."""
        return int(self._serial.fileno())

    def read(self) -> bytes:
        """Bytes that have come, without waiting; raises OSError where the far end is gone."""
        return bytes(self._serial.read(READ_BYTES))

    def write(self, data: bytes) -> None:
        """Send; raises OSError where the far end is gone.

        pyserial's own limit fails after a write that succeeded, when the processor was away for so long.
        """
        if not select.select([], [self.fileno()], [], WRITE_S)[1]:
            raise TimeoutError(f"{self.url} takes no bytes")
        os.write(self.fileno(), data)

    def close(self) -> None:
        """Give the port back."""
        self._serial.close()


def _sentence(url: str, error: Exception) -> PortBusy | PortUnavailable:
    code = getattr(error, "errno", None)
    if "exclusively lock" in str(error) or code == errno.EBUSY:
        return PortBusy(url)
    if code == errno.EACCES:
        return PortUnavailable(url, "no permission (add yourself to the group of the device: dialout)")
    if code == errno.ENOENT:
        return PortUnavailable(url, "there is no such port (is the board plugged in?)")
    return PortUnavailable(url, os.strerror(code) if code else str(error))
