"""Serial port of a Modbus RTU line: opened with the configured settings, with error messages for users."""

from __future__ import annotations

import contextlib
import errno
import os
import termios
from typing import TypeAlias

import serial

RtuPort: TypeAlias = serial.Serial
PARITIES = {"even": serial.PARITY_EVEN, "odd": serial.PARITY_ODD, "none": serial.PARITY_NONE}
_PTY_MAJORS = range(136, 144)  #: major device numbers of ptys (Linux, Documentation/admin-guide/devices.txt)


def open_port(port: str, baud: int, parity: str, stop_bits: int) -> RtuPort:
    """Open the port for exclusive use and non-blocking reads.

    Raises OSError if the port cannot be opened. The message names the cause.
    """
    try:
        return serial.Serial(
            port,
            baud,
            parity=PARITIES[supported_parity(port, parity)],
            stopbits=stop_bits,
            timeout=0,
            exclusive=True,
        )
    except (OSError, termios.error) as error:
        raise OSError(f"{port} cannot be opened: {describe_port_error(error)}") from None


def supported_parity(port: str, parity: str) -> str:
    """Return `parity`, or "none" for a pty. A pty rejects a parity that is set a second time."""
    with contextlib.suppress(OSError):  # `open_port` reports the same error to the user
        if os.major(os.stat(port).st_rdev) in _PTY_MAJORS:
            return "none"
    return parity


def describe_port_error(error: Exception) -> str:
    """Return the cause of a port error as a text for users."""
    code = getattr(error, "errno", None)
    if "exclusively lock" in str(error) or code == errno.EBUSY:
        return "another process uses it"
    if code == errno.EACCES:
        return "no permission (add yourself to the group of the device: dialout)"
    if "configure port" in str(error):
        return "it is not a serial port, or it does not support these settings"
    return os.strerror(code).lower() if code else str(error)


def discard_output(port: RtuPort) -> None:
    """Discard the bytes that the port has not yet sent. Errors are ignored."""
    with contextlib.suppress(OSError, termios.error):
        port.reset_output_buffer()
