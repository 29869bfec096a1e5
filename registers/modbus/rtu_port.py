"""A serial port as the end of a Modbus line: opened as configured, or why it cannot be."""

from __future__ import annotations

import contextlib
import errno
import os
import termios

import serial

PARITIES = {"even": serial.PARITY_EVEN, "odd": serial.PARITY_ODD, "none": serial.PARITY_NONE}
_PTY_MAJORS = range(136, 144)  #: Linux, Documentation/admin-guide/devices.txt


def opened(port: str, baud: int, parity: str, stop_bits: int) -> serial.Serial:
    """The port, exclusive to this process, read without waiting. Raises OSError in a sentence."""
    try:
        return serial.Serial(
            port,
            baud,
            parity=PARITIES[possible_parity(port, parity)],
            stopbits=stop_bits,
            timeout=0,
            exclusive=True,
        )
    except (OSError, termios.error) as error:
        raise OSError(f"{port} cannot be opened: {why(error)}") from None


def possible_parity(port: str, parity: str) -> str:
    """As configured; none on a pty, which has no line and refuses to be told of it a second time."""
    with contextlib.suppress(OSError):  # told by who opens it
        if os.major(os.stat(port).st_rdev) in _PTY_MAJORS:
            return "none"
    return parity


def why(error: Exception) -> str:
    """What is wrong with a port, for people."""
    code = getattr(error, "errno", None)
    if "exclusively lock" in str(error) or code == errno.EBUSY:
        return "another process uses it"
    if code == errno.EACCES:
        return "no permission; its group is dialout"
    if "configure port" in str(error):
        return "it is no serial port, or does not know these settings"
    return os.strerror(code).lower() if code else str(error)
