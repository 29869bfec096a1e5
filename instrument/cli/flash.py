"""`pneuforce flash`: put the firmware on an Arduino UNO with avrdude, and wait until it answers."""

from __future__ import annotations

import asyncio
import json
import shlex
import shutil
import subprocess
from typing import Any

from instrument.core import Instrument
from instrument.coupling import Coupling
from instrument.errors import ConfigurationError, PortBusy, RigError
from instrument.host import Host
from instrument.rig.device import holders, is_device
from instrument.rig.frames import PROTOCOL_VERSION, Hello
from instrument.rig.port import SerialPort
from instrument.settings import Settings
from sim.avr.toolchain import HEX, SKETCH
from sim.board.board import FIRMWARE

#: ATmega328P, data sheet table 28-10. Optiboot, the UNO's boot loader, listens at 115200 baud.
SIGNATURE = (0x1E, 0x95, 0x0F)
BOOT_BAUD = 115_200
PATIENCE_S = 60.0
FAREWELL = "avrdude done"


def talk(port: str) -> list[str]:
    """What avrdude needs to talk to the boot loader of an UNO at `port`."""
    return ["avrdude", "-q", "-p", "atmega328p", "-c", "arduino", "-P", port, "-b", str(BOOT_BAUD)]


def flash_command(port: str) -> list[str]:
    """The command that writes the firmware, and reads it back; the boot loader cannot erase in advance."""
    return [*talk(port), "-D", "-U", f"flash:w:{HEX}:i"]


def run_flash(port: str, dry_run: bool, as_json: bool = False) -> None:
    """Flash the board at `port` and say which version answers then. Raises ConfigurationError, RigError.

    The board restarts: the balloon is vented. With `dry_run` the command is printed only.
    """
    command = flash_command(port)
    plan = {"firmware": _revision(FIRMWARE), "protocol": PROTOCOL_VERSION, "sketch": str(SKETCH)}
    if not as_json:
        print("firmware {firmware}, protocol {protocol}, made from {sketch}".format(**plan))
        print(shlex.join(command), flush=True)
    answers = None if dry_run else _flashed(port, command)
    if as_json:
        print(json.dumps({**plan, "command": command, "answers": answers}))
    elif answers:
        print("firmware {firmware} answers, board {serial}".format(**answers))


def _flashed(port: str, command: list[str]) -> dict[str, Any]:
    """What answers at `port` once the command has been run there."""
    _refuse_others(port)
    _check_signature(port)
    _avrdude(command)
    hello = asyncio.run(_greeted(port))
    return {"firmware": _revision(hello.firmware), "serial": hello.serial}


def _revision(firmware: int) -> str:
    return f"{firmware >> 8}.{firmware & 0xFF}"


def _refuse_others(port: str) -> None:
    """Raises PortBusy or PortUnavailable where the port is not ours to use, ConfigurationError."""
    if not is_device(port):
        raise ConfigurationError(f"{port} is not a port of this machine: a board is flashed where it is")
    if holders(port):
        raise PortBusy(port)
    SerialPort(port).close()


def _check_signature(port: str) -> None:
    read = _avrdude([*talk(port), "-U", "signature:r:-:h"]).split()
    if not any(_numbers(word) == SIGNATURE for word in read):
        raise RigError(
            f"the board on {port} is not an ATmega328P (signature {' '.join(read) or 'unreadable'}, "
            f"expected {','.join(f'{byte:#x}' for byte in SIGNATURE)}): nothing was written"
        )


def _numbers(word: str) -> tuple[int, ...]:
    """The numbers of `0x1e,0x95,0xf`, none where it is something else."""
    try:
        return tuple(int(number, 16) for number in word.split(","))
    except ValueError:
        return ()


def _avrdude(command: list[str]) -> str:
    """What avrdude prints on stdout. Raises ConfigurationError where it is missing, RigError."""
    if shutil.which(command[0]) is None:
        raise ConfigurationError("avrdude is missing: apt-get install avrdude")
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    except subprocess.TimeoutExpired:
        raise RigError(f"avrdude did not end within {PATIENCE_S:g} s") from None
    if done.returncode:
        raise RigError(
            f"avrdude failed: {_complaint(done.stderr)}; with RESET-EN cut, press the board's reset button "
            "as it begins"
        )
    return done.stdout


def _complaint(said: str) -> str:
    """The line of avrdude's that says what is wrong; its last one is a farewell, whatever has happened.

    Its "OS error" says only what the line before it caused.
    """
    lines = [line.strip() for line in said.splitlines() if line.strip() and FAREWELL not in line]
    errors = [line for line in lines if "error" in line.lower() and "OS error" not in line]
    return (errors or lines or ["it said nothing"])[-1]


async def _greeted(port: str) -> Hello:
    """The greeting of the board at `port`, which is vented and given back."""
    stop = asyncio.Event()
    host = Host(Coupling(Instrument(Settings())), port)
    await host.connect(stop)
    stop.set()
    await host.run(stop)
    assert host.link.hello is not None
    return host.link.hello
