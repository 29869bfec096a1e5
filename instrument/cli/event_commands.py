"""The commands that read the event log."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from instrument.cli.options import Json

commands = typer.Typer(help="What was asked of the instrument, and what became of it.", no_args_is_help=True)

File = Annotated[
    Path | None, typer.Option("--file", help="The event log; without it, events.sqlite in this folder.")
]
Config = Annotated[
    Path | None, typer.Option("--config", help="The instrument.toml whose log it is, instead of --file.")
]


def _moment(text: str) -> datetime:
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        raise typer.BadParameter("a time in UTC is wanted, as 2027-01-31 or 2027-01-31T08:00:00") from None


@commands.command()
def show(
    file: File = None,
    config: Config = None,
    last: Annotated[int, typer.Option("--last", min=0, help="So many records; 0 shows all.")] = 50,
    since: Annotated[
        datetime | None,
        typer.Option(
            "--since", help="From this time on, UTC: 2027-01-31T08:00:00.", metavar="TIME", parser=_moment
        ),
    ] = None,
    follow: Annotated[bool, typer.Option("--follow", help="Go on with what is added, until Ctrl-C.")] = False,
    as_json: Json = False,
) -> None:
    """Show the latest records, also while the instrument runs.

    With --json each is one line as it was sealed, with its number and seal.

    Example: pneuforce log show --last 20
    """
    from instrument.cli.event_table import Choice, show_events

    show_events(_chosen(file, config), Choice(last, since, follow), as_json)


@commands.command()
def verify(
    file: File = None,
    config: Config = None,
    head: Annotated[
        str | None, typer.Option("--head", help="A head that was noted earlier: it must still be in the log.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Reckon all seals anew: was a record changed, taken out or put in? Exit code 1 where one was.

    Who can write the file can also make a new chain.
    So note the head that this prints, where others cannot write.
    With it, --head shows whether all up to then is still as it was.

    Example: pneuforce log verify --config instrument.toml
    """
    from instrument.cli.event_table import verify_events

    raise typer.Exit(verify_events(_chosen(file, config), head, as_json))


def _chosen(file: Path | None, config: Path | None) -> Path:
    from instrument.config import beside, read
    from instrument.errors import ConfigurationError

    if config is None:
        return file or Path("events.sqlite")
    if file is not None:
        raise ConfigurationError("--file and --config both name a log: give one of them")
    named = beside(config, read(config).events.file)
    if named is None:
        raise ConfigurationError(f'{config}: events.file = "", so this instrument keeps no log')
    return named
