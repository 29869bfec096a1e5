"""`pneuforce sign`: sign the configuration and the calibration, and check signatures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pneuforce.instrument.cli.terminal.options import Json

commands = typer.Typer(
    no_args_is_help=True,
    help="Sign the configuration and the calibration, so that the instrument detects an altered file.",
)


@commands.command()
def new_key(
    key: Annotated[Path, typer.Argument(help="New file for the private key; the public key is KEY.pub.")],
    signer: Annotated[str, typer.Option(help="Name of the person or the laboratory that owns the key.")],
    passphrase: Annotated[
        bool, typer.Option(help="Ask for a passphrase, which protects a stolen file of the key.")
    ] = True,
) -> None:
    """Make a key (Ed25519), and print the line for the file trusted-keys of the instruments.

    Keep the private key off the instrument.

    Example: pneuforce sign new-key calibration-lab.key --signer calibration-lab
    """
    from pneuforce.instrument.cli.access.sign import make_key

    typer.echo(make_key(key, signer, passphrase))


@commands.command("file")
def file_(
    files: Annotated[list[Path], typer.Argument(help="Configuration and calibration files.", metavar="FILE")],
    key: Annotated[
        Path, typer.Option(help="Private key; or the public key, if ssh-agent has the private key.")
    ],
) -> None:
    """Sign files: write FILE.sig beside each file, and replace an old signature.

    Example: pneuforce sign file instrument.toml calibration.toml --key calibration-lab.key
    """
    from pneuforce.instrument.cli.access.sign import sign_files

    typer.echo(sign_files(files, key))


@commands.command()
def check(
    files: Annotated[list[Path], typer.Argument(help="Configuration and calibration files.", metavar="FILE")],
    trusted_keys: Annotated[
        Path | None, typer.Option(help="File of trusted keys; by default trusted-keys beside each file.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Print who has signed each file. The exit code is 1 if a file is not signed by a trusted key.

    Example: pneuforce sign check instrument.toml calibration.toml
    """
    from pneuforce.instrument.cli.access.sign import check_files

    raise typer.Exit(check_files(files, trusted_keys, as_json))
