"""`pneuforce files`: what is installed beside the program, for whoever has the wheel and no clone."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, NamedTuple

import typer

commands = typer.Typer()

FOLDER = Path(__file__).parents[1] / "service"


class Beside(NamedTuple):
    """Where a file belongs, and what it is."""

    belongs_in: str
    what: str


FILES = {
    "pneuforce.service": Beside("/etc/systemd/system", "systemd unit, for an instrument that runs for years"),
    "60-pneuforce.rules": Beside("/etc/udev/rules.d", "udev rule: the board's port, its name, left in peace"),
    "bench.toml": Beside("anywhere", "configuration for a desk: simulated rig, page in the browser"),
    "plc.toml": Beside("/etc/pneuforce/instrument.toml", "configuration for a PLC over Modbus TCP"),
    "robot.toml": Beside("/etc/pneuforce/instrument.toml", "configuration for a robot controller over CAN"),
}


@commands.command()
def files(
    name: Annotated[
        str | None, typer.Argument(help="The file to print; without one, which there are.")
    ] = None,
) -> None:
    """Print a file that is installed beside the program: service, udev rule, configurations to start from.

    Example: pneuforce files plc.toml > instrument.toml
    """
    from instrument.errors import ConfigurationError

    if name is None:
        typer.echo(_listed())
    elif name in FILES:
        typer.echo((FOLDER / name).read_text(encoding="utf-8"), nl=False)
    else:
        raise ConfigurationError(f"there is no file {name}; there are {', '.join(FILES)}")


def _listed() -> str:
    names, places = max(map(len, FILES)), max(len(file.belongs_in) for file in FILES.values())
    return "\n".join(f"{name:<{names}}  {place:<{places}}  {what}" for name, (place, what) in FILES.items())
