"""The commands that make and use recordings: record, export, evaluate, plot, replay."""

from __future__ import annotations

import math
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from pneuforce.instrument.cli.recordings.reference_options import ReferenceOptions
from pneuforce.instrument.cli.terminal.option_groups import expand_options
from pneuforce.instrument.cli.terminal.options import FromS, Json, Overwrite, Seconds, ToS, span

commands = typer.Typer()

RecordingFile = Annotated[Path, typer.Argument(metavar="FILE", help="The recording.")]


class ExportFormat(Enum):
    """File formats of an export."""

    CSV = "csv"
    PARQUET = "parquet"
    VALIDATION = "validation"


@commands.command()
def record(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A new file.")],
    config: Annotated[
        Path | None, typer.Option("--config", help="The instrument.toml of the running instrument.")
    ] = None,
    socket: Annotated[
        Path | None, typer.Option("--socket", help="Local socket of the instrument, instead of --config.")
    ] = None,
    seconds: Seconds = None,
    max_mb: Annotated[
        float, typer.Option(help="End when the recording has this size, in MB.", min=1.0)
    ] = math.inf,
    min_free_mb: Annotated[
        float, typer.Option(help="End when less than this is free on the disk, in MB.", min=0.0)
    ] = 0.0,
    until_stdin_closes: Annotated[
        bool, typer.Option("--until-stdin-closes", help="End when stdin is closed, for use by a program.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Record all inputs and measurements of a running instrument into one file.

    Without --config and --socket, the running demo is recorded.

    Example: pneuforce record press.recording --config instrument.toml --seconds 60
    """
    from pneuforce.instrument.cli.recordings.record import RecordEnd, record, socket_of_demo
    from pneuforce.instrument.recording.limits import RecordingLimits

    socket_path = _socket_of(config, socket) or socket_of_demo()
    duration_s = math.inf if seconds is None else seconds
    limits = RecordingLimits(max_mb * 1e6, min_free_mb * 1e6, duration_s)
    raise typer.Exit(record(file, socket_path, RecordEnd(limits, until_stdin_closes), as_json))


def _socket_of(config: Path | None, socket: Path | None) -> Path | None:
    from pneuforce.errors import ConfigurationError
    from pneuforce.instrument.config import read, resolve_path

    if config is None:
        return socket
    if socket is not None:
        raise ConfigurationError("--config and --socket both name an instrument: give only one of them")
    path = resolve_path(config, read(config).local.socket)
    if path is None:
        raise ConfigurationError(
            f'{config}: local.socket = "" disables the local socket: set it to record this instrument'
        )
    return path


@commands.command()
@expand_options
def export(
    file: RecordingFile,
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Output file, .csv or .parquet.")],
    form: Annotated[
        ExportFormat | None, typer.Option("--format", help="File format; by default, by the name of OUT.")
    ] = None,
    from_s: FromS = None,
    to_s: ToS = None,
    contacts: Annotated[
        bool, typer.Option("--contacts", help="Write one row per contact, instead of one row per sample.")
    ] = False,
    overwrite: Overwrite = False,
    as_json: Json = False,
    *,
    reference: ReferenceOptions,
) -> None:
    """Write the samples of a recording as a table for a spreadsheet, pandas or pneuforce validate.

    The format validation also needs the force of a reference sensor (--reference).

    Example: pneuforce export press.recording press.csv --from-s 10 --to-s 20

    Example: pneuforce export press.recording recorded-contacts.csv --contacts
    """
    from pneuforce.instrument.cli.recordings.export import ExportOptions, export

    name = form.value if form else None
    options = ExportOptions(out, name, *span(from_s, to_s), reference.input(), contacts, overwrite)
    raise typer.Exit(export(file, options, as_json))


@commands.command()
@expand_options
def evaluate(
    file: RecordingFile,
    config: Annotated[
        Path | None,
        typer.Option("--config", help="The instrument.toml with the calibration to evaluate with."),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(
            "--calibration", help="Calibration file to evaluate with, instead of that of the configuration."
        ),
    ] = None,
    contacts: Annotated[
        Path | None, typer.Option("--contacts", help="Write one row per contact to this .csv or .parquet.")
    ] = None,
    samples: Annotated[
        Path | None, typer.Option("--samples", help="Write one row per sample to this .csv or .parquet.")
    ] = None,
    reference_gain_percent: Annotated[
        float | None,
        typer.Option(
            help="With --reference: standard uncertainty of the gain of the reference sensor, in %.",
            min=0.0,
            max=10.0,
        ),
    ] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
    *,
    reference: ReferenceOptions,
) -> None:
    """Compute the forces of a recording again, with another calibration, and compare them.

    The instrument computes all forces from the recorded inputs. The recording is not changed. Give --config
    or --calibration, or compare with --reference. What is not given is taken from the recording.
    With --reference, the command also shows the share of contacts whose reference force is within ±2u.

    Example: pneuforce evaluate press.recording --config instrument.toml --contacts evaluated-contacts.csv

    Example: pneuforce evaluate press.recording --calibration calibration.toml --reference cell.csv
    """
    from pneuforce.errors import ConfigurationError
    from pneuforce.instrument.cli.recordings.evaluate import EvaluationFiles, EvaluationInput, evaluate

    given = reference.input()
    if given is None and reference_gain_percent is not None:
        raise ConfigurationError("--reference-gain-percent can be used only with --reference")
    inputs = EvaluationInput(file, config, calibration, given, (reference_gain_percent or 0.0) / 100)
    raise typer.Exit(evaluate(inputs, EvaluationFiles(contacts, samples, overwrite), as_json))


@commands.command()
@expand_options
def plot(
    file: RecordingFile,
    out: Annotated[
        Path | None,
        typer.Argument(
            metavar="OUT", help="Output file, .png, .svg or .pdf; by default, FILE with the suffix .png."
        ),
    ] = None,
    from_s: FromS = None,
    to_s: ToS = None,
    by_pressure: Annotated[
        bool,
        typer.Option("--by-pressure", help="Draw the uncertainty of the peak forces by pressure bin."),
    ] = False,
    config: Annotated[
        Path | None,
        typer.Option("--config", help="Compute the forces again, with this instrument.toml."),
    ] = None,
    title: Annotated[str | None, typer.Option(help="Title, instead of the name of the recording.")] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
    *,
    reference: ReferenceOptions,
) -> None:
    """Draw a recording: pressure with ΔP_i and ΔP_f of each contact, and force with ±2u.

    With --by-pressure and --reference, the errors beside the force of a reference sensor are drawn.

    Example: pneuforce plot press.recording press.svg --from-s 10 --to-s 40
    """
    from pneuforce.instrument.cli.recordings.plot import plot
    from pneuforce.instrument.validation.recording_plot import PlotOptions

    options = PlotOptions(file, out, *span(from_s, to_s), by_pressure, reference.input(), title, overwrite)
    raise typer.Exit(plot(options, config, as_json))


@commands.command()
def replay(
    file: RecordingFile,
    config: Annotated[
        Path | None, typer.Option("--config", help="Play the recording on the buses of this instrument.toml.")
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option("--speed", min=0.1, max=100.0, help="Multiple of the recorded speed, 1 by default."),
    ] = None,
    loop: Annotated[bool, typer.Option("--loop", help="Start again at the end, until Ctrl-C.")] = False,
    as_json: Json = False,
) -> None:
    """Verify a recording: compute its samples again from the inputs, and compare them bit by bit.

    The exit code is 1 if a sample differs or the file is damaged.

    With --config, nothing is verified: the recording is played on the buses and marked as simulated.
    During this replay, every write except a vent is rejected.

    Example: pneuforce replay press.recording --config instrument.toml --speed 0.5
    """
    from pneuforce.instrument.cli.recordings.replay import replay

    if config is None:
        _check_no_bus_options(speed, loop)
        raise typer.Exit(replay(file, as_json))
    _play(file, config, 1.0 if speed is None else speed, loop, as_json)


def _check_no_bus_options(speed: float | None, loop: bool) -> None:
    from pneuforce.errors import ConfigurationError

    if speed is not None or loop:
        raise ConfigurationError("--speed and --loop need --config, which defines the buses of the replay")


def _play(file: Path, config: Path, speed: float, loop: bool, as_json: bool) -> None:
    from pneuforce.errors import ConfigurationError
    from pneuforce.instrument.config import read, resolve_path
    from pneuforce.instrument.service.processes.web_process import web_tls_files
    from pneuforce.instrument.service.replay_host import serve_replay
    from pneuforce.instrument.service.serve import ServiceFiles

    if as_json:
        raise ConfigurationError(
            "--json is not valid with --config: a replay on buses has no result to print"
        )
    configuration = read(config)
    files = ServiceFiles(
        socket=resolve_path(config, configuration.local.socket), web=web_tls_files(configuration.web, config)
    )
    serve_replay(file, configuration, files, speed, loop)
