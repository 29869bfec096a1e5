"""`pneuforce files`: files that are installed with the package, for users without the source code."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, NamedTuple

import typer

commands = typer.Typer()

FOLDER = Path(__file__).parents[1] / "deploy"


class InstalledFile(NamedTuple):
    """Destination and purpose of an installed file."""

    destination: str
    purpose: str


FILES = {
    "pneuforce.service": InstalledFile(
        "/etc/systemd/system", "systemd unit for an instrument in permanent operation"
    ),
    "pneuforce@.service": InstalledFile(
        "/etc/systemd/system", "systemd unit for several instruments on one computer"
    ),
    "pneuforce-overview.service": InstalledFile(
        "/etc/systemd/system", "systemd unit for the page with all instruments of a computer"
    ),
    "60-pneuforce.rules": InstalledFile(
        "/etc/udev/rules.d", "udev rules: name and latency of the board's port, no ModemManager"
    ),
    "bench.toml": InstalledFile("anywhere", "configuration for a desk: simulated rig and web page"),
    "service.toml": InstalledFile(
        "/etc/pneuforce/instrument.toml", "configuration of a service for programs on the same computer"
    ),
    "plc.toml": InstalledFile("/etc/pneuforce/instrument.toml", "configuration for a PLC over Modbus TCP"),
    "robot.toml": InstalledFile(
        "/etc/pneuforce/instrument.toml", "configuration for a robot controller over CAN"
    ),
}


@commands.command()
def files(
    name: Annotated[
        str | None, typer.Argument(help="The file to print; without a name, the files are listed.")
    ] = None,
) -> None:
    """Print an installed file: systemd unit, udev rules, or a configuration to start from.

    Example: pneuforce files plc.toml > instrument.toml
    """
    from pneuforce.errors import ConfigurationError

    if name is None:
        typer.echo(_list())
    elif name in FILES:
        typer.echo((FOLDER / name).read_text(encoding="utf-8"), nl=False)
    else:
        raise ConfigurationError(f"there is no file {name}: choose one of {', '.join(FILES)}")


def _list() -> str:
    """Return one line for each file: name, destination, purpose."""
    from pneuforce.instrument.cli.terminal.output import hanging

    name_width = max(map(len, FILES))
    destination_width = max(len(file.destination) for file in FILES.values())
    return "\n".join(
        f"{name:<{name_width}}  {file.destination:<{destination_width}}  "
        f"{hanging(file.purpose, name_width + destination_width + 4)}"
        for name, file in FILES.items()
    )
