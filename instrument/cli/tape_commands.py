"""The commands that make recordings and use them."""

from __future__ import annotations

import math
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from instrument.cli.options import Json, Seconds

commands = typer.Typer()

Recorded = Annotated[Path, typer.Argument(metavar="FILE", help="The recording.")]
FromS = Annotated[float | None, typer.Option("--from-s", help="From so long after its beginning, in s.")]
ToS = Annotated[float | None, typer.Option("--to-s", help="Up to so long after its beginning, in s.")]


class ExportFormat(Enum):
    """What a recording is exported as."""

    CSV = "csv"
    PARQUET = "parquet"
    VALIDATION = "validation"


@commands.command()
def record(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A new file.")],
    config: Annotated[
        Path | None, typer.Option("--config", help="The instrument.toml of the instrument that runs.")
    ] = None,
    socket: Annotated[Path | None, typer.Option("--socket", help="Its local socket, instead.")] = None,
    seconds: Seconds = None,
    as_json: Json = False,
) -> None:
    """Record all that a running instrument is told and measures, into one file.

    Without --config and --socket it is the running demo that is recorded.

    Example: pneuforce record press.tape --config instrument.toml --seconds 60
    """
    from instrument.cli.record import record, socket_of_demo

    at = _socket_of(config, socket) or socket_of_demo()
    raise typer.Exit(record(file, at, seconds, as_json))


def _socket_of(config: Path | None, socket: Path | None) -> Path | None:
    from instrument.config import beside, read
    from instrument.errors import ConfigurationError

    if config is None:
        return socket
    if socket is not None:
        raise ConfigurationError("--config and --socket both name an instrument: give one of them")
    named = beside(config, read(config).local.socket)
    if named is None:
        raise ConfigurationError(f'{config}: local.socket = "", so this instrument cannot be recorded')
    return named


@commands.command()
def export(
    file: Recorded,
    out: Annotated[Path, typer.Argument(metavar="OUT", help="The file to make: .csv or .parquet.")],
    form: Annotated[
        ExportFormat | None, typer.Option("--format", help="What it becomes; without it, by its name.")
    ] = None,
    from_s: FromS = None,
    to_s: ToS = None,
    reference: Annotated[
        Path | None,
        typer.Option(
            "--reference", help="validation only: a CSV of the true force, columns t_s and force_n."
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Make a table of a recording's samples, for a spreadsheet, pandas or pneuforce validate.

    Example: pneuforce export press.tape press.parquet --from-s 10 --to-s 20
    """
    from instrument.cli.export import Wanted, export

    wanted = Wanted(out, form.value if form else None, *_span(from_s, to_s), reference)
    raise typer.Exit(export(file, wanted, as_json))


@commands.command()
def plot(
    file: Recorded,
    out: Annotated[
        Path | None, typer.Argument(metavar="OUT", help="A .png or .svg; beside the recording without it.")
    ] = None,
    from_s: FromS = None,
    to_s: ToS = None,
    by_pressure: Annotated[
        bool, typer.Option("--by-pressure", help="How sure the peak forces are, by fifths of the pressure.")
    ] = False,
    reference: Annotated[
        Path | None,
        typer.Option(help="With --by-pressure: their errors beside a CSV, columns t_s and force_n."),
    ] = None,
    title: Annotated[str | None, typer.Option(help="Instead of the recording's name.")] = None,
) -> None:
    """Draw a recording: pressure with the ΔP_i and ΔP_f of each contact, force with ±2u.

    Example: pneuforce plot press.tape press.svg --from-s 10 --to-s 40
    """
    from instrument.cli.plot import Wish, plot

    raise typer.Exit(plot(Wish(file, out, *_span(from_s, to_s), by_pressure, reference, title)))


def _span(from_s: float | None, to_s: float | None) -> tuple[float, float]:
    """Without an end what it leaves open."""
    return -math.inf if from_s is None else from_s, math.inf if to_s is None else to_s


@commands.command()
def replay(
    file: Recorded,
    config: Annotated[
        Path | None, typer.Option("--config", help="Play it on the buses of this instrument.toml.")
    ] = None,
    speed: Annotated[
        float | None, typer.Option("--speed", min=0.1, max=100.0, help="So many times as fast; 1 without it.")
    ] = None,
    loop: Annotated[bool, typer.Option("--loop", help="Begin again at the end, until Ctrl-C.")] = False,
    as_json: Json = False,
) -> None:
    """Measure once more what was recorded: is each sample the same, to the last bit? Exit code 1: one is not.

    With --config nothing is verified: the buses show the recording as they showed it, marked as simulated.
    They refuse each write but a vent.

    Example: pneuforce replay press.tape --config instrument.toml --speed 0.5
    """
    from instrument.cli.replay import replay

    if config is None:
        _refuse_without_buses(speed, loop)
        raise typer.Exit(replay(file, as_json))
    _play(file, config, 1.0 if speed is None else speed, loop, as_json)


def _refuse_without_buses(speed: float | None, loop: bool) -> None:
    from instrument.errors import ConfigurationError

    if speed is not None or loop:
        raise ConfigurationError("--speed and --loop are for a replay on buses: name them with --config")


def _play(file: Path, config: Path, speed: float, loop: bool, as_json: bool) -> None:
    from instrument.cli.player import play
    from instrument.config import beside, read
    from instrument.errors import ConfigurationError

    if as_json:
        raise ConfigurationError("--json is for a replay without --config, which has a verdict")
    configuration = read(config)
    play(file, configuration, beside(config, configuration.local.socket), speed, loop)
