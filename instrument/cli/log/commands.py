"""The commands `pneuforce log …` for the event log."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from pneuforce.instrument.cli.terminal.options import Json, Overwrite

commands = typer.Typer(
    help="Show, verify or copy the event log: every write request with its result, faults, start and stop.",
    no_args_is_help=True,
)

File = Annotated[
    Path | None, typer.Option("--file", help="The event log; by default events.sqlite in this folder.")
]
Config = Annotated[
    Path | None, typer.Option("--config", help="The instrument.toml that names the log, instead of --file.")
]

WitnessUrl = Annotated[
    str | None,
    typer.Option(
        "--witness",
        metavar="URL",
        help="Address of the Prometheus server that reads this instrument, for example "
        "http://127.0.0.1:9090: the log must contain each head that it has stored.",
    ),
]
Instance = Annotated[
    str | None,
    typer.Option(
        "--instance",
        help="With --witness, if Prometheus reads several instruments: the instance label of this "
        "instrument, for example 192.168.1.9:8080.",
    ),
]


def _parse_time(text: str) -> datetime:
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        raise typer.BadParameter(
            "a UTC time is expected, for example 2027-01-31 or 2027-01-31T08:00:00"
        ) from None


@commands.command()
def show(
    file: File = None,
    config: Config = None,
    last: Annotated[int, typer.Option("--last", min=0, help="Number of records; 0 shows all.")] = 50,
    since: Annotated[
        datetime | None,
        typer.Option(
            "--since",
            help="Only records from this UTC time on, for example 2027-01-31T08:00:00.",
            metavar="TIME",
            parser=_parse_time,
        ),
    ] = None,
    follow: Annotated[bool, typer.Option("--follow", help="Also show new records, until Ctrl-C.")] = False,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print CSV, for a spreadsheet.")] = False,
    as_json: Json = False,
) -> None:
    """Show the latest records, even while the instrument is running.

    With --json, each record is one line with its number, its fields and its digest. With --csv, the columns
    are number, at (UTC), who, kind, result, what and digest.

    Example: pneuforce log show --last 20

    Example: pneuforce log show --last 0 --csv > events.csv
    """
    from pneuforce.errors import UsageError
    from pneuforce.instrument.cli.log.table import EventSelection, show_events

    if as_csv and as_json:
        raise UsageError("--csv and --json both set the output format: give only one of them")
    show_events(_log_file(file, config), EventSelection(last, since, follow), as_json, as_csv)


@commands.command()
def verify(
    file: File = None,
    config: Config = None,
    head: Annotated[
        str | None, typer.Option("--head", help="A head that you noted earlier: it must still be in the log.")
    ] = None,
    anchors: Annotated[
        Path | None,
        typer.Option(
            "--anchors",
            help="Output of journalctl, or - for stdin: the log must contain each head in this output.",
        ),
    ] = None,
    earlier: Annotated[
        list[Path] | None,
        typer.Option(
            "--earlier",
            help="With --anchors, --noted or --witness: a log that was moved away; repeat for more, the "
            "oldest first.",
        ),
    ] = None,
    noted: Annotated[
        list[str] | None,
        typer.Option(
            "--noted",
            metavar="NUMBER:DIGITS",
            help="A head that a PLC has stored: the number of records, a colon, and the first 8 or 16 "
            "hexadecimal digits of the digest, from registers 784–789; the log must contain it. Example: "
            "--noted 1234:49a95ea7d278907c; repeat for more.",
        ),
    ] = None,
    witness: WitnessUrl = None,
    instance: Instance = None,
    as_json: Json = False,
) -> None:
    """Recompute all digests to find records that were changed, removed or inserted.

    The exit code is 1 if the log was changed.

    A person who can write the file can also cut its end or recompute the whole chain.
    Such a change is found with --anchors, --head, --noted or --witness.
    The instrument logs its head as an anchor at its start, each hour and at its end.
    A head that you note yourself must be in a place that others cannot write.

    Example: journalctl -u pneuforce | pneuforce log verify --config instrument.toml --anchors -
    """
    from pneuforce.instrument.cli.log.verification import Verification, verify_events

    known = Verification(head, anchors, tuple(earlier or ()), tuple(noted or ()), witness, instance)
    raise typer.Exit(verify_events(_log_file(file, config), known, as_json))


@commands.command()
def copy(
    target: Annotated[Path, typer.Argument(help="File of the copy.", metavar="TARGET")],
    file: File = None,
    config: Config = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Copy the log to another file, even while the instrument is running, and verify the copy.

    The copy is one file that only its owner can read, and contains all records of one time.
    If a record is wrong, the exit code is 1 and no copy is written.

    Example: pneuforce log copy backup/events.sqlite --config instrument.toml
    """
    from pneuforce.instrument.cli.log.copying import copy_events

    raise typer.Exit(copy_events(_log_file(file, config), target, overwrite, as_json))


def _log_file(file: Path | None, config: Path | None) -> Path:
    from pneuforce.errors import ConfigurationError
    from pneuforce.instrument.config import read, resolve_path

    if config is None:
        default = Path("events.sqlite")
        if file is None and not default.exists():
            raise ConfigurationError(
                "this folder has no events.sqlite: name the configuration of the instrument (--config), or "
                "the log (--file)"
            )
        return file or default
    if file is not None:
        raise ConfigurationError("--file and --config both name a log: give only one of them")
    path = resolve_path(config, read(config).events.file)
    if path is None:
        raise ConfigurationError(
            f'{config}: events.file = "" disables the event log: there is no log to read'
        )
    return path
