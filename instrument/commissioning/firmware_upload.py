"""Upload of the firmware to an Arduino UNO with avrdude."""

from __future__ import annotations

import asyncio
import shutil
import subprocess
from pathlib import Path

from pneuforce.errors import ConfigurationError, NotInstalled, PortBusy, RigError
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.rig.firmware import Firmware, FirmwareOrigin
from pneuforce.instrument.rig.usb_device import is_local_device, processes_using
from pneuforce.instrument.service.host.host import Host
from pneuforce.protocol.frames import Hello
from pneuforce.support.serial_port import SerialPort

#: Signature of the ATmega328P, data sheet table 28-10.
SIGNATURE = (0x1E, 0x95, 0x0F)
#: Baud rate of Optiboot, the boot loader of the UNO.
BOOT_BAUD = 115_200
AVRDUDE_TIMEOUT_S = 60.0
LAST_LINE = "avrdude done"  #: avrdude ends its output with this text, also after an error


def avrdude_command(port: str) -> list[str]:
    """Return an avrdude command for the UNO at `port`. The caller appends the memory operation."""
    return ["avrdude", "-q", "-p", "atmega328p", "-c", "arduino", "-P", port, "-b", str(BOOT_BAUD)]


def upload_command(port: str, firmware: Path) -> list[str]:
    """Return the command that writes and verifies the Intel HEX file `firmware`.

    The option -D is necessary because the boot loader cannot erase the chip in advance.
    """
    return [*avrdude_command(port), "-D", "-U", f"flash:w:{firmware}:i"]


def upload(port: str, firmware: Path) -> tuple[Hello, Firmware]:
    """Write the firmware, and return the identification of the board and its firmware afterwards.

    The board restarts, so the rig vents. Raises ConfigurationError, or RigError also if the board reports
    another image than that of this package.
    """
    _check_port(port)
    _check_signature(port)
    _run_avrdude(upload_command(port, firmware))
    hello, reported = asyncio.run(_identify_board(port))
    if reported.origin is not FirmwareOrigin.CURRENT:
        raise RigError(
            f"the board on {port} does not answer with the image that was written, but with {reported}: "
            "flash again; if this occurs again, replace the board"
        )
    return hello, reported


def _check_port(port: str) -> None:
    """Raise ConfigurationError, PortBusy or PortUnavailable if the port cannot be used."""
    if not is_local_device(port):
        raise ConfigurationError(
            f"{port} is not a port of this machine: run pneuforce flash on the machine of the board"
        )
    if processes_using(port):
        raise PortBusy(port)
    SerialPort(port).close()


def _check_signature(port: str) -> None:
    """Raise RigError if the chip is not an ATmega328P."""
    words = _run_avrdude([*avrdude_command(port), "-U", "signature:r:-:h"]).split()
    if not any(_parse_numbers(word) == SIGNATURE for word in words):
        raise RigError(
            f"the board on {port} is not an ATmega328P (signature {' '.join(words) or 'unreadable'}, "
            f"expected {','.join(f'{byte:#x}' for byte in SIGNATURE)}): nothing was written; name the port "
            "of an Arduino UNO R3 or a copy with the ATmega328P"
        )


def _parse_numbers(word: str) -> tuple[int, ...]:
    """Return the numbers of a text like `0x1e,0x95,0xf`; no numbers for any other text."""
    try:
        return tuple(int(number, 16) for number in word.split(","))
    except ValueError:
        return ()


def _run_avrdude(command: list[str]) -> str:
    """Return avrdude's stdout. Raises NotInstalled if avrdude is missing, RigError if it fails."""
    if shutil.which(command[0]) is None:
        raise NotInstalled("avrdude is missing: sudo apt-get install avrdude")
    try:
        finished = subprocess.run(
            command, capture_output=True, text=True, timeout=AVRDUDE_TIMEOUT_S, check=False
        )
    except subprocess.TimeoutExpired:
        raise RigError(
            f"avrdude did not end within {AVRDUDE_TIMEOUT_S:g} s: check cable and board, then flash again"
        ) from None
    if finished.returncode:
        raise RigError(
            f"avrdude failed: {_error_line(finished.stderr)}; check cable and board, then flash again; if "
            "RESET-EN is cut, press the board's reset button when avrdude starts"
        )
    return finished.stdout


def _error_line(stderr: str) -> str:
    """Return the line of avrdude's output that names the error.

    An "OS error" line is skipped, because it is a consequence of the line before. The last line of avrdude
    is skipped, because it is the same after a success.
    """
    lines = [line.strip() for line in stderr.splitlines() if line.strip() and LAST_LINE not in line]
    errors = [line for line in lines if "error" in line.lower() and "OS error" not in line]
    return (errors or lines or ["no message"])[-1]


async def _identify_board(port: str) -> tuple[Hello, Firmware]:
    """Return the Hello and the firmware of the board at `port`. The rig is vented and the port is closed."""
    stop = asyncio.Event()
    host = Host(Session(Instrument(Settings())), port)
    await host.connect(stop)
    stop.set()
    await host.run(stop)
    hello, firmware = host.link.hello, host.link.firmware
    assert hello is not None
    assert firmware is not None
    return hello, firmware
