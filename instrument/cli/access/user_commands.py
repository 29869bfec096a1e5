"""The commands `pneuforce users …` for the users of the web page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from pneuforce.instrument.cli.terminal.options import Json

commands = typer.Typer(
    no_args_is_help=True,
    help="Users of the web page: add, list or remove them, or set a password. A running instrument uses the "
    "changed file at once.",
)

Role = Literal["viewer", "operator"]  #: the default roles of `registers/rights.py`

Name = Annotated[
    str, typer.Argument(help="Name of the user: small letters, digits, and the characters . _ -.")
]
File = Annotated[
    Path | None,
    typer.Option("--file", help="The file of the users; by default users.toml in this folder, if it exists."),
]
Config = Annotated[
    Path | None, typer.Option("--config", help="The instrument.toml that names the file, instead of --file.")
]


@commands.command()
def add(
    name: Name,
    role: Annotated[
        Role,
        typer.Option(
            "--role",
            help="An operator uses all controls of the page. A viewer reads, vents and nothing else.",
        ),
    ],
    file: File = None,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """Add a user of the web page.

    The password is asked for twice. If stdin is not a terminal, it is the first line of stdin.
    It needs at least 12 characters.
    The file contains only a salted hash of the password, and only its owner can read the file.

    Example: pneuforce users add anna --role operator --config instrument.toml
    """
    from pneuforce.instrument.cli.access.users import add_user

    add_user(_users_file(file, config, may_be_new=True), name, role, as_json)


@commands.command("list")
def list_(file: File = None, config: Config = None, as_json: Json = False) -> None:
    """List the users with their roles.

    Example: pneuforce users list --config instrument.toml
    """
    from pneuforce.instrument.cli.access.users import list_users

    list_users(_users_file(file, config), as_json)


@commands.command()
def remove(name: Name, file: File = None, config: Config = None, as_json: Json = False) -> None:
    """Remove a user. Pages on which this user is logged in become read-only.

    Example: pneuforce users remove anna --config instrument.toml
    """
    from pneuforce.instrument.cli.access.users import remove_user

    remove_user(_users_file(file, config), name, as_json)


@commands.command()
def password(name: Name, file: File = None, config: Config = None, as_json: Json = False) -> None:
    """Set a new password of a user. Pages on which this user is logged in become read-only.

    The password is asked for twice. If stdin is not a terminal, it is the first line of stdin.

    Example: pneuforce users password anna --config instrument.toml
    """
    from pneuforce.instrument.cli.access.users import set_password

    set_password(_users_file(file, config), name, as_json)


def _users_file(file: Path | None, config: Path | None, may_be_new: bool = False) -> Path:
    """Return the file that the options name. Raises ConfigurationError."""
    from pneuforce.errors import ConfigurationError
    from pneuforce.instrument.config import read, resolve_path

    if file is not None and config is not None:
        raise ConfigurationError("--file and --config both name a file: give only one of them")
    path = file or Path("users.toml")
    if config is not None:
        named = resolve_path(config, read(config).web.users_file)
        if named is None:
            raise ConfigurationError(f'{config}: web.users_file = "" disables logins: name a file')
        path = named
    elif file is None and not path.exists():
        raise ConfigurationError(
            "this folder has no users.toml: name the configuration of the instrument (--config), or the file "
            "(--file)"
        )
    if not may_be_new and not path.exists():
        raise ConfigurationError(
            f"{path}: no such file: no user exists yet (pneuforce users add creates the file)"
        )
    return path
